"""Faults on demand: what goes wrong on the line between a host and a virtual controller.

:func:`parse_fault` reads ``to_host drop frame every=10``; a :class:`FaultyLine` stands between a link and a
controller and does it. The same seed, the same bytes and the same clock give the same faults. What each
can have is in :mod:`stagewire_virtual.faults.keys`, what it does in
:mod:`stagewire_virtual.faults.effect`.
"""

from __future__ import annotations

from stagewire_virtual.errors import FaultError
from stagewire_virtual.faults.fault import Fault
from stagewire_virtual.faults.keys import Action, Piece
from stagewire_virtual.faults.line import FaultyLine, Happened
from stagewire_virtual.faults.text import parse_fault

__all__ = ["Action", "Fault", "FaultError", "FaultyLine", "Happened", "Piece", "parse_fault"]
