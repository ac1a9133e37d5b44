"""The report of a run as data, with digests of the suite, the registry and the PICS."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from typing import TYPE_CHECKING

from stagewire_conformance.device.check import Check, Kind
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.results import Entry, Finding, Result

if TYPE_CHECKING:
    from stagewire_conformance.device.permissions import Permissions


def digests_of(declared: Declaration) -> dict[str, str]:
    """Return SHA-256 digests in hex: ``suite``, ``registry`` and ``pics`` (empty without a PICS)."""
    registry = resources.files(declared.protocol.package) / "registry.json"
    return {
        "suite": _of_suite(),
        "registry": hashlib.sha256(registry.read_bytes()).hexdigest(),
        "pics": declared.pics.digest,
    }


@cache
def _of_suite() -> str:
    """Return the digest of the source of the suite: paths and contents of its files."""
    digest = hashlib.sha256()
    for path, file in sorted(_files(resources.files(__package__), "")):
        digest.update(f"{path}\0".encode())
        digest.update(file.read_bytes().replace(b"\r\n", b"\n") + b"\0")
    return digest.hexdigest()


def _files(folder: Traversable, path: str) -> Iterator[tuple[str, Traversable]]:
    for entry in folder.iterdir():
        if entry.is_dir():
            yield from _files(entry, f"{path}{entry.name}/")
        elif entry.name.endswith(".py"):
            yield f"{path}{entry.name}", entry


@dataclass(frozen=True)
class Outcome:
    """The outcome of one check.

    :param findings: empty if the controller passed.
    :param entries: the traffic on the line during the check.
    :param figures: measured values by name. A name ends with the unit (``p99_ms``).
    :param seconds: the duration.
    :param restored: the changes that were undone afterwards.
    :param met: the checks that have reported a defect that this check also met, each with the defect.
    """

    check: Check
    kind: Kind
    result: Result
    findings: tuple[Finding, ...]
    entries: tuple[Entry, ...]
    figures: Mapping[str, float]
    seconds: float
    restored: tuple[str, ...]
    met: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Report:
    """The outcome of a run.

    :param url: of the line.
    :param seed: repeats the run with the same random choices.
    :param outcomes: of the checks that ran and of those that the PICS skips, in order.
    :param not_run: the other checks, each with the reason.
    :param unfinished: why the run did not finish; empty if it did.
    :param jitter: how late this computer wakes when it waits, in seconds.
    :param started: in UTC.
    :param digests: SHA-256 of ``suite``, ``registry`` and ``pics``.
    :param identification: what the controller reported about itself, field by field; empty if it did not.
    :param stops: the stops that were sent when the run was cut short.
    :param adrift: sentences about the parts that may still be moving, shining or heating after the run.
    :param defect: the error in the suite that ended the run, if any.
    """

    declared: Declaration
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
    adrift: tuple[str, ...] = ()
    defect: BaseException | None = field(default=None, compare=False, repr=False)
