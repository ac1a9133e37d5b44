"""The trigger ports and the wheel of a K-Cube (Issue 37, pages 235 to 247).

KPZ101, KSG101, KPC101 and CT1P have sets with the same modes, of which each has some.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from stagewire_virtual.errors import UnknownPartError
from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.piezo.actuator import FULL_SCALE

_CONFIGURATIONS: Final = {
    "KPZ_KCUBETRIGIOCONFIG": 1,
    "KSG_KCUBETRIGIOCONFIG": 100,  # limits of -100 to 100 (page 246), taken as per cent
    "KPC_KCUBETRIGIOCONFIG": FULL_SCALE,
}
"""The sets of the trigger ports, with the full scale of their limits."""

_INPUT, _STEP_UP, _STEP_DOWN, _OUTPUT = 0x01, 0x02, 0x03, 0x0A
# no enumerations: packages of earlier issues have neither them nor these messages
_ACTIVE_HIGH: Final = 1
_PORTS: Final = (1, 2)


class TriggerPorts:
    """The ports TRIG1 and TRIG2, each an input or an output.

    :param channel: its channel.
    :param step: called with 1 or -1 when an input steps the output up or down.
    :param share: returns the signal that the limits apply to, as a fraction of full scale.
    """

    def __init__(
        self, channel: Channel, step: Callable[[int], None], share: Callable[[], float]
    ) -> None:
        self._channel = channel
        self._step = step
        self._share = share
        self._levels = dict.fromkeys(_PORTS, False)
        self._set = next((name for name in _CONFIGURATIONS if channel.answers(_set_of(name))), "")

    def drive(self, port: int, level: bool) -> None:
        """Apply a level to a port, True for high; ports of a new controller are low.

        An edge to the active level steps the output if the mode of the port says so (page 237).

        Raises :class:`~stagewire_virtual.errors.UnknownPartError` for a port that the unit does not have.
        """
        self._check(port)
        changed, self._levels[port] = level != self._levels[port], level
        mode = self._mode(port)
        if changed and level == self._is_active_high(port) and mode in (_STEP_UP, _STEP_DOWN):
            self._step(1 if mode == _STEP_UP else -1)

    def output(self, port: int) -> bool:
        """Return the level at which a port drives, True for high; False if it is not an output.

        Raises :class:`~stagewire_virtual.errors.UnknownPartError` for a port that the unit does not have.
        """
        self._check(port)
        mode = self._mode(port)
        return mode >= _OUTPUT and self._is_met(port, mode) == self._is_active_high(port)

    def is_high(self, port: int) -> bool:
        """Return whether a port is a logic input and its level is high, as in the status bits."""
        return bool(self._set) and self._mode(port) == _INPUT and self._levels[port]

    def _is_met(self, port: int, mode: int) -> bool:
        """Return whether the condition of an output mode holds now."""
        if mode == _OUTPUT:
            return bool(self._channel.parameter("MOD_DIGOUTPUTS", "bit") >> (port - 1) & 1)
        signal = self._share() * _CONFIGURATIONS[self._set]
        lower = self._channel.parameter(self._set, "lower_lim")
        upper = self._channel.parameter(self._set, "upper_lim")
        conditions = (
            signal < lower,
            signal > lower,
            signal < upper,
            signal > upper,
            lower < signal < upper,
            not lower <= signal <= upper,
        )
        return conditions[mode - _OUTPUT - 1]

    def _mode(self, port: int) -> int:
        return self._channel.parameter(self._set, f"trig{port}_mode")

    def _is_active_high(self, port: int) -> bool:
        return self._channel.parameter(self._set, f"trig{port}_polarity") == _ACTIVE_HIGH

    def _check(self, port: int) -> None:
        known = _PORTS if self._set else ()
        if port not in known:
            raise UnknownPartError(f"trigger port {port}", [f"trigger port {one}" for one in known])


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
        self._set = next((name for name in _FIELDS if channel.answers(_set_of(name))), "")

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


def _set_of(name: str) -> str:
    """Return the SET of a parameter set."""
    group, _, rest = name.partition("_")
    return f"{group}_SET_{rest}"
