"""What a run found, as data; how it is printed is decided elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING

from stagewire_conformance.device.check import Check, Kind
from stagewire_conformance.device.results import Entry, Finding, Result

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.permissions import Permissions


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
