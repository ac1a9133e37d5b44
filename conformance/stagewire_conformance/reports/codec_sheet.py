"""The sheet of a run of cases against a testee."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from importlib import resources

from stagewire.protocols import Protocol
from stagewire_conformance.comparison import Outcome
from stagewire_conformance.registry import registry_of
from stagewire_conformance.reports.model import (
    Case,
    Fact,
    Finding,
    Grade,
    Group,
    Message,
    Omission,
    PageReference,
    Sheet,
)
from stagewire_conformance.reports.text import counted
from stagewire_conformance.testees import Case as Asked
from stagewire_conformance.testees import Report, Result
from stagewire_conformance.testees.result import Hello
from stagewire_conformance.testees.runner import GROUPS

_NOT_RUN = "not run"
_LONGEST = 4_000
"""The maximum number of characters shown of a line. Only large and hostile lines are longer."""


def sheet_of(
    report: Report,
    protocols: Sequence[Protocol],
    again: Callable[[str], str],
) -> Sheet:
    """Return the sheet of a run.

    :param protocols: the requested protocols.
    :param again: returns the command that repeats a case by its id, or the whole run for an empty id.
    """
    hello = report.hello
    abilities = tuple(_abilities(hello, protocols))
    return Sheet(
        kind="codec",
        title=f"Conformance of {hello.implementation} {hello.version}".rstrip(),
        protocols={one.name: _document(one) for one in protocols},
        started=report.started,
        seconds=report.seconds,
        seed=report.seed,
        facts=(
            Fact(key="testee", label="Testee", value=hello.implementation),
            Fact(key="testee_version", label="Version", value=hello.version),
            Fact(key="testee_command", label="Command", value=" ".join(report.command)),
            *abilities,
            Fact(key="timeout_s", label="Timeout of an answer, s", value=report.timeout),
            Fact(key="starts", label="Starts", value=report.starts),
        ),
        declaration=abilities,
        digests={f"vectors_{one.name}": _digest(one) for one in protocols},
        command=again(""),
        groups=tuple(_groups(report, again)),
        unfinished=report.unfinished,
        messages=tuple(_messages(protocols)),
        unselected=report.unselected,
        interrupted=report.interrupted,
    )


def testee_line(report: Report) -> str:
    """Return one line about the testee of a run: its name and abilities, and figures of the run."""
    hello = report.hello
    return (
        f"{hello.implementation} {hello.version} supports {', '.join(hello.protocols)} with "
        f"{', '.join(hello.operations)}; {counted(len(report.results), 'case')}, seed {report.seed}, "
        f"started {counted(report.starts, 'time')}, {report.seconds:.1f} s"
    )


def _abilities(hello: Hello, protocols: Sequence[Protocol]) -> Iterator[Fact]:
    """Yield the abilities that the testee declares in its answer to ``hello``."""
    yield Fact(key="speaks", label="Supported protocols", value=", ".join(hello.protocols))
    yield Fact(key="operations", label="Supported operations", value=", ".join(hello.operations))
    for one in protocols:
        if one.name in hello.messages:
            yield Fact(
                key=f"implements_{one.name}",
                label=f"Implemented messages of {one.name}",
                value=_implemented(one, hello.messages[one.name]),
            )


def _implemented(protocol: Protocol, names: frozenset[str]) -> str:
    every = len(registry_of(protocol).messages)
    return f"{len(names)} of {every}: {', '.join(sorted(names))}"


def _document(protocol: Protocol) -> str:
    document = registry_of(protocol).document()
    return f"{document['title']}, issue {document['issue']}"


def _digest(protocol: Protocol) -> str:
    vectors = resources.files(protocol.package) / "vectors.json"
    return hashlib.sha256(vectors.read_bytes()).hexdigest()


def _messages(protocols: Sequence[Protocol]) -> Iterator[Message]:
    for protocol in protocols:
        registry = registry_of(protocol)
        for name, entry in registry.messages.items():
            yield Message(
                name=name,
                places=tuple(
                    PageReference(
                        protocol.name, page, registry.where((page,), registry.overlay_of(entry))
                    )
                    for page in entry["pages"]
                ),
                errata=tuple(entry["errata"]),
            )


def _groups(report: Report, again: Callable[[str], str]) -> Iterator[Group]:
    groups: dict[str, list[Case]] = {}
    for result in report.results:
        groups.setdefault(result.case.group, []).append(_case(result, again))
    for asked in report.not_run:
        groups.setdefault(asked.group, []).append(
            Case(
                id=asked.id,
                title=_title(asked),
                grade=Grade.NOT_RUN,
                word=_NOT_RUN,
                omission=Omission.ENDED,
                why=f"the run ended before this case: {report.unfinished}",
                messages=_about(asked),
            )
        )
    for name, cases in groups.items():
        yield Group(name=name, title=GROUPS[name.rpartition("/")[2]], cases=tuple(cases))


def _case(result: Result, again: Callable[[str], str]) -> Case:
    asked = result.case
    skipped = not result.ran
    return Case(
        id=asked.id,
        title=_title(asked),
        grade=_grade(result),
        word=result.word,
        why=result.text if skipped else "",
        omission=Omission.NOT_IMPLEMENTED,
        findings=() if skipped else tuple(_findings(result)),
        messages=_about(asked),
        repeat=again(asked.id) if result.ran and result.outcome is not Outcome.PASSED else "",
        seconds=result.seconds,
    )


def _grade(result: Result) -> Grade:
    if result.failed:
        return Grade.FAILED
    if result.outcome is Outcome.SKIPPED:
        return Grade.SKIPPED
    if result.outcome is Outcome.NOT_IMPLEMENTED:
        return Grade.NOT_RUN
    return Grade.PASSED if result.outcome is Outcome.PASSED else Grade.NOTED


def _title(asked: Asked) -> str:
    """Return the expectation in one sentence."""
    return asked.about or f"Answered as in the vectors of {asked.protocol}"


def _about(asked: Asked) -> tuple[str, ...]:
    return (asked.message,) if asked.message else ()


def _findings(result: Result) -> Iterator[Finding]:
    grade = _grade(result)
    if result.outcome is not Outcome.PASSED:
        wanted, came = _bytes_or_texts(result)
        yield Finding(grade=grade, text=result.text, wanted=wanted, came=came)
        yield Finding(grade=grade, text=f"request: {_line(result.line)}")
    if result.said:
        yield Finding(grade=grade, text=f"end of standard error: {result.said}")
    if result.expected and result.failed:
        yield Finding(grade=grade, text=f"expected to fail: {result.expected}")
    elif result.expected:
        yield Finding(grade=grade, text=f"expected failure: {result.expected}")


def _bytes_or_texts(result: Result) -> tuple[bytes | str | None, bytes | str | None]:
    """Return expected and received answers; as bytes for an encode request."""
    wanted = result.wanted or {}
    try:
        came = json.loads(result.came)
        return bytes.fromhex(wanted["hex"]), bytes.fromhex(came["hex"])
    except (ValueError, LookupError, TypeError):
        text = _line(json.dumps(wanted).encode("ascii")) if wanted else None
        return text, _line(result.came) if result.came else None


def _line(line: bytes) -> str:
    text = line.decode("utf-8", errors="backslashreplace")
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}… ({len(text):,} characters)"
