"""Virtual controllers of Thorlabs APT; pages in docstrings are those of the document.

The way of a frame, and of what it causes::

    AptInstrument.receive           instrument.py    bytes from the host
     -> RequestReader.feed          framings/        cuts it into frames; the address selects the controller
     -> Controller.receive          controller.py    looks up what takes the message:
         -> Parameters.store        parameters.py       SET and REQ, by the registry alone (facts.py)
         -> a method @handles       channel.py         what starts something: motor/, piezo/, ...
         -> a Panel                 rack.py            bays, digital inputs and outputs
         -> a method of its own                        updates, keep-alive, muting, HW_GET_INFO (identity.py)
     -> Controller.send                              then and there, or later from a timer of the behaviour
     -> Transmitter.send            transmitter.py   withheld, muted, or made odd (quirks.py)
     -> AptInstrument.on_send                        bytes to the host

A unit is put together in instrument.py, which has the table of behaviours, too.
"""
