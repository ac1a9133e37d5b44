"""Report formats of ``stagewire check``, each a function that returns text.

========  =================================================================================================
text      for people: a line and a hint for each diagnostic, or a summary of the checked spec
json      for programs: one JSON object, described by ``spec/schema/diagnostics.schema.json``
github    for GitHub Actions: a workflow command for each diagnostic, which annotates its line
junit     for the test viewers of CI servers: a suite for each protocol, with a case for each file
========  =================================================================================================
"""

from __future__ import annotations

import dataclasses
import enum
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from stagewire_cli.generator import relative_path
from stagewire_cli.output import printable

if TYPE_CHECKING:
    from junitparser import TestCase

    from stagewire_generator.diagnostics import Diagnostic
    from stagewire_generator.pipeline import Counts
    from stagewire_generator.reader import SpecFolder


@dataclass(frozen=True, slots=True)
class Report:
    """The result of checking one spec.

    :param spec: the folder, as the user named it, and its files.
    :param diagnostics: the errors, with file paths from the current folder.
    :param counts: the numbers of checked things by protocol; empty if the spec has errors.
    :param against: the other side of a comparison, as the user named it; empty without one.
    :param changes: class -> number of changes, the most serious first; empty without a comparison.
    """

    spec: SpecFolder
    diagnostics: Sequence[Diagnostic] = ()
    counts: Mapping[str, Counts] = field(default_factory=dict)
    against: str = ""
    changes: Mapping[str, int] = field(default_factory=dict)


def as_text(report: Report) -> str:
    """Return the diagnostics, or the summary if there are none."""
    if report.diagnostics:
        return "".join(f"{diagnostic}\n" for diagnostic in report.diagnostics)
    return summary(report)


def summary(report: Report) -> str:
    """Return the number of errors, or else the contents of the spec and its changes."""
    number = len(report.diagnostics)
    if number:
        return f"{printable(str(report.spec.path))}: {number} error{'s' * (number != 1)}\n"
    lines = [
        f"{name}: ok; {seen.messages} messages, {seen.layouts} layouts, {seen.fields} fields, "
        f"{seen.errata} errata{_not_compared(seen)}, {seen.places} witness places, "
        f"{seen.examples} examples\n"
        for name, seen in report.counts.items()
    ]
    if report.against:
        total = sum(report.changes.values())
        listed = ", ".join(f"{count} {level}" for level, count in report.changes.items())
        lines.append(
            f"against {printable(report.against)}: ok; {total} change{'s' * (total != 1)}: {listed}\n"
        )
    return "".join(lines)


def _not_compared(seen: Counts) -> str:
    return f" ({seen.not_compared} not compared)" if seen.not_compared else ""


SCHEMA_VERSION = 1


def as_json(report: Report) -> str:
    """Return the report in ASCII, so that it does not depend on terminals and encodings."""
    from stagewire_generator.codes import CODES
    from stagewire_generator.codes_page import anchor

    data = {
        "schema_version": SCHEMA_VERSION,
        "spec": report.spec.path.as_posix(),
        "ok": not report.diagnostics,
        "protocols": {name: dataclasses.asdict(seen) for name, seen in report.counts.items()},
        "against": report.against or None,
        "changes": dict(report.changes) or None,
        "diagnostics": [
            {
                "file": diagnostic.place.file,
                "line": diagnostic.place.line,
                "column": diagnostic.place.column,
                "code": diagnostic.code,
                "title": CODES[diagnostic.code].title,
                "message": diagnostic.message,
                "hint": diagnostic.cure,
                "docs": anchor(diagnostic.code),
            }
            for diagnostic in report.diagnostics
        ],
    }
    return json.dumps(data, indent=2) + "\n"


_IN_A_MESSAGE = {"%": "%25", "\r": "%0D", "\n": "%0A"}
_IN_A_PROPERTY = {**_IN_A_MESSAGE, ":": "%3A", ",": "%2C"}


def as_github(report: Report) -> str:
    """Return one line for each diagnostic."""
    from stagewire_generator.codes import CODES

    lines = []
    for diagnostic in report.diagnostics:
        place = diagnostic.place
        properties = {
            "file": _from_the_top(Path(os.path.abspath(place.file))),
            "line": str(place.line),
            "col": str(place.column),
            "title": f"{diagnostic.code}: {CODES[diagnostic.code].title}",
        }
        listed = ",".join(
            f"{name}={_escaped(printable(value), _IN_A_PROPERTY)}"
            for name, value in properties.items()
        )
        said = f"{printable(diagnostic.message)}\nhint: {printable(diagnostic.cure)}"
        lines.append(f"::error {listed}::{_escaped(said, _IN_A_MESSAGE)}\n")
    return "".join(lines)


def _from_the_top(path: Path) -> str:
    """Return a path relative to its git repository, as annotations require; without one, unchanged."""
    top = next((folder for folder in path.parents if (folder / ".git").exists()), None)
    return (path.relative_to(top) if top else path).as_posix()


def _escaped(text: str, table: dict[str, str]) -> str:
    return "".join(table.get(c, c) for c in text)


def as_junit(report: Report) -> str:
    """Return XML in ASCII; characters that XML does not allow, such as control characters, are escaped."""
    from junitparser import JUnitXml, TestSuite

    found: dict[str, list[Diagnostic]] = {}
    for diagnostic in report.diagnostics:
        found.setdefault(diagnostic.place.file, []).append(diagnostic)
    xml = JUnitXml("stagewire check")
    for protocol in report.spec.protocols:
        suite = TestSuite(printable(protocol.path.name))
        for path in protocol.paths:
            name = relative_path(path)
            suite.add_testcase(_case(protocol.path.name, name, found.pop(name, [])))
        xml.add_testsuite(suite)
    if found:  # diagnostics about missing files
        suite = TestSuite(printable(report.spec.path.as_posix()))
        for name, diagnostics in found.items():
            suite.add_testcase(_case("spec", name, diagnostics))
        xml.add_testsuite(suite)
    xml.update_statistics()  # type: ignore[no-untyped-call]
    text: bytes = xml.tostring()  # type: ignore[no-untyped-call]
    ascii = text.decode("utf-8").encode("ascii", "xmlcharrefreplace").decode("ascii")
    return f'<?xml version="1.0" encoding="US-ASCII"?>\n{ascii}\n'


def _case(protocol: str, name: str, diagnostics: Sequence[Diagnostic]) -> TestCase:
    """Return a case; viewers show only one failure, so it contains all diagnostics."""
    from junitparser import Failure, TestCase

    case = TestCase(printable(name), f"stagewire.{printable(protocol)}")
    if diagnostics:
        first = diagnostics[0]
        more = f" (and {len(diagnostics) - 1} more)" if len(diagnostics) > 1 else ""
        failure = Failure(f"{first.code} {printable(first.message)}{more}", first.code)
        failure.text = "\n".join(map(str, diagnostics))
        case.result = [failure]
    return case


class ReportFormat(enum.StrEnum):
    """Values of ``--format``."""

    TEXT = "text"
    JSON = "json"
    GITHUB = "github"
    JUNIT = "junit"


_WRITERS: dict[ReportFormat, Callable[[Report], str]] = {
    ReportFormat.TEXT: as_text,
    ReportFormat.JSON: as_json,
    ReportFormat.GITHUB: as_github,
    ReportFormat.JUNIT: as_junit,
}


def written(report: Report, format: ReportFormat) -> str:
    """Return a report in a format, as whole lines."""
    return _WRITERS[format](report)
