"""A NanoTrak: its modes, readings, status and trigger ports (pages 248 to 294 of Issue 37)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from stagewire import Frame
from stagewire.devices import number_of, pattern_of
from stagewire_virtual.thorlabs_apt.channel import (
    Behaviour,
    Channel,
    LiveState,
    handles,
    live,
    stored,
)
from stagewire_virtual.thorlabs_apt.nanotrak.signal import (
    COUNTS,
    OVER_READ,
    TIA,
    UNDER_READ,
    Amplifier,
    Spot,
    seeded_spot,
)
from stagewire_virtual.thorlabs_apt.nanotrak.tracker import Scan, Tracker
from stagewire_virtual.thorlabs_apt.status_bits import StatusBits

_PIEZO, _LATCH = 1, 2  # modes (page 249) and states (page 250)
_AXES: Final[Mapping[int, tuple[bool, bool]]] = {
    3: (True, True),
    4: (True, False),
    5: (False, True),
}
_FIRST_TRACKING_MODE = 3
_NO_SIGNAL, _SIGNAL = 3, 4  # states of tracking
_CLOSED_LOOP_MODES = (2, 4)  # page 94
_FULL_SHARE = 32767  # page 254
_EXTERNAL_5V = 4
_KNA101 = "KNA101"
_INPUT_TRACK, _INPUT_HOME, _OUTPUT_LOGIC, _OUTPUT_TRACKING = 2, 3, 0x0A, 0x0B  # page 285
_ACTIVE_LOW = 2  # page 286

_DEFAULTS: Final[Mapping[str, Mapping[str, int]]] = {
    "PZ_NTTRACKTHRESHOLD": {"threshold_abs_reading": pattern_of(1e-6, 4)},
    "PZ_NTCIRCHOMEPOS": {"circ_home_pos_a": 32767, "circ_home_pos_b": 32767},
    "PZ_NTCIRCPARAMS": {
        "circ_dia_mode": 1,
        "circ_dia_sw": 6554,
        "circ_osc_freq": 160,
        "abs_pwr_min_circ_dia": 3276,
        "abs_pwr_max_circ_dia": 6553,
        "abs_pwr_adjust_type": 1,
    },
    "PZ_NTCIRCDIALUT": {
        f"lut_val_{number}": max(0, 13108 - 656 * (number - 3)) if number > 2 else 0
        for number in range(1, 17)
    },
    "PZ_NTTIARANGEPARAMS": {
        "range_mode": 1,
        "range_up_limit": 850,
        "range_down_limit": 150,
        "settle_samples": 4,
        "range_change_type": 1,
        "range_sw": 5,
    },
    "PZ_NTGAINPARAMS": {"nt_gain_sw": 600},
    "PZ_PICONSTS": {"prop_const": 100, "int_const": 15},
    "KNA_KCUBEMMIPARAMS": {"wheel_step": 2, "disp_brightness": 50},
    "KNA_KCUBETRIGIOCONFIG": {"t1_polarity": 1, "t2_polarity": 1},
    "NT_TNA_DISPSETTINGS": {"disp_intensity": 100},
    "NT_TNAIOSETTINGS": {"lv_out_range": 2, "lv_out_route": 1},
}
"""The parameters of a new unit: those of the examples, except the threshold, phases and ports."""


class _Core:
    """The parts that the channels of a unit share.

    :param channel: the first channel, which has the parameters.
    """

    def __init__(self, channel: Channel) -> None:
        self.amplifier = Amplifier(channel.unit)
        self.tracker = Tracker(
            channel.clock, self.amplifier, seeded_spot(channel.random), channel.parameter
        )
        self.scan = Scan(channel, self.amplifier, self.tracker)
        self.piezo = False
        self.piezo_next = False  # takes effect after a restart (page 249)
        self.tracks = _FIRST_TRACKING_MODE  # the last mode that tracked
        self.levels = [False, False]  # of the ports IO1 and IO2
        self.channels: list[Channel] = []


class NanoTrak(Behaviour):
    """A channel of a NanoTrak. The two channels of a KNA101 share the circle, the signal and the modes.

    The unit starts latched in the middle of the range. While it tracks, each revolution of the circle takes
    the centre nearer to the spot, by a share of the distance: 0.2 · diameter in NanoTrak units · gain / 600.
    With the defaults, 43.75 revolutions a second, the distance is divided by 100 in 21 of them, 0.48 s. A
    share above 1 overshoots, and above 2 the circle never settles. Below 1 nA, or beyond the range, it does
    not move.

    :param channel: its channel.
    """

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        first: Any = channel.first.behaviour
        self._leads = first is self
        self._core: _Core = _Core(channel) if self._leads else first._core
        self._core.channels.append(channel)
        self._bits = StatusBits(channel.unit, "PZ_GET_NTSTATUSUPDATE")
        if self._leads:
            self.power_on()

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, int]]:
        """Return the parameters of a new unit."""
        return _DEFAULTS

    # For tests

    @property
    def spot(self) -> Spot:
        """The light, which the user can move or replace; a new unit has it at a place from its seed."""
        return self._core.tracker.spot

    @spot.setter
    def spot(self, spot: Spot) -> None:
        self._core.tracker.spot = spot

    @property
    def position(self) -> tuple[float, float]:
        """The centre of the circle in NanoTrak units, horizontal and vertical."""
        return self._core.tracker.position

    @property
    def outputs(self) -> tuple[bool, bool]:
        """The levels of the ports IO1 and IO2 of a KNA101, True for high; inputs are as they were set."""
        one, two = (self._output(port) for port in (1, 2))
        return one, two

    def set_input(self, port: int, level: bool) -> None:
        """Set the level of port 1 or 2 of a KNA101; an edge to the active level is a trigger (page 285)."""
        before, self._core.levels[port - 1] = self._core.levels[port - 1], level
        if level == before or level == self._inverted(port):
            return
        mode = self._io(port, "mode")
        if mode == _INPUT_TRACK and not self._core.piezo:
            self._set_mode(_FIRST_TRACKING_MODE)
        elif mode == _INPUT_HOME and not self._core.piezo:
            self._go_home()

    # The host

    def power_on(self) -> None:
        """Reset to the power-on state: latched, or a piezo amplifier if that mode was set before."""
        if not self._leads:
            return
        core = self._core
        core.piezo = core.piezo_next
        core.scan.stop()
        core.tracks = _FIRST_TRACKING_MODE
        core.amplifier.configure(self.channel.parameters["PZ_NTTIARANGEPARAMS"], power_on=True)
        core.tracker.reset()

    def refusal(self, frame: Frame) -> str | None:
        """Return why a SET cannot be stored; the circle first takes its steps with the old values."""
        self._core.tracker.catch_up()
        message: Any = frame.message
        if not self._leads:
            return None
        match message.layout.message:
            case "PZ_SET_NTCIRCPARAMS" if not message.circ_osc_freq or message.circ_osc_freq % 4:
                return "circ_osc_freq must be a multiple of 4 (page 257)"
            case "PZ_SET_NTTIARANGEPARAMS" if message.range_sw not in self._core.amplifier.ranges:
                return f"the unit does not have range {message.range_sw} (page 265)"
            case "PZ_SET_NTFEEDBACKSRC" if (
                self.channel.unit.name == _KNA101
                and message.feedback_src not in (TIA, _EXTERNAL_5V)
            ):
                return f"a KNA101 does not have input {message.feedback_src} (page 272)"
        return None

    @handles("PZ_SET_NTMODE")
    def set_mode(self, frame: Frame) -> None:
        """Track, latch, or become a piezo amplifier after the next restart (page 249)."""
        message: Any = frame.message
        core, mode = self._core, message.state
        if not self._leads:
            return
        if mode == _PIEZO:
            core.piezo_next = True
        elif mode not in (_LATCH, *_AXES):
            self.channel.report_fault(frame, f"unknown mode {mode}")
        else:
            core.piezo_next = False
            if core.piezo:
                self.channel.report_fault(frame, "the mode changes at the next restart")
            else:
                self._set_mode(mode)

    @handles("PZ_MOVE_NTCIRCTOHOMEPOS")
    def move_home(self, frame: Frame) -> None:
        """Move the circle to its home position (page 253)."""
        if not self._leads:
            return
        if self._core.piezo:
            self.channel.report_fault(frame, "the unit is a piezo amplifier")
        else:
            self._go_home()

    @handles("KNA_REQ_XYSCAN")
    def start_scan(self, frame: Frame) -> None:
        """Start a scan (page 288)."""
        if not self._leads:
            return
        if self._core.piezo:
            self._core.scan.start(frame)
        else:
            self.channel.report_fault(frame, "a scan needs piezo mode")

    @handles("KNA_STOP_XYSCAN")
    def stop_scan(self, frame: Frame) -> None:
        """Stop the scan."""
        self._core.scan.stop()

    @handles("MOT_SET_PZSTAGEPARAMDEFAULTS")
    def restore_defaults(self, frame: Frame) -> None:
        """Restore all parameters from the EEPROM."""
        self._core.tracker.catch_up()
        self.channel.restore()
        if self._leads:
            self.range_was_set(frame)

    @stored("PZ_NTTIARANGEPARAMS")
    def range_was_set(self, frame: Frame) -> None:
        """Change the range, or start or stop to follow the signal."""
        if self._leads:
            self._core.amplifier.configure(self.channel.parameters["PZ_NTTIARANGEPARAMS"])
            self._core.tracker.changed()

    @stored("PZ_NTCIRCDIA")
    def diameter_was_set(self, frame: Frame) -> None:
        """Set the fixed diameter, which PZ_NTCIRCPARAMS also has (page 259)."""
        message: Any = frame.message
        diameter = message.circ_dia + 256 * message.circ_dia_high
        self.channel.parameters["PZ_NTCIRCPARAMS"]["circ_dia_sw"] = diameter

    @live("PZ_NTMODE")
    def mode(self) -> dict[str, int]:
        """Return the state and the axes of the present or last tracking (page 250)."""
        return {"state": self._state, "mode": self._core.tracks - _FIRST_TRACKING_MODE + 1}

    @live("PZ_NTTIAREADING")
    def reading(self) -> dict[str, int]:
        """Return the signal (page 270)."""
        now = self._core.tracker.read()
        return {
            "abs_reading": pattern_of(now.absolute, 4),
            "rel_reading": round(now.share * _FULL_SHARE),
            "range": self._core.amplifier.range,
            "under_over_read": now.check,
        }

    @live("PZ_NTCIRCCENTREPOS")
    def circle(self) -> dict[str, int]:
        """Return the position of the circle, and the signal (page 254)."""
        a, b = self.position
        return {
            "circ_pos_a": round(a * COUNTS),
            "circ_pos_b": round(b * COUNTS),
            **self.reading(),
        }

    @live("PZ_NTSTATUSBITS")
    def status_bits(self) -> dict[str, int]:
        """Return the status bits (pages 274 and 275)."""
        core, check = self._core, self._core.tracker.read().check
        horizontal, vertical = core.tracker.axes
        named = {
            "tracking": horizontal or vertical,
            "tracking_with_signal": self._state == _SIGNAL,
            "tracking_channel_a": horizontal and not vertical,
            "tracking_channel_b": vertical and not horizontal,
            "auto_ranging": core.amplifier.automatic,
            "under_read": check == UNDER_READ,
            "over_read": check == OVER_READ,
            "channel_a_closed_loop": _closed_loop(core.channels[0]),
            "channel_b_closed_loop": _closed_loop(core.channels[-1]),
        }
        always = (
            *(f"channel_{axis}_{what}" for axis in "ab" for what in ("connected", "enabled")),
            "active",
            "channel_enabled",
        )
        return {"status_bits": self._bits.value({**dict.fromkeys(always, True), **named})}

    def status(self) -> Mapping[str, int]:
        """Return the present status message (page 276)."""
        values = self.channel.first.parameters
        diameter = round(self._core.tracker.diameter * COUNTS)
        return {
            **self.circle(),
            **self.status_bits(),
            "circ_dia": diameter,
            "nt_gain": values["PZ_NTGAINPARAMS"]["nt_gain_sw"],
            "phase_comp_a": values["PZ_NTPHASECOMPPARAMS"]["phase_comp_asw"],
            "phase_comp_b": values["PZ_NTPHASECOMPPARAMS"]["phase_comp_bsw"],
        }

    def row(self) -> LiveState:
        """Return the position of the circle and the state."""
        a, b = self.position
        states = {_PIEZO: "piezo", _LATCH: "latched", _NO_SIGNAL: "no signal", _SIGNAL: "tracking"}
        state = "scanning" if self._core.scan.runs else states[self._state]
        return LiveState(f"{a:.3f}, {b:.3f} NT", state)

    @property
    def _state(self) -> int:
        core = self._core
        if core.piezo:
            return _PIEZO
        if not any(core.tracker.axes):
            return _LATCH
        bits = self.channel.first.parameter("PZ_NTTRACKTHRESHOLD", "threshold_abs_reading")
        threshold = number_of(bits, 4)
        # With an external voltage the indicator does not work (page 272).
        source = self.channel.first.parameter("PZ_NTFEEDBACKSRC", "feedback_src")
        above = source == TIA and core.tracker.read().absolute > threshold
        return _SIGNAL if above else _NO_SIGNAL

    def _set_mode(self, mode: int) -> None:
        if mode in _AXES:
            self._core.tracks = mode
        self._core.tracker.track(*_AXES.get(mode, (False, False)))

    def _go_home(self) -> None:
        home = self.channel.parameters["PZ_NTCIRCHOMEPOS"]
        self._core.tracker.go(home["circ_home_pos_a"] / COUNTS, home["circ_home_pos_b"] / COUNTS)

    def _io(self, port: int, what: str) -> int:
        return self.channel.first.parameter("KNA_KCUBETRIGIOCONFIG", f"t{port}_{what}")

    def _inverted(self, port: int) -> bool:
        return self._io(port, "polarity") == _ACTIVE_LOW

    def _output(self, port: int) -> bool:
        outputs = self.channel.first.parameter("MOD_DIGOUTPUTS", "bit")
        active = {
            _OUTPUT_LOGIC: bool(outputs >> port - 1 & 1),
            _OUTPUT_TRACKING: any(self._core.tracker.axes),
        }.get(self._io(port, "mode"))
        return self._core.levels[port - 1] if active is None else active != self._inverted(port)


def _closed_loop(channel: Channel) -> bool:
    return channel.parameter("PZ_POSCONTROLMODE", "mode") in _CLOSED_LOOP_MODES
