"""What changed between two specs: typed changes, each WIRE, SOURCE or DOC.

``compare`` takes the checked models of both sides and gives the changes; ``revision`` brings a side out of a
git repository. ``docs/changes.md`` says what each kind of change means.
"""

from stagewire_generator.change.change import Change, ChangeClass, worst
from stagewire_generator.change.compare import compare
from stagewire_generator.change.kinds import KINDS, Kind
from stagewire_generator.change.report import report
from stagewire_generator.change.revision import Revision, RevisionError, revision

__all__ = [
    "KINDS",
    "Change",
    "ChangeClass",
    "Kind",
    "Revision",
    "RevisionError",
    "compare",
    "report",
    "revision",
    "worst",
]
