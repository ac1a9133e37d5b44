"""For programs: one JSON object, as ``spec/schema/diagnostics.schema.json`` describes it."""

from __future__ import annotations

import dataclasses
import json

from stagewire_cli.reports.report import Report

__all__ = ["SCHEMA_VERSION", "as_json"]

SCHEMA_VERSION = 1


def as_json(report: Report) -> str:
    """Return the report in ASCII, so that no terminal and no encoding can change it."""
    from stagewire_generator.codes import CODES
    from stagewire_generator.codes_page import anchor

    data = {
        "schema_version": SCHEMA_VERSION,
        "spec": report.spec.as_posix(),
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
