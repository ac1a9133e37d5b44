"""What generated device classes stand on: open a controller, call it in its units, wait for its motion.

A generated package describes its units by data (:mod:`~stagewire._devices.unit`) and its calls by tables
(:mod:`~stagewire._devices.tables`); here is what works on them, and it knows no message.

From a call to the wire, in order: the keywords that a user gave become fields
(:mod:`~stagewire._devices.giving`), by scales that belong to the stage and the settings of one channel
(:mod:`~stagewire._devices.scales`); what moves is held against the travel
(:mod:`~stagewire._devices.limits`); the message goes to the session, and what comes back becomes values
(:mod:`~stagewire._devices.values`).

All of this is written once (:mod:`~stagewire._devices.calls`, :mod:`~stagewire._devices.moving`), as
coroutines that wait for nothing but a *line* (:mod:`~stagewire._devices.line`): a session for asyncio
(:mod:`~stagewire._devices.awaited`), or one for threads, whose calls return when they are done, so that the
coroutine never waits and runs as a plain call (:mod:`~stagewire._devices.immediate`). The classes for users,
:mod:`~stagewire._devices.synchronous` and :mod:`~stagewire._devices.asynchronous`, hold nothing else.
"""
