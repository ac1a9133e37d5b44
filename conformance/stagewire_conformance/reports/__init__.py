"""Reports of conformance runs: one model, and one module for each format.

The results of a run become a :class:`Sheet`; ``as_json``, ``as_junit`` and ``as_html`` write it. JUnit and
HTML need the extra ``conformance``, which is imported when they are called.
"""

from __future__ import annotations

from stagewire_conformance.reports.html import as_html
from stagewire_conformance.reports.json_report import as_json
from stagewire_conformance.reports.junit import as_junit
from stagewire_conformance.reports.model import (
    Case,
    Erratum,
    Fact,
    Finding,
    Gap,
    Grade,
    Group,
    Message,
    Omission,
    PageReference,
    Rule,
    Sheet,
    Transmission,
    Verdict,
)

__all__ = [
    "Case",
    "Erratum",
    "Fact",
    "Finding",
    "Gap",
    "Grade",
    "Group",
    "Message",
    "Omission",
    "PageReference",
    "Rule",
    "Sheet",
    "Transmission",
    "Verdict",
    "as_html",
    "as_json",
    "as_junit",
]
