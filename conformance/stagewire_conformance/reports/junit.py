"""The JUnit report for CI servers: a suite for each group, and a test case for each case.

It satisfies strict parsers: it has the attributes of Ant's reports, and one result per case. A departure from
a recommendation is a failure of the type ``NON-STRICT``, because the exit status of the run is not 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stagewire_conformance.reports.model import Case, Grade, Sheet
from stagewire_conformance.reports.text import case_text, gaps, not_at_rest, safe, sentence

if TYPE_CHECKING:
    from junitparser import TestCase, TestSuite


def as_junit(sheet: Sheet) -> str:
    """Return XML in ASCII. Characters that XML does not allow, such as control characters, are escaped.

    Raises :class:`ModuleNotFoundError` without the extra ``conformance``.
    """
    from junitparser import JUnitXml

    xml = JUnitXml()
    suites = {
        group.name: [_case(sheet, case, _package(sheet, group.name)) for case in group.cases]
        for group in sheet.groups
    }
    suites["run"] = [_end(sheet, _package(sheet, "run"))]
    for number, (name, cases) in enumerate(suites.items()):
        xml.add_testsuite(_suite(sheet, number, name, cases))
    text: bytes = xml.tostring()  # type: ignore[no-untyped-call]
    ascii = text.decode("utf-8").encode("ascii", "xmlcharrefreplace").decode("ascii")
    return f'<?xml version="1.0" encoding="US-ASCII"?>\n{ascii}\n'


def _package(sheet: Sheet, *names: str) -> str:
    return ".".join(["stagewire", sheet.kind, *map(safe, names)])


def _case(sheet: Sheet, case: Case, name: str) -> TestCase:
    from junitparser import Failure, Skipped, TestCase

    made = TestCase(safe(case.id), name, round(case.seconds, 3))
    if case.grade in (Grade.FAILED, Grade.DEVIATES):
        failure = Failure(safe(_first(case)), safe(case.word))
        failure.text = "\n".join([safe(case.title), *case_text(sheet, case)])
        made.result = [failure]
    elif not case.ran:
        made.result = [Skipped(safe(f"{case.word}: {case.why}"), safe(case.word))]
    return made


def _first(case: Case) -> str:
    """Return the worst finding, and the number of further ones."""
    grave = [finding for finding in case.findings if finding.grade is case.grade]
    if not grave:
        return case.title
    more = f" (and {len(grave) - 1} more)" if len(grave) > 1 else ""
    return f"{grave[0].text}{more}"


def _end(sheet: Sheet, name: str) -> TestCase:
    """Return a case that fails if the run did not finish, or left something that may move, shine or heat."""
    from junitparser import Error, TestCase

    made = TestCase("run finished", name, round(sheet.seconds, 3))
    if sheet.unfinished or sheet.adrift:
        ended = [] if sheet.unfinished == "; ".join(sheet.adrift) else [sheet.unfinished]
        texts = filter(None, [*not_at_rest(sheet), *ended])
        made.result = [Error(safe("; ".join(texts)), str(sheet.verdict))]
    return made


def _suite(sheet: Sheet, number: int, name: str, cases: list[TestCase]) -> TestSuite:
    """Return a suite with the required elements, in the order of the format."""
    from junitparser import SystemErr, SystemOut, TestSuite

    suite = TestSuite(safe(name))
    for key, value in _properties(sheet).items():
        suite.add_property(safe(key), safe(value))
    suite.add_testcases(cases)
    warnings = "\n".join(map(safe, not_at_rest(sheet) if name == "run" else ()))
    suite.append(SystemOut(warnings))  # type: ignore[no-untyped-call]
    suite.append(SystemErr(""))  # type: ignore[no-untyped-call]
    suite.timestamp = sheet.started.strftime("%Y-%m-%dT%H:%M:%S")
    suite.hostname = "localhost"  # the name of the machine is private
    suite._elem.set("id", str(number))
    suite._elem.set("package", _package(sheet))
    return suite


def _properties(sheet: Sheet) -> dict[str, str]:
    facts = {fact.key: fact.value for fact in sheet.facts}
    facts |= {"verdict": str(sheet.verdict), "headline": sheet.headline}
    facts |= {"complete": sheet.complete, "partial_because": "; ".join(gaps(sheet))}
    facts |= {"summary": sentence(sheet), "seed": sheet.seed}
    facts |= {f"sha256_{name}": digest for name, digest in sheet.digests.items()}
    return {key: _property(value) for key, value in facts.items()}


def _property(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)
