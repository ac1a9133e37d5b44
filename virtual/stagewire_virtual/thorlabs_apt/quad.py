"""A quad detector unit: modes, outputs, readings and trigger ports (pages 327 to 353 of Issue 37)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from stagewire import Frame
from stagewire.devices import number_of, pattern_of
from stagewire_virtual.thorlabs_apt.beam import FULL_VOLTS, Beam, Loop, seeded_beam
from stagewire_virtual.thorlabs_apt.channel import (
    Behaviour,
    Channel,
    LiveState,
    live,
    stored,
)

MONITOR, OPEN_LOOP, CLOSED_LOOP, AUTOMATIC = 1, 2, 3, 4
"""The operating modes (page 336)."""

_HELD = 2  # open_loop_pos_demands (page 334)
_FULL_GAIN = 32767  # of loop parameters and senses (pages 329 and 334)
_COUNTS = 32767 / FULL_VOLTS  # page 332
_SUM_COUNTS = 65535 / FULL_VOLTS
_TOGGLE = 2  # a trigger mode (page 346)
_ACTIVE_LOW = 2  # page 347

_PROPORTIONAL: Final = 0.01
"""Proportional constant for a gain of 1 of 100; the document gives gains no unit."""

_INTEGRAL: Final = 1.0
"""Integral constant in 1/s for a gain of 1 of 100."""

_LIMITS = {
    f"{axis}_pos_demand_{end}": volts * 32767
    for axis in "xy"
    for end, volts in (("min", -1), ("max", 1))
}
_DEFAULTS: Final[Mapping[str, Mapping[str, int]]] = {
    "QUAD_LOOPPARAMS": {"p_gain": 21298, "i_gain": 26213, "d_gain": 19660},
    "QUAD_POSDEMANDPARAMS": {
        **_LIMITS,
        "lv_out_route": 2,
        "open_loop_pos_demands": 1,
        "x_pos_demand_fb_sense": _FULL_GAIN,
        "y_pos_demand_fb_sense": _FULL_GAIN,
    },
    "QUAD_OPERMODE": {"mode": OPEN_LOOP},
    "QUAD_DISPLAYSETTINGS": {"disp_intensity": 255, "disp_mode": 1, "disp_dim_timeout": 2570},
    "QUAD_LOOPPARAMS2": {
        "pid_consts_p": pattern_of(65.0, 4),
        "pid_consts_i": pattern_of(80.0, 4),
        "pid_consts_d": pattern_of(60.0, 4),
        "pid_consts_dfc": pattern_of(500.0, 4),
        "filter_fc": pattern_of(500.0, 4),
        "filter_q": pattern_of(5.0, 4),
        "notch_filter_on": 2,
        "pid_deriv_filter_on": 2,
    },
}
"""The parameters of a new unit, mostly those of the examples."""


class Quad(Behaviour):
    """A quad detector with a beam, which the outputs steer.

    10 V at an output move the beam by half of the detector, right or down, so that a loop with a positive
    sense centres it. A loop has the proportional constant gain / 100 and the integral constant gain / s, both
    multiplied by the sense, where gain is 0 to 100. With the defaults and a sum signal of 5 V, the time
    constant is 33 ms. The differential gain and the filters are stored and have no effect.

    It starts in open loop with outputs of 0 V, whatever was saved. In open loop, the outputs can be set.

    :param channel: its channel.
    """

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        self._beam = seeded_beam(channel.random)
        self._with_filters = True
        self._levels = [True, True]  # inputs have pull-up resistors (page 346)
        self.power_on()

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, int]]:
        """Return the parameters of a new unit."""
        return _DEFAULTS

    # For tests

    @property
    def beam(self) -> Beam:
        """The beam, which the user can move, block or replace; a new unit has it at a place from its seed."""
        return self._beam

    @beam.setter
    def beam(self, beam: Beam) -> None:
        self._change(beam=beam)

    @property
    def time_constants(self) -> tuple[float, float]:
        """The time constants of both loops in s; infinite for a loop that does not centre the beam."""
        x, y = (loop.time_constant for loop in self._made(self._outputs()))
        return x, y

    @property
    def outputs(self) -> tuple[bool, bool]:
        """The levels of the ports TRIG1 and TRIG2 of a KPA101, True for high; inputs are as they were set."""
        one, two = (self._port(number) for number in (1, 2))
        return one, two

    def set_input(self, port: int, level: bool) -> None:
        """Set the level of port 1 or 2 of a KPA101; an edge to the active level can trigger (page 346)."""
        before, self._levels[port - 1] = self._levels[port - 1], level
        if (
            level != before
            and level != self._inverted(port)
            and self._trigger(port, "mode") == _TOGGLE
        ):
            self._set_mode(OPEN_LOOP if self._closed else CLOSED_LOOP)

    # The host

    def power_on(self) -> None:
        """Reset to the power-on state: open loop, outputs of 0 V."""
        self._mode["mode"] = OPEN_LOOP
        self._effective = OPEN_LOOP
        self._fixed = (0.0, 0.0)  # the outputs in open loop
        self._loops: tuple[Loop, Loop] | None = None  # in closed loop

    def refusal(self, frame: Frame) -> str | None:
        """Return why a SET cannot be stored now; None if it can."""
        message: Any = frame.message
        match message.layout.message:
            case "QUAD_SET_POSITIONOUTPUTS" if self._effective != OPEN_LOOP:
                return "the outputs can only be set in open loop"
            case "QUAD_SET_POSDEMANDPARAMS" if (
                message.x_pos_demand_min > message.x_pos_demand_max
                or message.y_pos_demand_min > message.y_pos_demand_max
            ):
                return "a lowest output is above the highest"
        return None

    @stored("QUAD_OPERMODE")
    def mode_was_set(self, frame: Frame) -> None:
        """Change the mode (page 336)."""
        self._obey()

    @stored("QUAD_POSITIONOUTPUTS")
    def outputs_were_set(self, frame: Frame) -> None:
        """Set the outputs (page 341)."""
        message: Any = frame.message
        self._fixed = (message.x_pos / _COUNTS, message.y_pos / _COUNTS)

    @stored("QUAD_LOOPPARAMS")
    def gains_were_set(self, frame: Frame) -> None:
        """Use these gains, until others are set with filters."""
        self._with_filters = False
        self._change()

    @stored("QUAD_LOOPPARAMS2")
    def gains_with_filters_were_set(self, frame: Frame) -> None:
        """Use these gains, until others are set without filters."""
        self._with_filters = True
        self._change()

    @stored("QUAD_POSDEMANDPARAMS", "QUAD_KPATRIGIOCONFIG")
    def limits_were_set(self, frame: Frame) -> None:
        """Use the new limits and senses; the outputs in open loop stay."""
        self._change()

    @live("QUAD_POSITIONOUTPUTS")
    def position_outputs(self) -> dict[str, int]:
        """Return the outputs (page 341)."""
        x, y = self._outputs()
        return {"x_pos": round(x * _COUNTS), "y_pos": round(y * _COUNTS)}

    @live("QUAD_READINGS")
    def readings(self) -> dict[str, int]:
        """Return the signals and the outputs (page 332)."""
        x, y = self._differences()
        return {
            "x_diff": round(x * _COUNTS),
            "y_diff": round(y * _COUNTS),
            "sum": round(self._beam.power * _SUM_COUNTS),
            **self.position_outputs(),
        }

    @live("QUAD_STATUSBITS")
    def status_bits(self) -> dict[str, int]:
        """Return the status bits: one for the mode (page 338)."""
        return {"status_bits": 1 << self._effective - 1}

    def status(self) -> Mapping[str, int]:
        """Return the present status message (page 351)."""
        return {**self.readings(), **self.status_bits()}

    def row(self) -> LiveState:
        """Return the difference signals and the mode."""
        x, y = self._differences()
        names = {MONITOR: "monitor", OPEN_LOOP: "open loop", CLOSED_LOOP: "closed loop"}
        return LiveState(f"{x:.3f}, {y:.3f} V", names[self._effective])

    # The loops

    @property
    def _mode(self) -> dict[str, Any]:
        return self.channel.parameters["QUAD_OPERMODE"]

    @property
    def _closed(self) -> bool:
        return self._effective == CLOSED_LOOP

    def _set_mode(self, mode: int) -> None:
        self._mode["mode"] = mode
        self._obey()

    def _obey(self) -> None:
        """Change to the mode of the parameters, which for AUTOMATIC depends on the sum signal."""
        mode = self._mode["mode"]
        if mode == AUTOMATIC:
            least = self._trigger(1, "sum_min") / 100 * FULL_VOLTS
            mode = CLOSED_LOOP if self._beam.power >= least else OPEN_LOOP
        if mode == self._effective:
            return
        outputs = self._outputs()
        self._effective = mode
        self._loops = self._made(outputs) if mode == CLOSED_LOOP else None
        held = self.channel.parameter("QUAD_POSDEMANDPARAMS", "open_loop_pos_demands") == _HELD
        self._fixed = outputs if held else (0.0, 0.0)

    def _change(self, beam: Beam | None = None) -> None:
        """Continue the loops after a change of the beam or of parameters."""
        now = self.channel.clock.now
        kept = [loop.integral_at(now) for loop in self._loops] if self._loops else None
        self._beam = beam or self._beam
        if self._mode["mode"] == AUTOMATIC:
            self._obey()
        if self._loops and kept:
            self._loops = self._made((kept[0], kept[1]))

    def _made(self, stored: tuple[float, float]) -> tuple[Loop, Loop]:
        """Return the loops of both axes from now on, with the values of their integrals."""
        x, y = (self._loop(*each) for each in zip("xy", self._offsets(), stored, strict=True))
        return x, y

    def _loop(self, axis: str, offset: float, integral: float) -> Loop:
        limits = self.channel.parameters["QUAD_POSDEMANDPARAMS"]
        sense = limits[f"{axis}_pos_demand_fb_sense"] / _FULL_GAIN
        proportional, gain = self._gains()
        low, high = (limits[f"{axis}_pos_demand_{end}"] / _COUNTS for end in ("min", "max"))
        return Loop(
            began=self.channel.clock.now,
            offset=offset,
            effect=self._beam.power / FULL_VOLTS,
            proportional=sense * proportional * _PROPORTIONAL,
            integral=sense * gain * _INTEGRAL,
            stored=integral,
            low=low,
            high=high,
        )

    def _gains(self) -> tuple[float, float]:
        """Return the proportional and the integral gain, 0 to 100, or more with filters."""
        filters = self.channel.parameters.get("QUAD_LOOPPARAMS2")
        if filters and self._with_filters:
            return number_of(filters["pid_consts_p"], 4), number_of(filters["pid_consts_i"], 4)
        plain = self.channel.parameters["QUAD_LOOPPARAMS"]
        return plain["p_gain"] / _FULL_GAIN * 100, plain["i_gain"] / _FULL_GAIN * 100

    def _offsets(self) -> tuple[float, float]:
        """Return the signals in V with outputs of 0 V: positive on the left, and at the top."""
        return self._beam.power * self._beam.left, self._beam.power * self._beam.top

    def _outputs(self) -> tuple[float, float]:
        """Return the outputs in V."""
        if self._loops:
            now = self.channel.clock.now
            return self._loops[0].output(now), self._loops[1].output(now)
        return self._differences() if self._effective == MONITOR else self._fixed

    def _differences(self) -> tuple[float, float]:
        """Return the difference signals in V: left minus right, and bottom minus top (page 331)."""
        power = self._beam.power
        # In monitor mode, the outputs carry the signals to an instrument and do not steer the beam.
        outputs = (0.0, 0.0) if self._effective == MONITOR else self._outputs()
        x, y = (
            min(max(offset - power / FULL_VOLTS * output, -power), power)
            for offset, output in zip(self._offsets(), outputs, strict=True)
        )
        return x, -y

    # The ports of a KPA101

    def _trigger(self, port: int, what: str) -> int:
        return self.channel.parameter("QUAD_KPATRIGIOCONFIG", f"trig{port}_{what}")

    def _inverted(self, port: int) -> bool:
        return self._trigger(port, "polarity") == _ACTIVE_LOW

    def _port(self, port: int) -> bool:
        percent = self._beam.power / FULL_VOLTS * 100
        within = self._trigger(port, "sum_min") <= percent <= self._trigger(port, "sum_max")
        farthest = max(map(abs, self._differences())) / FULL_VOLTS * 100
        near = farthest < self._trigger(port, "diff_threshold")
        bits = self.channel.parameter("QUAD_KPADIGOUTPUTS", "dig_ops")
        active = {
            0x0A: bool(bits >> port - 1 & 1),
            0x0B: within,
            0x0C: near,
            0x0D: within and near,
        }.get(self._trigger(port, "mode"))
        return self._levels[port - 1] if active is None else active != self._inverted(port)
