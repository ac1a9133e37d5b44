"""Faults on the line between a host and a virtual controller.

:func:`~stagewire_virtual.faults.fault.parse_fault` reads a fault such as ``to_host drop frame every=10``. A
:class:`~stagewire_virtual.faults.link.FaultyLink` between a link and a controller applies it. The same seed,
bytes and clock produce the same faults. :mod:`stagewire_virtual.faults.fault` defines the faults,
:mod:`stagewire_virtual.faults.chain` applies them to bytes.
"""
