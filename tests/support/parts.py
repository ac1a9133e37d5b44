"""Parameters of which `make test` runs some, and `make test-all` all.

:data:`PROOF` marks the tests that try thousands of cases or need a quiet machine, which `make proofs` runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import count
from typing import Any

import pytest

PROOF = (pytest.mark.matrix, pytest.mark.proof)


def chosen(cases: Iterable[Any], by: Callable[[Any], bool]) -> list[Any]:
    """Return cases as parameters. Those for which ``by`` is false belong to the matrix.

    A tuple has a value for each parameter of the test.
    """
    return [case if by(case) else _in_the_matrix(case) for case in cases]


def every_nth(cases: Iterable[Any], nth: int) -> list[Any]:
    """Return cases as parameters. All except every ``nth`` belong to the matrix."""
    number = count()
    return chosen(cases, lambda case: next(number) % nth == 0)


def first_of(cases: Iterable[Any], first: int = 1) -> list[Any]:
    """Return cases as parameters. All except the first ``first`` belong to the matrix."""
    number = count()
    return chosen(cases, lambda case: next(number) < first)


def _in_the_matrix(case: Any) -> Any:
    values = case if isinstance(case, tuple) else (case,)
    return pytest.param(*values, marks=pytest.mark.matrix)
