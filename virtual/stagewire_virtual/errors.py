"""What can be wrong with what is asked of virtual controllers; all are a ``StagewireError``."""

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
    """The base of the errors of this package."""


class UnknownUnitError(VirtualError):
    """There is no unit of that name in any installed protocol.

    :param name: what was asked for.
    :param known: what there is.
    """

    def __init__(self, name: str, known: Sequence[str]) -> None:
        self.name = name
        self.known = tuple(known)
        close = difflib.get_close_matches(name.upper()[:40], known, n=3)
        hint = f"; did you mean {' or '.join(close)}?" if close else ""
        super().__init__(f"unknown unit {name}{hint} (known units: {', '.join(known)})")


class ServingError(VirtualError):
    """A virtual controller cannot be reached where it was asked for, such as on a port that is taken."""


class UnpluggedError(VirtualError):
    """The line to a virtual controller is unplugged, by a fault or by ``unplug()``."""


class BenchError(VirtualError):
    """What is wrong with the description of a bench, all of it.

    :param problems: one line each: the file, the key, what was wrong and what was expected.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = tuple(problems)


class UnknownPartError(VirtualError):
    """A controller has no part of that name; its parts are those of its rows."""

    def __init__(self, part: str, known: Sequence[str]) -> None:
        there = f"there are: {', '.join(known)}" if known else "there is nothing of that kind"
        super().__init__(f"there is no {part} ({there})")


class BadOptionError(VirtualError):
    """A unit was asked for with an option that it cannot have; the message lists what there is."""


class FaultError(VirtualError):
    """A fault that makes no sense, or that a controller cannot have."""


class ReplayError(VirtualError):
    """A session did not go as it was recorded."""
