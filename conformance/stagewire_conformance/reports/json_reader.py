"""Read the parts of a JSON report that are compared with another report."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

from stagewire.errors import StagewireError
from stagewire_conformance.reports.json_report import SCHEMA_VERSION
from stagewire_conformance.reports.model import Grade

GRAVE: Final = (Grade.FAILED, Grade.DEVIATES, Grade.FRAGILE)
"""The grades of findings that are read."""

_T = TypeVar("_T")
_NUMBERS: Final = re.compile(r"0x[0-9a-fA-F]+|\d+(?:[.,]\d+)*")


class ReportFileError(StagewireError):
    """A file is not a JSON report, or two reports cannot be compared."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A failure, a departure, or a lack of robustness.

    :param rule: the rule that it breaks; empty if the report names none.
    """

    grade: Grade
    text: str
    rule: str = ""

    @property
    def kind(self) -> tuple[Grade, str, str]:
        """A key that is equal for findings that differ only in numbers."""
        return self.grade, _NUMBERS.sub("#", self.text), self.rule


@dataclass(frozen=True, kw_only=True)
class Result:
    """The result of a case.

    :param word: as in the report, such as ``NON-STRICT``.
    :param rules: that it checks.
    """

    grade: Grade
    word: str
    rules: tuple[str, ...]
    findings: tuple[Finding, ...]

    @property
    def broken(self) -> frozenset[str]:
        """The rules that its findings name; those of the case if they name none."""
        named = frozenset(finding.rule for finding in self.findings if finding.rule)
        breaks = self.grade in (Grade.FAILED, Grade.DEVIATES)
        return named or frozenset(self.rules if breaks else ())


@dataclass(frozen=True, kw_only=True)
class Run:
    """The compared parts of one report.

    :param gaps: the reasons why it is partial.
    """

    kind: str
    title: str
    verdict: str
    headline: str
    complete: bool
    started: str
    facts: Mapping[str, Any]
    digests: Mapping[str, str]
    gaps: tuple[str, ...]
    results: Mapping[str, Result]

    @property
    def broken(self) -> frozenset[str]:
        """The rules that the implementation breaks."""
        return frozenset[str]().union(*(result.broken for result in self.results.values()))


def read_run(path: Path) -> Run:
    """Read a JSON report. Raises :class:`ReportFileError`."""
    try:
        data = json.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        raise ReportFileError(f"{path}: cannot read the file: {error.strerror or error}") from None
    except RecursionError:
        raise ReportFileError(f"{path}: nested too deeply") from None
    except ValueError as error:  # of JSON or of UTF-8
        raise ReportFileError(f"{path}: not a JSON file: {error}") from None
    return _Reader(path).run(data)


class _Reader:
    """Reads the keys of a report that are compared, and checks their types."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def run(self, data: Any) -> Run:
        if not isinstance(data, dict) or "groups" not in data:
            raise ReportFileError(
                f"{self._path}: not a conformance report; write one with --json FILE of "
                "stagewire conformance device or codec"
            )
        version = data.get("schema_version")
        if version != SCHEMA_VERSION or isinstance(version, bool):
            raise ReportFileError(
                f"{self._path}: the report has the format {version!r}; expected {SCHEMA_VERSION}"
            )
        complete = self._take(data, "complete", bool)
        words = {key: self._take(data, key, str) for key in _WORDS}
        return Run(
            **words,
            complete=complete,
            facts=self._take(data, "facts", dict),
            digests=self._take(data, "digests", dict),
            gaps=tuple(self._take(gap, "why", str) for gap in self._each(data, "gaps")),
            results=dict(self._results(data)),
        )

    def _results(self, data: Mapping[str, Any]) -> Iterator[tuple[str, Result]]:
        for group in self._each(data, "groups"):
            for case in self._each(group, "cases"):
                yield (
                    self._take(case, "id", str),
                    Result(
                        grade=self._grade(case),
                        word=self._take(case, "result", str),
                        rules=tuple(map(str, self._take(case, "rules", list))),
                        findings=tuple(self._findings(case)),
                    ),
                )

    def _findings(self, case: Mapping[str, Any]) -> Iterator[Finding]:
        for finding in self._each(case, "findings"):
            grade = self._grade(finding)
            if grade in GRAVE:
                text = self._take(finding, "text", str)
                yield Finding(grade=grade, text=text, rule=str(finding.get("rule") or ""))

    def _grade(self, holder: Mapping[str, Any]) -> Grade:
        word = self._take(holder, "grade", str)
        if word not in list(Grade):
            raise ReportFileError(f"{self._path}: unknown grade {word!r}")
        return Grade(word)

    def _each(self, holder: Mapping[str, Any], key: str) -> Iterator[Mapping[str, Any]]:
        for entry in self._take(holder, key, list):
            if not isinstance(entry, dict):
                raise ReportFileError(f"{self._path}: an entry of {key!r} is not an object")
            yield entry

    def _take(self, holder: Mapping[str, Any], key: str, kind: type[_T]) -> _T:
        value = holder.get(key)
        if not isinstance(value, kind):
            names = {str: "a string", list: "a list", dict: "an object", bool: "true or false"}
            problem = f"is not {names[kind]}" if key in holder else "is missing"
            raise ReportFileError(f"{self._path}: not a conformance report: {key!r} {problem}")
        return value


_WORDS: Final = ("kind", "title", "verdict", "headline", "started")
