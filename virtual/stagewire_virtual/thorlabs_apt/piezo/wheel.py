"""The wheel on the top panel of a K-Cube, which changes the output (Issue 37, pages 235 and 236)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.piezo.actuator import FULL_SCALE
from stagewire_virtual.thorlabs_apt.piezo.ports import set_of


class _Fields(NamedTuple):
    """The fields of a set: the gear, and the step and the presets of a loop."""

    gear: str
    step: str
    presets: tuple[str, str]


_KPZ: Final = _Fields("js_volt_gearbox", "js_volt_step", ("preset_volt1", "preset_volt2"))
_FIELDS: Final = {
    "KPZ_KCUBEMMIPARAMS": (_KPZ, _KPZ),
    "KPC_KCUBEMMIPARAMS": (
        _Fields("js_gearbox", "js_volt_step", ("preset_volt1", "preset_volt2")),
        _Fields("js_gearbox", "js_pos_step", ("preset_pos1", "preset_pos2")),
    ),
}
"""The sets of the wheel, each with its fields in open and in closed loop."""

_ADJUST, _JOG = 1, 2  # the third mode goes to a preset
_STEPS_PER_CLICK: Final = {1: 10, 2: 5, 3: 1}
_SENSES: Final = {1: 1, 2: -1}  # no enumerations: packages of earlier issues have none of them

STEP: Final = FULL_SCALE // 1000
"""A step of the wheel in counts: a thousandth of full scale; the document has no value."""


class Wheel:
    """The wheel of a channel.

    :param channel: its channel.
    :param is_closed: returns whether the loop is closed.
    """

    def __init__(self, channel: Channel, is_closed: Callable[[], bool]) -> None:
        self._channel = channel
        self._is_closed = is_closed
        self._set = next((name for name in _FIELDS if channel.answers(set_of(name))), "")

    @property
    def exists(self) -> bool:
        """Whether the unit has a wheel."""
        return bool(self._set)

    @property
    def step(self) -> int:
        """The step of a jog and of a trigger input, in counts."""
        return self._ask(self._fields.step)

    def turned(self, clicks: int, present: int) -> int:
        """Return the set-point after a turn; positive clicks are upwards."""
        way = clicks * _SENSES.get(self._ask("dir_sense"), 0)
        if not way:
            return present
        mode = self._ask("js_mode")
        if mode == _ADJUST:
            return present + way * STEP * _STEPS_PER_CLICK[self._ask(self._fields.gear)]
        if mode == _JOG:
            return present + way * self.step
        return self._ask(self._fields.presets[0 if way > 0 else 1])

    @property
    def _fields(self) -> _Fields:
        return _FIELDS[self._set][self._is_closed()]

    def _ask(self, field: str) -> int:
        return self._channel.parameter(self._set, field)
