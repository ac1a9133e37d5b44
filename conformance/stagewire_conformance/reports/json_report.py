"""The JSON report: one object, as described by ``spec/schema/conformance-report.schema.json``."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from stagewire import __version__
from stagewire_conformance.reports.coverage import PageRow, messages, pages
from stagewire_conformance.reports.model import (
    Case,
    Finding,
    Grade,
    PageReference,
    Rule,
    Sheet,
    Transmission,
)
from stagewire_conformance.reports.text import sentence

SCHEMA_VERSION = 1

Json = dict[str, Any]


def as_json(sheet: Sheet) -> str:
    """Return the report in ASCII, so that it does not depend on an encoding."""
    data = {
        "schema_version": SCHEMA_VERSION,
        "kind": sheet.kind,
        "stagewire": __version__,
        "title": sheet.title,
        "verdict": str(sheet.verdict),
        "headline": sheet.headline,
        "complete": sheet.complete,
        "gaps": [
            {"omission": str(gap.omission), "why": gap.why, "cases": gap.cases}
            for gap in sheet.gaps
        ],
        "summary": sentence(sheet),
        "unfinished": sheet.unfinished or None,
        "started": sheet.started.isoformat(timespec="seconds"),
        "seconds": round(sheet.seconds, 3),
        "adrift": list(sheet.adrift),
        "seed": sheet.seed,
        "command": sheet.command,
        "protocols": dict(sheet.protocols),
        "facts": {fact.key: fact.value for fact in sheet.facts},
        "declaration": [{"label": fact.label, "value": fact.value} for fact in sheet.declaration],
        "digests": dict(sheet.digests),
        "counts": _counts(sheet.counts()),
        "groups": [
            {
                "name": group.name,
                "title": group.title,
                "cases": [_case(sheet, one) for one in group.cases],
            }
            for group in sheet.groups
        ],
        "rules": [_rule(rule) for rule in sheet.rules.values()],
        "errata": [
            {
                "id": erratum.id,
                "places": [_place(place) for place in erratum.places],
                "subject": erratum.subject,
                "printed": erratum.printed,
                "encoded": erratum.encoded,
                "evidence": erratum.evidence,
            }
            for erratum in sheet.errata.values()
        ],
        "coverage": {
            "messages": [
                {
                    "name": row.message.name,
                    "places": [_place(place) for place in row.message.places],
                    "unsupported": row.message.unsupported or None,
                    "counts": _counts(row.counts),
                }
                for row in messages(sheet)
            ],
            "places": [_page(row) for row in pages(sheet)],
        },
    }
    return json.dumps(data, indent=1, allow_nan=False) + "\n"


def _case(sheet: Sheet, case: Case) -> Json:
    return {
        "id": case.id,
        "title": case.title,
        "result": case.word,
        "grade": str(case.grade),
        "why": case.why or None,
        "omission": str(sheet.omission_of(case)) if case.grade is Grade.NOT_RUN else None,
        "causes": list(case.causes),
        "messages": list(case.messages),
        "rules": list(case.rules),
        "findings": [_finding(finding) for finding in case.findings],
        "figures": {name: one for name, one in case.figures.items() if math.isfinite(one)},
        "restored": list(case.restored),
        "seconds": round(case.seconds, 3),
        "repeat": case.repeat or None,
        "lines": [_line(line) for line in case.lines],
    }


def _finding(finding: Finding) -> Json:
    return {
        "grade": str(finding.grade),
        "text": finding.text,
        "rule": finding.rule or None,
        "wanted": _bytes_or_text(finding.wanted),
        "came": _bytes_or_text(finding.came),
    }


def _bytes_or_text(value: bytes | str | None) -> Json | None:
    if value is None:
        return None
    return {"hex": value.hex()} if isinstance(value, bytes) else {"text": value}


def _line(line: Transmission) -> Json:
    return {
        "time": round(line.time, 6),
        "sent": line.sent,
        "hex": line.raw.hex(),
        "text": line.text,
        "minor": line.minor,
    }


def _rule(rule: Rule) -> Json:
    return {
        "id": rule.id,
        "place": _place(rule.place),
        "strength": rule.strength,
        "states": rule.states,
        "means": rule.means or None,
        "errata": list(rule.errata),
        "waiver": rule.waiver or None,
        "for_host": rule.for_host,
    }


def _place(place: PageReference) -> Json:
    return {"protocol": place.protocol, "number": place.number, "name": place.name}


def _page(row: PageRow) -> Json:
    return {
        **_place(row.place),
        "messages": list(row.messages),
        "rules": {one.rule.id: _counts(one.counts) for one in row.rules},
        "counts": _counts(row.counts),
    }


def _counts(counts: Mapping[Grade, int]) -> dict[str, int]:
    return {str(grade): counts.get(grade, 0) for grade in Grade}
