"""For people: a line and a hint for each diagnostic, or what was looked at."""

from __future__ import annotations

from stagewire_cli.reports.report import Report
from stagewire_cli.terminal import printable

__all__ = ["as_text", "summary"]


def as_text(report: Report) -> str:
    """Return the diagnostics, or the summary when there are none."""
    if report.diagnostics:
        return "".join(f"{diagnostic}\n" for diagnostic in report.diagnostics)
    return summary(report)


def summary(report: Report) -> str:
    """Return how many errors there are, or what a spec without any holds and how it changed."""
    number = len(report.diagnostics)
    if number:
        return f"{printable(str(report.spec))}: {number} error{'s' * (number != 1)}\n"
    lines = [
        f"{name}: ok; {seen.messages} messages, {seen.layouts} layouts, {seen.fields} fields, "
        f"{seen.errata} errata, {seen.places} witness places, {seen.examples} examples\n"
        for name, seen in report.counts.items()
    ]
    if report.against:
        total = sum(report.changes.values())
        listed = ", ".join(f"{count} {level}" for level, count in report.changes.items())
        lines.append(
            f"against {printable(report.against)}: ok; {total} change{'s' * (total != 1)}: {listed}\n"
        )
    return "".join(lines)
