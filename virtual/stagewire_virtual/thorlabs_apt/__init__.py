"""Virtual controllers of Thorlabs APT; pages in docstrings are those of the document.

The way of a frame, and of what it causes::

    AptInstrument.receive           instrument.py    bytes from the host
     -> Listener.hear               listening.py     cut into frames; the address tells the controller
     -> Controller.receive          controller.py    looks up what takes the message:
         -> Parameters.take, tell   parameters.py      SET and REQ, by the registry alone (facts.py)
         -> a method @handles       behaviour.py       what starts something: motor.py, piezo/, ...
         -> a Panel                 rack.py            bays, digital inputs and outputs
         -> a method of its own                        updates, keep-alive, muting, HW_GET_INFO (identity.py)
     -> Controller.send                              then and there, or later from a timer of the behaviour
     -> Outlet.send                 outlet.py        withheld, muted, or made odd (quirks.py)
     -> AptInstrument.on_send                        bytes to the host

A unit is put together in instrument.py; which behaviour its channels have stands in behaviours.py.
"""
