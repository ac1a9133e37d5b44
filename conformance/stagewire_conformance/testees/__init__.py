"""Tests of codecs in any language: a program that answers lines is tested with every case of a protocol.

:func:`run` starts it and runs the cases. :mod:`.runner` plans the cases, :mod:`.session` sends them, and
:mod:`stagewire_conformance.comparison` judges the answers.
"""

from __future__ import annotations

from stagewire_conformance.comparison import Outcome
from stagewire_conformance.testees.case import (
    Case,
    ExpectedFileError,
    NotATesteeError,
    NothingToAskError,
    NotStartedError,
    Step,
)
from stagewire_conformance.testees.expected import Expected, read_expected
from stagewire_conformance.testees.result import Hello, Report, Result
from stagewire_conformance.testees.runner import TIMEOUT, Plan, chosen, plan, run

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
    "Plan",
    "Report",
    "Result",
    "Step",
    "chosen",
    "plan",
    "read_expected",
    "run",
]
