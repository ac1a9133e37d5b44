"""Errors of virtual controllers; every class derives from ``StagewireError``."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from stagewire.errors import StagewireError

__all__ = [
    "BadOptionError",
    "BenchError",
    "FaultError",
    "ReplayError",
    "ServingError",
    "UnknownPartError",
    "UnknownUnitError",
    "UnpluggedError",
    "VirtualError",
]


class VirtualError(StagewireError):
    """Base class of the errors of this package."""


class UnknownUnitError(VirtualError):
    """No installed protocol has a unit with this name.

    :param name: the unknown name.
    :param known: the names of all units.
    """

    def __init__(self, name: str, known: Sequence[str]) -> None:
        self.name = name
        self.known = tuple(known)
        close = difflib.get_close_matches(name.upper()[:40], known, n=3)
        hint = f"; did you mean {' or '.join(close)}?" if close else ""
        super().__init__(f"unknown unit {name}{hint} (known units: {', '.join(known)})")


class ServingError(VirtualError):
    """A virtual controller cannot be served at the requested address, for example because a port is taken."""


class UnpluggedError(VirtualError):
    """The line to a virtual controller was unplugged, by a fault or by ``unplug()``."""


class BenchError(VirtualError):
    """All problems in the description of a bench.

    :param problems: one line per problem: the file, the key, what is wrong and what was expected.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = tuple(problems)


class UnknownPartError(VirtualError):
    """A controller has no part with this name; its rows name its parts."""

    def __init__(self, part: str, known: Sequence[str]) -> None:
        choices = f"available: {', '.join(known)}" if known else "none available"
        super().__init__(f"no {part} ({choices})")


class BadOptionError(VirtualError):
    """An option that the unit does not support, or an invalid value; the message lists the valid ones."""


class FaultError(VirtualError):
    """An invalid fault, or one that the controller cannot have."""


class ReplayError(VirtualError):
    """A session differed from its recording."""
