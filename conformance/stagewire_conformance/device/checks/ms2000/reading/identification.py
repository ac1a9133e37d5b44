"""What an axis says that it is (section 7)."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.axis_check import axis_check
from stagewire_ms2000 import messages as m

_MOTORS: Final = ("X", "Y", "Z")
"""The axes of which the document says what they answer."""
_MOTOR: Final = b"EMOT "
_LAST: Final = b": "
"""The sixth byte: the colon of the example, or the blank of the text."""


KIND: Final = Kind(
    name="identification",
    title="Every axis says what it is",
    rules=("identification-reply", "identification-blanks", "axis-identifiers"),
)


@axis_check(
    KIND, "{axis} says in six bytes what it is", messages=("READ_IDENTIFICATION",), seconds=0.2
)
def _look(axis: Axis) -> None:
    came = axis.ask(m.ReadIdentification(), quiet=0.2).pack()
    if axis.name not in _MOTORS:
        axis.trial.info(
            f"axis {axis.name} says that it is {came!r}; the document does not say what is due"
        )
        return
    axis.trial.must(
        came[:5] == _MOTOR,
        f"axis {axis.name} says that it is {came!r}; it has to say EMOT and a blank",
        wanted=_MOTOR + _LAST[:1],
        came=came,
    )
    axis.trial.must(
        came[5] in _LAST,
        f"the identification of axis {axis.name} ends with {came[5]:#04x}; it ends with a colon or a blank",
        wanted=_MOTOR + _LAST[:1],
        came=came,
    )
    if came[5:] == b" ":
        axis.trial.info("its sixth byte is the blank of the text, not the colon of the example")
