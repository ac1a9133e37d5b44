"""Nothing comes unasked: the document has no message that a controller sends by itself."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import line_of
from stagewire_conformance.device.trial import Trial

_SECONDS: Final = 0.5


KIND: Final = Kind(
    name="quiet",
    title="Nothing comes unasked",
    rules=("no-blanks-in-replies",),
)


@KIND.check("Nothing comes while nothing is asked", seconds=_SECONDS)
def _look(trial: Trial) -> None:
    came = line_of(trial).listen(_SECONDS)
    trial.must(
        not came, f"{len(came)} bytes came within {_SECONDS:g} s, and nothing was asked", came=came
    )
