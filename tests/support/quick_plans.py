"""Plan the cases only once for tests that run them with many codecs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache

import pytest

from stagewire.protocols import Protocol
from stagewire_conformance.testees import Case, runner
from stagewire_conformance.testees.result import Hello
from stagewire_conformance.testees.runner import plan


@contextmanager
def quick_plans() -> Iterator[None]:
    """Plan the cases of equal protocols, seed and testee only once until the block ends."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "plan", _planned)
        yield


def _planned(protocols: Iterable[Protocol], seed: int, hello: Hello | None = None) -> list[Case]:
    return list(_once(tuple(protocols), seed, hello))


@cache
def _once(protocols: tuple[Protocol, ...], seed: int, hello: Hello | None) -> list[Case]:
    return plan(protocols, seed, hello)
