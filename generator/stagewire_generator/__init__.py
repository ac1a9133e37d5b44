"""Read a spec, check it, and render every target from the resolved model.

``check`` returns the frozen model of each protocol, or raises :class:`SpecError` with all diagnostics.
``reduced`` returns a model with some of its units only.
``render`` returns the text of every output file. :mod:`stagewire_generator.output` compares or writes them.
"""

from stagewire_generator.codes import CODES
from stagewire_generator.diagnostics import Diagnostic, SpecError
from stagewire_generator.pipeline import DEFAULT_TARGETS, TARGETS, check, render
from stagewire_generator.reduction import reduced, units_of

__all__ = [
    "CODES",
    "DEFAULT_TARGETS",
    "TARGETS",
    "Diagnostic",
    "SpecError",
    "check",
    "reduced",
    "render",
    "units_of",
]
