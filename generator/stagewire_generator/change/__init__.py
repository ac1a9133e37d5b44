"""What changed between two specs: typed changes, each WIRE, SOURCE or DOC.

``compare`` takes the checked models of both sides and gives the changes, ``compare_specs`` those of their
overlays, too; ``revision`` brings a side out of a git repository; ``unvouched`` finds what changed on the
wire without evidence. ``docs/changes.md`` says what each kind of change means, and what evidence is.
"""

from stagewire_generator.change.change import Change, ChangeClass, worst
from stagewire_generator.change.compare import compare, compare_specs
from stagewire_generator.change.evidence import unvouched
from stagewire_generator.change.kinds import KINDS, Kind
from stagewire_generator.change.report import report
from stagewire_generator.change.revision import Revision, RevisionError, revision
from stagewire_generator.change.spec import Spec

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
