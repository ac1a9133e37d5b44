"""For the test viewers of CI servers: a suite for each protocol, a case for each file that was read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from stagewire_cli.located import from_here
from stagewire_cli.reports.report import Report
from stagewire_cli.terminal import printable

if TYPE_CHECKING:
    from junitparser import TestCase

    from stagewire_generator.diagnostics import Diagnostic

__all__ = ["as_junit"]


def as_junit(report: Report) -> str:
    """Return XML in ASCII; what XML cannot hold, such as control characters, is written as an escape."""
    from junitparser import JUnitXml, TestSuite

    found: dict[str, list[Diagnostic]] = {}
    for diagnostic in report.diagnostics:
        found.setdefault(diagnostic.place.file, []).append(diagnostic)
    xml = JUnitXml("stagewire check")
    for protocol, files in report.files().items():
        suite = TestSuite(printable(protocol))
        for path in files:
            name = from_here(path)
            suite.add_testcase(_case(protocol, name, found.pop(name, [])))
        xml.add_testsuite(suite)
    if found:  # what is missing was not read
        suite = TestSuite(printable(report.spec.as_posix()))
        for name, diagnostics in found.items():
            suite.add_testcase(_case("spec", name, diagnostics))
        xml.add_testsuite(suite)
    xml.update_statistics()  # type: ignore[no-untyped-call]
    text: bytes = xml.tostring()  # type: ignore[no-untyped-call]
    ascii = text.decode("utf-8").encode("ascii", "xmlcharrefreplace").decode("ascii")
    return f'<?xml version="1.0" encoding="US-ASCII"?>\n{ascii}\n'


def _case(protocol: str, name: str, diagnostics: Sequence[Diagnostic]) -> TestCase:
    """Return a case; viewers show one failure of it, so that all diagnostics stand in one."""
    from junitparser import Failure, TestCase

    case = TestCase(printable(name), f"stagewire.{printable(protocol)}")
    if diagnostics:
        first = diagnostics[0]
        more = f" (and {len(diagnostics) - 1} more)" if len(diagnostics) > 1 else ""
        failure = Failure(f"{first.code} {printable(first.message)}{more}", first.code)
        failure.text = "\n".join(map(str, diagnostics))
        case.result = [failure]
    return case
