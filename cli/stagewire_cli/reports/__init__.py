"""How ``stagewire check`` reports: one module a format, each a function from a report to a text."""

from __future__ import annotations

import enum
from collections.abc import Callable

from stagewire_cli.reports.github import as_github
from stagewire_cli.reports.jsons import as_json
from stagewire_cli.reports.junit import as_junit
from stagewire_cli.reports.report import Report
from stagewire_cli.reports.text import as_text, summary

__all__ = ["Report", "ReportFormat", "summary", "written"]


class ReportFormat(enum.StrEnum):
    """What ``--format`` takes."""

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
    """Return a report in a format: whole lines, or nothing."""
    return _WRITERS[format](report)
