"""Tests of codecs in any language: a program that answers lines is asked all that a codec has to know.

:func:`run` starts it and asks; :mod:`.plan` says what, :mod:`.session` how, and
:mod:`stagewire_conformance.comparison` whether an answer is right.
"""

from __future__ import annotations

from stagewire_conformance.comparison import Outcome
from stagewire_conformance.testees.case import Case, Step
from stagewire_conformance.testees.errors import (
    ExpectedFileError,
    NotATesteeError,
    NothingToAskError,
    NotStartedError,
)
from stagewire_conformance.testees.expected import Expected, read_expected
from stagewire_conformance.testees.hello import Hello
from stagewire_conformance.testees.plan import chosen, plan
from stagewire_conformance.testees.result import Report, Result
from stagewire_conformance.testees.running import TIMEOUT, run

__all__ = [
    "TIMEOUT",
    "Case",
    "Expected",
    "ExpectedFileError",
    "Hello",
    "NotATesteeError",
    "NotStartedError",
    "NothingToAskError",
    "Outcome",
    "Report",
    "Result",
    "Step",
    "chosen",
    "plan",
    "read_expected",
    "run",
]
