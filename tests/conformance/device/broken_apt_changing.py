"""Thorlabs APT controllers that set or move something wrongly, and the kinds of checks that must find it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from apt_runs import Bench, bench, run_on
from faulty_apt_link import (
    Change,
    LinkFault,
    byte,
    dropped,
    every,
    followed_by,
    frame,
    from_the,
    name_of,
    of,
    of_source,
    plus,
    renamed,
    twice,
)

MOVING = 0x10  # in the first byte of the status bits: moving forward
BITS = 16  # offset of the status bits in a motor's status and end messages


@dataclass
class Broken:
    """A defective controller, and the kind of check that must find the defect.

    :param words: texts that the finding must contain, such as the message and the place.
    :param make: makes the fault.
    :param homed: whether it is homed, without the fault, before the run.
    :param strict: whether the broken rule is a must.
    :param before: messages to send before the run.
    """

    kind: str
    unit: str
    words: tuple[str, ...]
    make: Callable[[], LinkFault]
    stage: str | None = None
    homed: bool = False
    strict: bool = True
    before: bytes = b""
    options: dict[str, Any] = field(default_factory=dict)

    def bench(self) -> Bench:
        """Return this controller in its state before the run."""
        on = bench(self.unit, self.stage, **self.options)
        if self.before:
            on.link.write(self.before)
        if self.homed:
            run_on(on, ("home",))
        return on


def told(names: str, change: Change) -> Callable[[], LinkFault]:
    return lambda: LinkFault(to_controller=of(names, change))


def said(names: str, change: Change) -> Callable[[], LinkFault]:
    return lambda: LinkFault(to_host=of(names, change))


def low_word(at: int) -> Change:
    """Keep only the lower two bytes of a number."""
    return lambda raw: raw[: at + 2] + b"\0\0" + raw[at + 4 :]


def always_forward(raw: bytes) -> bytes:
    """Report reverse motion as forward."""
    return with_bit(BITS, MOVING)(without_bit(BITS, 0x20)(raw)) if raw[BITS] & 0x20 else raw


def swapped(first: int, second: int, size: int) -> Change:
    """Exchange two fields."""

    def change(raw: bytes) -> bytes:
        one, other = raw[first : first + size], raw[second : second + size]
        changed = raw[:first] + other + raw[first + size :]
        return changed[:second] + one + changed[second + size :]

    return change


def rounded(at: int, by: int) -> Change:
    return lambda raw: raw[:at] + bytes((raw[at] // by * by,)) + raw[at + 1 :]


def to(address: int) -> Change:
    """Redirect messages for one bay to another."""
    return lambda raw: raw[:4] + bytes((raw[4] & 0x80 | address,)) + raw[5:]


def also_to(address: int) -> Change:
    return lambda raw: raw + to(address)(raw)


def of_dest(address: int, change: Change) -> Change:
    return lambda raw: change(raw) if raw[4] & 0x7F == address else raw


def from_source(address: int) -> Change:
    return byte(5, address)


def backwards(raw: bytes) -> bytes:
    """Invert the direction of a jog or of a move at constant velocity."""
    return raw[:3] + bytes((3 - raw[3],)) + raw[4:]


def longer(raw: bytes) -> bytes:
    """Add two bytes to the packet."""
    return raw[:2] + bytes((raw[2] + 2, 0)) + raw[4:] + b"\1\2"


def without_bit(at: int, mask: int) -> Change:
    return lambda raw: raw[:at] + bytes((raw[at] & ~mask,)) + raw[at + 1 :]


def with_bit(at: int, mask: int) -> Change:
    return lambda raw: raw[:at] + bytes((raw[at] | mask,)) + raw[at + 1 :]


def number(at: int, value: int) -> Change:
    """Replace a number of four bytes."""
    return lambda raw: raw[:at] + value.to_bytes(4, "little", signed=True) + raw[at + 4 :]


def sixteen_bits(at: int) -> Change:
    """Keep only two bytes of a signed number."""

    def change(raw: bytes) -> bytes:
        return number(at, int.from_bytes(raw[at : at + 2], "little", signed=True))(raw)

    return change


def without_sign(raw: bytes) -> bytes:
    """Drop the sign of a voltage."""
    return raw[:8] + abs(int.from_bytes(raw[8:10], "little", signed=True)).to_bytes(2, "little")


def acts_on(change: Change) -> LinkFault:
    """Use other waveform parameters than those reported."""
    told_last = [b""]

    def note(raw: bytes) -> bytes:
        if name_of(raw) == "PZ_SET_OUTPUTLUTPARAMS":
            told_last[0] = raw
            return change(raw)
        return raw

    def answer(raw: bytes) -> bytes:
        if name_of(raw) == "PZ_GET_OUTPUTLUTPARAMS" and told_last[0]:
            return raw[:6] + told_last[0][6:]
        return raw

    return LinkFault(to_host=answer, to_controller=note)


def stops_after_a_cycle() -> LinkFault:
    return acts_on(lambda raw: byte(8, 2)(raw) if raw[8] == 1 else raw)


def without_delay() -> LinkFault:
    """Hold each sample for a tenth of a second, regardless of the parameters."""
    return acts_on(lambda raw: raw[:16] + (99).to_bytes(4, "little") + raw[20:])


def without_rests() -> LinkFault:
    return acts_on(lambda raw: raw[:20] + bytes(8) + raw[28:])


def second_stop_dropped() -> LinkFault:
    """Ignore stops during a relative move."""
    last = [""]

    def note(raw: bytes) -> bytes:
        if name_of(raw).startswith("MOT_MOVE_") and name_of(raw) != "MOT_MOVE_STOP":
            last[0] = name_of(raw)
        unheard = name_of(raw) == "MOT_MOVE_STOP" and last[0] == "MOT_MOVE_RELATIVE"
        return b"" if unheard else raw

    return LinkFault(to_controller=note)


def frozen() -> LinkFault:
    """Repeat the first status of bay 2 in all updates, but answer requests correctly."""
    asked = [False]
    first: list[bytes] = []

    def note(raw: bytes) -> bytes:
        asked[0] = asked[0] or (name_of(raw) == "MOT_REQ_DCSTATUSUPDATE" and raw[4] == 0x22)
        return raw

    def answer(raw: bytes) -> bytes:
        first.append(raw)
        unasked, asked[0] = not asked[0], False
        return first[0] if unasked else raw

    return LinkFault(to_host=of(STATUS, of_source(0x22, answer)), to_controller=note)


STATUS = "MOT_GET_DCSTATUSUPDATE"
DONE = "MOT_MOVE_COMPLETED"

SETTINGS = [
    Broken("readback", "TDC001", ("0x50", "MOT_SET_VELPARAMS did not set acceleration"),
           told("MOT_SET_VELPARAMS", dropped)),
    Broken("readback", "TDC001", ("0x50", "MOT_SET_VELPARAMS wrote the current values", "max_velocity"),
           told("MOT_SET_VELPARAMS", low_word(16)), stage="Z8"),
    Broken("readback", "BBD102", ("0x22", "MOT_SET_JOGPARAMS", "jog_step_size"),
           told("MOT_SET_JOGPARAMS", of_dest(0x22, swapped(10, 18, 4)))),
    Broken("readback", "BPC301", ("0x50", "PZ_SET_PICONSTS", "prop_const"),
           told("PZ_SET_PICONSTS", swapped(8, 10, 2))),
    Broken("readback", "TST001", ("0x50", "MOT_SET_MOVERELPARAMS wrote relative_distance = -"),
           told("MOT_SET_MOVERELPARAMS", low_word(8))),
    Broken("readback", "TSC001", ("0x50", "MOT_SET_AVMODES did not set mode_bits"),
           told("MOT_SET_AVMODES", with_bit(8, 0x0B))),
    Broken("readback", "TDC001", ("MOT_SET_GENMOVEPARAMS", "rounded"),
           told("MOT_SET_GENMOVEPARAMS", rounded(8, 2)), strict=False),
    Broken("readback", "TDC001", ("MOT_GET_GENMOVEPARAMS", "a SET should change its own parameters only"),
           told("MOT_SET_JOGPARAMS", followed_by(bytes.fromhex("3a04 0600 d001 0100 09000000")))),
    Broken("readback", "TDC001", ("not restored", "send MOT_SET_HOMEPARAMS"),
           lambda: LinkFault(to_controller=of("MOT_SET_HOMEPARAMS", from_the(3, dropped)))),
    Broken("readback", "TDC001", ("MOT_GET_VELPARAMS: min_velocity is 1", "always zero"),
           said("MOT_GET_VELPARAMS", byte(8, 1))),
    Broken("readback", "TDC001", ("after MOT_SET_AVMODES", "MOT_GET_AVMODES", "not requested"),
           told("MOT_SET_AVMODES", followed_by(frame("MOT_REQ_AVMODES", 1, 0, 0x50, 1)))),
    Broken("readback", "TDC001", ("after MOT_SET_AVMODES", "HW_RESPONSE", "reports a fault"),
           told("MOT_SET_AVMODES", followed_by(frame("PZ_SET_ZERO", 1, 0, 0x50, 1))), strict=False,
           options={"answer_unsupported": True}),
    Broken("readback", "BPC001", ("no PZ_GET_MAXTRAVEL after PZ_SET_OUTPUTMAXVOLTS", "unsolicited"),
           said("PZ_GET_MAXTRAVEL", dropped)),
    Broken("readback", "BPC001", ("PZ_SET_OUTPUTMAXVOLTS wrote the current values", "flags = 0"),
           lambda: LinkFault(to_host=of("PZ_GET_OUTPUTMAXVOLTS", from_the(2, byte(10, 0))))),
    Broken("counters", "TDC001", ("0x50", "MOT_SET_POSCOUNTER wrote position"),
           told("MOT_SET_POSCOUNTER", dropped)),
    Broken("counters", "BBD102", ("0x21", "MOT_SET_ENCCOUNTER wrote encoder_count"),
           told("MOT_SET_ENCCOUNTER", low_word(8))),
    Broken("counters", "BBD102", ("0x22", "MOT_SET_POSCOUNTER wrote position"),
           told("MOT_SET_POSCOUNTER", of_dest(0x22, sixteen_bits(8)))),
    Broken("readback", "TDC001", ("MOT_SET_MOVEABSPARAMS wrote absolute_position",),
           told("MOT_SET_MOVEABSPARAMS", sixteen_bits(8))),
    Broken("counters", "TDC001", ("MOT_SET_POSCOUNTER wrote position", f"{STATUS} then returned 0"),
           said(STATUS, lambda raw: raw[:8] + bytes(4) + raw[12:])),
    Broken("channels", "BSC002", ("0x50 channel 1", "MOT_SET_VELPARAMS", "unchanged"),
           told("MOT_SET_VELPARAMS", byte(6, 1))),
    Broken("channels", "MPZ601", ("0x21 channel 2", "PZ_SET_IOSETTINGS wrote amp_lp_filter"),
           told("PZ_SET_IOSETTINGS", lambda raw: dropped(raw) if raw[6] == 2 else raw)),
    Broken("bays-apart", "BBD102", ("0x21", "MOT_SET_JOGPARAMS to 0x22", "unchanged"),
           told("MOT_SET_JOGPARAMS", of_dest(0x22, also_to(0x21)))),
    Broken("readback", "TST001", ("MOT_SET_AVMODES did not set mode_bits: it wrote 3",),
           told("MOT_SET_AVMODES", with_bit(8, 0x08))),
    Broken("bays-apart", "BBD103", ("0x21", "MOT_SET_VELPARAMS to 0x23", "unchanged"),
           told("MOT_SET_VELPARAMS", of_dest(0x23, also_to(0x21)))),
    Broken("eeprom", "TST001", ("after MOT_SET_EEPROMPARAMS", "not requested"),
           told("MOT_SET_EEPROMPARAMS", followed_by(frame("MOT_REQ_AVMODES", 1, 0, 0x50, 1)))),
    Broken("eeprom", "BBD102", ("0x22", "MOT_SET_EEPROMPARAMS", "MOT_GET_VELPARAMS returned"),
           told("MOT_SET_EEPROMPARAMS", of_dest(0x22, followed_by(
               bytes.fromhex("1304 0e00 a201 0100 00000000 09000000 09000000"))))),
]  # fmt: skip

OUTPUTS = [
    Broken("loops", "TDC001", ("0x50", "MOT_SET_DCPIDPARAMS did not set"),
           told("MOT_SET_DCPIDPARAMS", dropped)),
    Broken("loops", "BBD103", ("0x22", "MOT_SET_PMDPOSITIONLOOPPARAMS changed only", "integral_limit"),
           told("MOT_SET_PMDPOSITIONLOOPPARAMS", of_dest(0x22, low_word(12)))),
    Broken("enable", "TDC001", ("0x50 channel 1", "MOD_SET_CHANENABLESTATE wrote 2", "then returned 1"),
           told("MOD_SET_CHANENABLESTATE", dropped)),
    Broken("enable", "BBD102", ("0x22 channel 1 is disabled", "MOT_GET_STATUSBITS", "channel_enabled = 1"),
           said("MOT_GET_STATUSBITS", of_source(0x22, with_bit(11, 0x80)))),
    Broken("enable", "BPC301", ("0x50", "PZ_GET_PZSTATUSBITS", "channel_enabled = 0"),
           said("PZ_GET_PZSTATUSBITS", without_bit(11, 0x80))),
    Broken("digital-outputs", "BSC103", ("0x11", "RACK_SET_DIGOUTPUTS switched digital output 4"),
           told("RACK_SET_DIGOUTPUTS", without_bit(2, 0x08))),
    Broken("piezo-volts", "BPC301", ("0x50 channel 1", "PZ_SET_OUTPUTVOLTS", "reports a set value of"),
           told("PZ_SET_OUTPUTVOLTS", dropped)),
    Broken("piezo-volts", "BPC301", ("PZ_SET_OUTPUTVOLTS -", "reports a set value of"),
           told("PZ_SET_OUTPUTVOLTS", without_sign)),
    Broken("piezo-volts", "TPZ001", ("PZ_SET_OUTPUTVOLTS", "PZ_GET_PZSTATUSUPDATE still reports a voltage"),
           said("PZ_GET_PZSTATUSUPDATE", lambda raw: raw[:8] + bytes(2) + raw[10:])),
    Broken("piezo-volts", "BPC103", ("0x22", "PZ_SET_OUTPUTPOS", "should be ignored"),
           told("PZ_SET_OUTPUTPOS", of_dest(0x22, renamed("PZ_SET_OUTPUTVOLTS")))),
    Broken("piezo-position", "BPC301", ("PZ_SET_OUTPUTPOS", "reports a set value of"),
           told("PZ_SET_OUTPUTPOS", dropped)),
    Broken("piezo-position", "BPC301", ("PZ_SET_OUTPUTVOLTS", "in closed loop", "should be ignored"),
           told("PZ_SET_OUTPUTVOLTS", renamed("PZ_SET_OUTPUTPOS"))),
    Broken("piezo-position", "BPC301",
           ("mode CLOSED_LOOP_SMOOTH", "PZ_GET_PZSTATUSUPDATE", "closed_loop = 0"),
           said("PZ_GET_PZSTATUSUPDATE", without_bit(13, 0x04))),
    Broken("piezo-mode", "TPZ001", ("0x50", "PZ_SET_POSCONTROLMODE wrote 3", "then returned 1"),
           told("PZ_SET_POSCONTROLMODE", dropped)),
    Broken("piezo-mode", "BPC103", ("0x23", "PZ_GET_PZSTATUSUPDATE", "closed_loop = 1"),
           said("PZ_GET_PZSTATUSUPDATE", of_source(0x23, with_bit(13, 0x04)))),
    Broken("piezo-lut", "BPC301", ("0x50", "after PZ_START_LUTOUTPUT", "never reached"),
           told("PZ_START_LUTOUTPUT", dropped)),
    Broken("piezo-lut", "TPZ001", ("0x50", "after PZ_STOP_LUTOUTPUT", "still changed"),
           told("PZ_STOP_LUTOUTPUT", dropped)),
    Broken("piezo-lut", "BPC301", ("loaded but not started",),
           told("PZ_SET_OUTPUTLUTPARAMS", followed_by(frame("PZ_START_LUTOUTPUT", 1, 0, 0x50, 1)))),
    Broken("piezo-lut", "BPC301", ("PZ_SET_OUTPUTLUTPARAMS wrote", "no waveform was started"),
           told("PZ_SET_OUTPUTLUTPARAMS", byte(10, 9))),
    Broken("piezo-lut", "BPC301", ("a continuous waveform", "it should continue until PZ_STOP_LUTOUTPUT"),
           stops_after_a_cycle),
    Broken("piezo-lut", "BPC301", ("the first sample of a cycle was output for 0.",), without_rests),
    Broken("piezo-lut", "BPC301", ("each sample of a waveform was output for",), without_delay),
    Broken("piezo-slew", "BPC301", ("with slew_open = 1, the output changed",),
           told("PZ_SET_TPZ_SLEWRATES", dropped)),
    Broken("piezo-zero", "BPC301", ("0x50", "after PZ_SET_ZERO", "does not report zeroed"),
           told("PZ_SET_ZERO", dropped)),
    Broken("piezo-zero", "TSG001", ("0x50", "after PZ_SET_ZERO", "PZ_GET_TSG_READING"),
           said("PZ_GET_TSG_READING", byte(9, 0x20))),
    Broken("solenoid-state", "TSC001", ("0x50", "MOT_SET_SOL_STATE wrote state = 1", "then returned 2"),
           told("MOT_SET_SOL_STATE", dropped)),
    Broken("solenoid-mode", "TSC001", ("MOT_SET_SOL_OPERATINGMODE wrote operating_mode = 4",),
           told("MOT_SET_SOL_OPERATINGMODE", without_bit(3, 0x04))),
    Broken("interlock-mode", "TSC001", ("MOT_SET_SOL_INTERLOCKMODE wrote interlock_mode = 1",),
           told("MOT_SET_SOL_INTERLOCKMODE", dropped),
           before=frame("MOT_SET_SOL_INTERLOCKMODE", 1, 2, 0x50, 1)),
]  # fmt: skip

MOTION = [
    Broken("home", "TDC001", ("0x50 channel 1", "MOT_MOVE_HOME", "sent no MOT_MOVE_HOMED"),
           said("MOT_MOVE_HOMED", dropped), stage="Z8"),
    Broken("home", "TDC001", ("on its way home", "does not report homing"),
           said(STATUS, without_bit(BITS + 1, 0x02)), stage="Z8"),
    Broken("home", "BBD102", ("0x22", "sent MOT_MOVE_HOMED", "does not report homed"),
           said(STATUS, of_source(0x22, without_bit(BITS + 1, 0x04)))),
    Broken("home", "BBD102", ("MOT_MOVE_HOME, 2 end-of-move messages arrived",),
           said("MOT_MOVE_HOMED", of_source(0x21, twice))),
    Broken("move-absolute", "TDC001", ("0x50 channel 1", "MOT_MOVE_ABSOLUTE", f"sent no {DONE}"),
           said(DONE, dropped)),
    Broken("move-absolute", "TDC001", ("0x50", f"2 end-of-move messages arrived ({DONE}"), said(DONE, twice)),
    Broken("move-absolute", "BBD103", ("0x22 channel 1", f"no {DONE}"),
           said(DONE, of_source(0x22, from_source(0x21)))),
    Broken("move-absolute", "TDC001", ("from 0x00", "0x50"), LinkFault, strict=False,
           options={"quirks": {"zero_addresses"}}),
    Broken("move-absolute", "TDC001", (f"{DONE} is for channel 2",), said(DONE, byte(6, 2))),
    Broken("move-absolute", "TDC001", (f"{DONE} after MOT_MOVE_ABSOLUTE", "reports moving_forward"),
           said(DONE, with_bit(BITS, MOVING)), strict=False),
    Broken("move-absolute", "TDC001", ("has ended", f"{STATUS} reports moving_forward"),
           lambda: LinkFault(to_host=of(STATUS, from_the(5, with_bit(BITS, MOVING))))),
    Broken("move-absolute", "TDC001", ("on its way up", f"{STATUS} reports", "forward or in reverse"),
           said(STATUS, without_bit(BITS, MOVING))),
    Broken("move-absolute", "BSC102", ("0x22", "should have gone to"),
           told("MOT_MOVE_ABSOLUTE", of_dest(0x22, plus(9, 3)))),
    Broken("move-absolute", "TDC001", ("instead of MOT_MOVE_COMPLETED",),
           said(DONE, renamed("MOT_MOVE_STOPPED"))),
    Broken("move-absolute", "TDC001", ("is only a header",), LinkFault, strict=False,
           options={"quirks": {"header_only_completion"}}),
    Broken("move-absolute", "BBD102", (DONE, "packet of 16 bytes"), said(DONE, longer), strict=False),
    Broken("move-relative", "TDC001", ("0x50", "MOT_MOVE_RELATIVE", "should have gone to"),
           told("MOT_MOVE_RELATIVE", plus(8, 200))),
    Broken("move-relative", "BBD102", ("0x21", "MOT_MOVE_RELATIVE", f"no {DONE}"),
           told("MOT_MOVE_RELATIVE", of_dest(0x21, dropped))),
    Broken("move-stored", "TDC001", ("MOT_MOVE_ABSOLUTE without a position", f"no {DONE}"),
           told("MOT_MOVE_ABSOLUTE", lambda raw: dropped(raw) if len(raw) == 6 else raw)),
    Broken("move-stored", "TST001", ("MOT_SET_MOVERELPARAMS wrote", "nothing was moved"),
           told("MOT_SET_MOVERELPARAMS", dropped)),
    Broken("move-jog", "TDC001", ("0x50", "MOT_MOVE_JOG forward", "should have gone to"),
           told("MOT_MOVE_JOG", backwards), options={"position": 1_000_000}),
    Broken("move-absolute", "TDC001", ("on its way down", "it should report motion in reverse"),
           said(STATUS, always_forward)),
    Broken("move-absolute", "TDC001", (f"{DONE} reported the position 7", STATUS), said(DONE, number(8, 7))),
    Broken("move-stop", "TDC001", ("MOT_MOVE_STOPPED reported the position 7", STATUS),
           said("MOT_MOVE_STOPPED", number(8, 7))),
    Broken("move-absolute", "BBD102", ("0x22", STATUS, "still reported a velocity of 0"),
           said(STATUS, of_source(0x22, lambda raw: raw[:12] + b"\0\0" + raw[14:])), stage="MLS203"),
    Broken("move-absolute", "BBD102", ("0x21", STATUS, "reports a velocity of 8192", "at rest"),
           said(STATUS, of_source(0x21, lambda raw: raw[:12] + b"\0\x20" + raw[14:])), stage="MLS203"),
    Broken("move-velocity", "TDC001", (STATUS, "still reported a velocity of 0"),
           said(STATUS, lambda raw: raw[:12] + b"\0\0" + raw[14:]), strict=False),
    Broken("move-stop", "TDC001", ("MOT_MOVE_STOP with a profile stopped after",),
           told("MOT_MOVE_STOP", byte(3, 1))),
    Broken("move-updates", "BBD102", ("0x22", STATUS, "the periodic"), frozen),
    Broken("move-updates", "TST001", ("sent no periodic MOT_GET_STATUSUPDATE",),
           told("HW_START_UPDATEMSGS", dropped)),
    Broken("move-jog", "BBD102", ("0x22", "MOT_MOVE_JOG", "it should report jogging"),
           said(STATUS, of_source(0x22, without_bit(BITS, 0xC0)))),
    Broken("move-velocity", "TDC001", ("0x50", "MOT_MOVE_VELOCITY forward", "should have run forward"),
           told("MOT_MOVE_VELOCITY", backwards)),
    Broken("move-velocity", "BBD102", ("0x22", "MOT_MOVE_VELOCITY", "it should have run"),
           told("MOT_MOVE_VELOCITY", of_dest(0x22, dropped))),
    Broken("move-velocity", "TDC001", ("MOT_MOVE_STOP profiled in MOT_MOVE_VELOCITY", "no MOT_MOVE_STOPPED"),
           said("MOT_MOVE_STOPPED", dropped)),
    Broken("home", "TDC001", ("MOT_MOVE_STOP in MOT_MOVE_HOME", "should have slowed down and stopped"),
           told("MOT_MOVE_STOP", dropped), stage="Z8"),
    Broken("move-absolute", "BBD102",
           (f"0x22 channel 1: {DONE}", "a move is complete only when the axis has settled"),
           said(DONE, of_source(0x22, without_bit(BITS + 1, 0x20))), strict=False),
    Broken("move-absolute", "BBD102", ("0x21 channel 1: on its way", "it should be settled only at rest"),
           said(STATUS, of_source(0x21, with_bit(BITS + 1, 0x20)))),
    Broken("move-stop", "TDC001", ("0x50", "in MOT_MOVE_RELATIVE", "should have slowed down and stopped"),
           second_stop_dropped),
    Broken("move-stop", "TDC001", ("0x50", "MOT_MOVE_STOP", "should have slowed down and stopped"),
           told("MOT_MOVE_STOP", dropped)),
    Broken("move-stop", "BBD102", ("0x22", "MOT_MOVE_STOP", "instead of MOT_MOVE_STOPPED"),
           said("MOT_MOVE_STOPPED", of_source(0x22, renamed(DONE)))),
    Broken("suspend", "TDC001", ("0x50", "suspended", f"it sent {DONE}"),
           told("MOT_SUSPEND_ENDOFMOVEMSGS", dropped)),
    Broken("suspend", "BBD102", ("0x22", "resumed", f"no {DONE}"),
           told("MOT_RESUME_ENDOFMOVEMSGS", of_dest(0x22, dropped))),
    Broken("limits", "TDC001", ("0x50", "reverse limit switch as active"),
           said(STATUS, without_bit(BITS, 0x02)), stage="Z8", homed=True),
    Broken("limits", "TST001", ("0x50", "MOT_MOVE_VELOCITY reverse", f"no {DONE}"),
           lambda: LinkFault(to_host=of(DONE, every(3, dropped))), stage="APT_STEPPER", homed=True),
    Broken("limits", "TDC001", ("0x50", "MOT_MOVE_VELOCITY reverse", "it went the other way"),
           told("MOT_MOVE_VELOCITY", backwards), stage="Z8", homed=True),
    Broken("move-alone", "BBD103", ("MOT_MOVE_ABSOLUTE was sent to 0x22 channel 1", "0x21 channel 1 went"),
           told("MOT_MOVE_ABSOLUTE", of_dest(0x22, also_to(0x21)))),
    Broken("move-alone", "MST601", ("0x21 channel 2", "MOT_MOVE_ABSOLUTE"),
           told("MOT_MOVE_ABSOLUTE", byte(6, 1))),
]  # fmt: skip


def name(broken: Broken) -> str:
    return f"{broken.kind}-{broken.unit}-{broken.words[-1][:30]}"
