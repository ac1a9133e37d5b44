"""Nothing comes unasked: the document has no message that a controller sends by itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire_conformance.device.check import Check, Kind
from stagewire_conformance.device.checks.ms2000.axis import line_of
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.trial import Trial

__all__ = ["KIND"]

_SECONDS: Final = 0.5


def _look(trial: Trial) -> None:
    came = line_of(trial).listen(_SECONDS)
    trial.must(
        not came, f"{len(came)} bytes came within {_SECONDS:g} s, and nothing was asked", came=came
    )


def _make(declared: Declared, allowed: Permissions) -> Iterator[Check]:
    yield Check(
        id=KIND.name,
        title="Nothing comes while nothing is asked",
        messages=(),
        run=_look,
        seconds=_SECONDS,
    )


KIND: Final = Kind(
    name="quiet",
    title="Nothing comes unasked",
    rules=("no-blanks-in-replies",),
    make=_make,
)
