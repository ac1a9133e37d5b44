"""The base of generated device classes: open a controller, call it in its units, wait for its motion.

A generated package describes its units with data (:mod:`~stagewire._devices.unit`) and its calls with tables
(:mod:`~stagewire._devices.tables`). The code here interprets them and is independent of any protocol.

A call runs in these steps. Its keywords become fields (:mod:`~stagewire._devices.arguments`), using the
scales of the stage and the settings of the channel (:mod:`~stagewire._devices.scales`). Motions are compared
with the travel (:mod:`~stagewire._devices.limits`). The session sends the message, and the reply becomes
values (:mod:`~stagewire._devices.values`).

Calls, motions and the base classes of devices are in ``asynchronous``; ``synchronous`` is generated from it.
"""
