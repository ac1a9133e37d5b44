"""Virtual controllers of Thorlabs APT; pages in docstrings are those of the document.

The path of a frame and of its answers::

    AptInstrument.receive           instrument.py    bytes from the host
     -> RequestReader.feed          framings/        cuts it into frames; the address selects the controller
     -> Controller.receive          controller.py    looks up the handler of the message:
         -> Parameters.store        parameters.py      SET and REQ, from the registry alone (facts.py)
         -> a method @handles       channel.py         actions of a behaviour: motor/, piezo/, ...
         -> a Panel                 rack.py            bays, digital inputs and outputs
         -> a method of Controller                     updates, keep-alive, muting, HW_GET_INFO (identity.py)
     -> Controller.send                              immediately, or later from a timer of the behaviour
     -> Transmitter.send            transmitter.py   withholds, mutes or changes it (quirks.py)
     -> AptInstrument.on_send                        bytes to the host

instrument.py builds units and has the table of behaviours.
"""
