"""Sample sheets: one with every kind of content, and one with malicious texts."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

from stagewire_conformance.reports import (
    Case,
    Erratum,
    Fact,
    Finding,
    Grade,
    Group,
    Message,
    PageReference,
    Rule,
    Sheet,
    Transmission,
)

HOSTILE = "<script>alert(1)</script>\x1b[2J\x00\u202e\n]]>&\"'{{ 7*7 }}"
"""Malicious text from a controller: markup, section ends, terminal escapes, and direction changes."""

PAGE_9 = PageReference("thorlabs_apt", 9, "page 9")
PAGE_30 = PageReference("thorlabs_apt", 30, "page 30")

ASKED = Transmission(
    time=0.5, sent=True, raw=bytes.fromhex("140401005001"), text="MOT_REQ_VELPARAMS"
)
WANTED = bytes.fromhex("15040e0081500100000000000f000000cd000300")
CAME = bytes.fromhex("15040e0081500200000000000f000000cd000300")
ANSWERED = Transmission(time=0.502, sent=False, raw=CAME, text="MOT_GET_VELPARAMS chan_ident=2")
SIGN = Transmission(time=0.6, sent=True, raw=bytes.fromhex("920400005001"), text="ACK", minor=True)

PASSED = Case(
    id="answers/0x50/MOT_REQ_HOMEPARAMS/1",
    title="MOT_REQ_HOMEPARAMS is answered by MOT_GET_HOMEPARAMS",
    grade=Grade.PASSED,
    word="PASS",
    messages=("MOT_REQ_HOMEPARAMS", "MOT_GET_HOMEPARAMS"),
    rules=("request-answered",),
    lines=(ASKED, ANSWERED),
    repeat="stagewire conformance device socket://127.0.0.1:4001",
    seconds=0.25,
)
FAILED = Case(
    id="answers/0x50/MOT_REQ_VELPARAMS/1",
    title="MOT_REQ_VELPARAMS is answered by MOT_GET_VELPARAMS",
    grade=Grade.FAILED,
    word="FAIL",
    findings=(
        Finding(
            grade=Grade.FAILED,
            text="channel 2 came, not 1",
            wanted=WANTED,
            came=CAME,
            rule="request-answered",
        ),
        Finding(grade=Grade.DEVIATES, text="a byte too many", wanted=b"\x01", came=b"\x01\x02"),
        Finding(grade=Grade.NOTED, text="it took long"),
    ),
    messages=("MOT_REQ_VELPARAMS", "MOT_GET_VELPARAMS"),
    rules=("request-answered", "velocity-parameters"),
    lines=(ASKED, SIGN, ANSWERED),
    restored=("velocity parameters of channel 1",),
    repeat="stagewire conformance device 'virtual://TDC001?stage=Z8' --unit TDC001 --only x",
    figures={"p99_ms": 3.25},
    seconds=1.5,
)
DEVIATING = replace(
    PASSED,
    id="updates/0x50",
    grade=Grade.DEVIATES,
    word="NON-STRICT",
    findings=FAILED.findings[1:2],
)
FRAGILE = replace(DEVIATING, id="garbage/one", grade=Grade.FRAGILE, word="FRAGILE")
NOTED = replace(PASSED, id="timing/0x50", grade=Grade.NOTED, word="INFO", lines=())
SKIPPED = replace(
    PASSED, id="pot/0x50", grade=Grade.SKIPPED, word="SKIP", why="no potentiometer", lines=()
)
NOT_RUN = replace(
    PASSED,
    id="move/0x50",
    grade=Grade.NOT_RUN,
    word="NOT RUN",
    why="needs --allow-motion",
    lines=(),
)
RULES = (
    Rule(
        id="request-answered",
        place=PAGE_9,
        strength="must",
        states="A request is answered.",
        means="Every REQ has its GET.",
        errata=("apt-a-misprint",),
    ),
    Rule(
        id="velocity-parameters", place=PAGE_30, strength="should", states="Velocities … are set."
    ),
    Rule(
        id="unseen", place=PAGE_9, strength="must", states="A light flashes.", waiver="nobody looks"
    ),
    Rule(
        id="host",
        place=PAGE_9,
        strength="must",
        states="The host waits.",
        for_host=True,
        waiver="-",
    ),
)
ERRATUM = Erratum(
    id="apt-a-misprint",
    places=(PAGE_9, PAGE_30),
    subject="A byte line",
    printed="14 05",
    encoded="14 04",
    evidence="the heading has it",
)


def sheet(*cases: Case, **changes: object) -> Sheet:
    """Return a sheet of these cases, or of one of each kind."""
    every = cases or (PASSED, FAILED, DEVIATING, FRAGILE, NOTED, SKIPPED, NOT_RUN)
    kinds = dict.fromkeys(case.id.partition("/")[0] for case in every)
    made = Sheet(
        kind="device",
        title="Conformance of the TDC001",
        protocols={"thorlabs_apt": "Thorlabs APT, Issue 3"},
        started=datetime(2020, 1, 2, 3, 4, 5, tzinfo=UTC),
        seconds=12.5,
        seed=7,
        facts=(
            Fact(key="url", label="Line", value="virtual://TDC001?stage=Z8"),
            Fact(key="serial_number", label="Serial number", value=83000001),
            Fact(key="jitter_ms", label="Jitter of this computer", value=0.25),
            Fact(key="firmware", label="Firmware", value=None),
        ),
        digests={"suite": "ab" * 32, "pics": "cd" * 32},
        command="stagewire conformance device 'virtual://TDC001?stage=Z8' --unit TDC001 --seed 7",
        groups=tuple(
            Group(
                name=kind,
                title=f"What {kind} have to do",
                cases=tuple(case for case in every if case.id.partition("/")[0] == kind),
            )
            for kind in kinds
        ),
        rules={rule.id: rule for rule in RULES},
        errata={ERRATUM.id: ERRATUM},
        messages=(
            Message(name="MOT_REQ_VELPARAMS", places=(PAGE_30,), errata=("apt-a-misprint",)),
            Message(name="MOT_REQ_POTPARAMS", places=(PAGE_30,), unsupported="no potentiometer"),
        ),
    )
    return replace(made, **changes)  # type: ignore[arg-type]


def hostile() -> Sheet:
    """Return a sheet with malicious text in every place for text from outside."""
    bad = replace(
        FAILED,
        title=HOSTILE,
        word=f"FAIL{HOSTILE}",
        findings=(
            Finding(grade=Grade.FAILED, text=HOSTILE, wanted=HOSTILE, came=HOSTILE),
            *FAILED.findings,
        ),
        messages=(HOSTILE, *FAILED.messages),
        lines=(replace(ANSWERED, text=HOSTILE), replace(ASKED, text=HOSTILE)),
        restored=(HOSTILE,),
        repeat=HOSTILE,
        figures={HOSTILE: 1.0},
    )
    left = replace(NOT_RUN, title=HOSTILE, why=HOSTILE)
    noted = replace(NOTED, findings=(Finding(grade=Grade.NOTED, text=HOSTILE),), lines=bad.lines)
    place = PageReference("thorlabs_apt", 12, HOSTILE)
    return sheet(
        bad,
        left,
        noted,
        title=HOSTILE,
        command=HOSTILE,
        unfinished=HOSTILE,
        protocols={"thorlabs_apt": HOSTILE},
        facts=(Fact(key="notes", label=HOSTILE, value=HOSTILE),),
        declaration=(Fact(key="unit", label=HOSTILE, value=HOSTILE),),
        digests={HOSTILE: HOSTILE},
        rules={
            rule.id: replace(rule, states=HOSTILE, means=HOSTILE, waiver=rule.waiver and HOSTILE)
            for rule in RULES
        },
        errata={
            ERRATUM.id: replace(
                ERRATUM, subject=HOSTILE, printed=HOSTILE, encoded=HOSTILE, evidence=HOSTILE
            )
        },
        messages=(Message(name=HOSTILE, places=(place,), unsupported=HOSTILE),),
    )
