"""The file of expected failures: the cases that a testee is known to fail, with the reasons.

```toml
schema_version = 1

[[expected]]
id = "thorlabs_apt/HW_RICHRESPONSE/*"
reason = "our firmware never sends it"
```

``id`` is the id of a case, or a pattern with ``*``, ``?`` and ``[…]``. A listed case that passes is a
failure, and so is an entry that matches no case.
"""

from __future__ import annotations

import fnmatch
import tomllib
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stagewire.protocols import Protocol, available_protocols
from stagewire_conformance.testees.case import Case, ExpectedFileError

SCHEMA_VERSION = 1
_KEYS = {"schema_version", "expected"}
_OF_A_FAILURE = {"id", "reason"}


@dataclass(frozen=True, slots=True)
class Failure:
    """An entry of the file.

    :param id: of a case, or a pattern of ids.
    :param reason: why it fails.
    """

    id: str
    reason: str


@dataclass(frozen=True, slots=True)
class Expected:
    """The expected failures.

    :param path: the file.
    """

    path: Path
    failures: tuple[Failure, ...]

    def reasons(self, cases: Iterable[Case], elsewhere: Collection[str] = ()) -> dict[str, str]:
        """Return the reasons of expected failures by case id. The first matching entry applies.

        :param elsewhere: other protocols. Entries for their cases are allowed.

        Raises :class:`ExpectedFileError` for an entry that matches no case.
        """
        found: dict[str, str] = {}
        ids = [case.id for case in cases]
        idle = []
        for failure in self.failures:
            matching = fnmatch.filter(ids, failure.id)
            for id in matching:
                found.setdefault(id, failure.reason)
            if not matching and failure.id.partition("/")[0] not in elsewhere:
                idle.append(
                    f"no case matches {failure.id!r}; stagewire conformance codec --list shows all cases"
                )
        _raise_for(self.path, idle)
        return found


def other_protocols(protocols: Iterable[Protocol]) -> set[str]:
    """Return the names of the other installed protocols."""
    return {*available_protocols()} - {protocol.name for protocol in protocols}


def read_expected(path: Path) -> Expected:
    """Read a file of expected failures.

    Raises :class:`ExpectedFileError` with all problems.
    """
    try:
        data = tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ExpectedFileError(f"{path}: not a TOML file: {error}") from None
    problems = [
        f"unknown key {key!r} (choose from {', '.join(sorted(_KEYS))})"
        for key in data.keys() - _KEYS
    ]
    version = data.get("schema_version")
    if version != SCHEMA_VERSION or isinstance(version, bool):
        problems.append(
            f"missing schema_version; write schema_version = {SCHEMA_VERSION}"
            if version is None
            else f"schema_version must be {SCHEMA_VERSION}, not {version!r}"
        )
    entries = data.get("expected", [])
    if not isinstance(entries, list):
        entries = []
        problems.append("expected must be a list of tables: write [[expected]]")
    failures = [_failure(f"expected {n}", entry, problems) for n, entry in enumerate(entries, 1)]
    ids = Counter(
        entry["id"]
        for entry in entries
        if isinstance(entry, dict) and isinstance(entry.get("id"), str)
    )
    problems += [f"{id!r} is listed {n} times" for id, n in ids.items() if n > 1]
    _raise_for(path, problems)
    return Expected(path, tuple(failures))


def _failure(place: str, entry: Any, problems: list[str]) -> Failure:
    if not isinstance(entry, dict):
        problems.append(f"{place} is not a table")
        return Failure("", "")
    problems += [
        f"{place}: unknown key {key!r} (choose from {', '.join(sorted(_OF_A_FAILURE))})"
        for key in sorted(entry.keys() - _OF_A_FAILURE)
    ]
    for key in sorted(_OF_A_FAILURE):
        if not isinstance(entry.get(key), str) or not entry[key].strip():
            problems.append(f"{place}: {key} must be a non-empty string")
    return Failure(str(entry.get("id")), str(entry.get("reason")))


def _raise_for(path: Path, problems: list[str]) -> None:
    """Raise :class:`ExpectedFileError` if there are problems."""
    if problems:
        raise ExpectedFileError("\n".join(f"{path}: {problem}" for problem in problems))
