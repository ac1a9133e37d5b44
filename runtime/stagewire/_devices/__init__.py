"""The base of generated device classes: open a controller, call it in its units, wait for its motion.

A generated package describes its units by data (:mod:`~stagewire._devices.unit`) and its calls by tables
(:mod:`~stagewire._devices.tables`). The code here works on them and knows no message.

From a call to the wire, in order: the keywords of a user become fields
(:mod:`~stagewire._devices.arguments`), by scales that belong to the stage and the settings of one channel
(:mod:`~stagewire._devices.scales`); a motion is compared with the travel
(:mod:`~stagewire._devices.limits`); the message goes to the session, and the reply becomes values
(:mod:`~stagewire._devices.values`).

Calls, motions and the classes for users are in ``asynchronous``; ``synchronous`` is generated from it.
"""
