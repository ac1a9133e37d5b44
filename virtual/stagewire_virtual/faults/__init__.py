"""Faults on demand: what goes wrong on the line between a host and a virtual controller.

:func:`parse_fault` reads ``to_host drop frame every=10``; a :class:`FaultyLink` stands between a link and a
controller and does it. The same seed, the same bytes and the same clock give the same faults. What each
can have is in :mod:`stagewire_virtual.faults.fault`, what it does in
:mod:`stagewire_virtual.faults.chain`.
"""
