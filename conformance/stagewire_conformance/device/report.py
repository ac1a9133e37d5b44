"""What a run found, as data; how it is printed is decided elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property
from typing import TYPE_CHECKING

from stagewire_conformance.device.check import Check, Kind
from stagewire_conformance.device.results import Result

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.permissions import Permissions

__all__ = ["Entry", "Finding", "Outcome", "Report"]


@dataclass(frozen=True)
class Finding:
    """One thing that a check found.

    :param text: a sentence: what came, and what should have come.
    :param wanted: the bytes that should have come, if that is known.
    :param came: the bytes that it is about, if there are any.
    """

    result: Result
    text: str
    wanted: bytes | None = None
    came: bytes | None = None


@dataclass(frozen=True)
class Entry:
    """Something that passed on the line.

    :param time: in seconds since the line was opened.
    :param sent: whether the suite sent it.
    :param raw: its bytes.
    :param keep_alive: whether it was sent by itself, to keep the controller talking.
    :param tell: says what it is, when somebody wants to know: most entries nobody reads.
    """

    time: float
    sent: bool
    raw: bytes
    keep_alive: bool = False
    tell: Callable[[], str] = field(default=str, repr=False, compare=False)

    @cached_property
    def text(self) -> str:
        """What it says, in one line."""
        return self.tell()


@dataclass(frozen=True)
class Outcome:
    """What came out of one check.

    :param findings: none where everything held.
    :param entries: what passed on the line meanwhile.
    :param figures: what was measured, by name, with the unit at the end of it (``p99_ms``).
    :param seconds: how long it took.
    :param restored: what was put back afterwards.
    """

    check: Check
    kind: Kind
    result: Result
    findings: tuple[Finding, ...]
    entries: tuple[Entry, ...]
    figures: Mapping[str, float]
    seconds: float
    restored: tuple[str, ...]


@dataclass(frozen=True)
class Report:
    """What came out of a run.

    :param url: of the line.
    :param seed: with it the same run can be had again.
    :param outcomes: of the checks that ran, and of those that the PICS skips, in order.
    :param not_run: the others, and why.
    :param unfinished: why the run did not come to its end; empty: it did.
    :param jitter: how late the computer itself is when it waits, in seconds.
    :param started: in UTC.
    :param digests: SHA-256 of ``suite``, ``registry`` and ``pics``.
    :param identification: what the controller said that it is, field by field; empty: it did not say.
    :param stops: what was sent to stop what might be in motion, when the run was cut short.
    :param defect: the error in the suite that ended the run, if it was one.
    """

    declared: Declared
    url: str
    seed: int
    allowed: Permissions
    outcomes: tuple[Outcome, ...]
    not_run: tuple[tuple[Check, str], ...]
    unfinished: str
    jitter: float
    started: datetime
    digests: Mapping[str, str]
    identification: Mapping[str, int | str]
    stops: tuple[str, ...] = ()
    defect: BaseException | None = field(default=None, compare=False, repr=False)
