"""Compare two specs and classify each change as WIRE, SOURCE or DOC.

``compare`` returns the changes between two checked models, and ``compare_specs`` also those of their
overlays. ``revision`` reads a spec from a git repository. ``unvouched`` finds changes on the wire without
evidence. ``docs/reference/changes.md`` describes the kinds of change, and the evidence that counts.
"""

from stagewire_generator.change.changes import KINDS, Change, ChangeClass, Kind, report, worst
from stagewire_generator.change.compare import Spec, compare, compare_specs
from stagewire_generator.change.evidence import unvouched
from stagewire_generator.change.revision import Revision, RevisionError, revision

__all__ = [
    "KINDS",
    "Change",
    "ChangeClass",
    "Kind",
    "Revision",
    "RevisionError",
    "Spec",
    "compare",
    "compare_specs",
    "report",
    "revision",
    "unvouched",
    "worst",
]
