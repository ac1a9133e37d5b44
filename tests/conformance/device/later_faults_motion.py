"""Faults in moves, ends of moves, status and keep-alive of the controllers of Issue 37."""

from __future__ import annotations

from collections.abc import Callable

from later_faults import (
    Change,
    F,
    LinkFault,
    byte,
    dropped,
    followed_by,
    frame,
    long,
    name_of,
    of,
    plus,
    says,
    scaled,
    shorter,
    takes,
    twice,
    word,
)

_STATUS, _DC = "MOT_GET_STATUSUPDATE", "MOT_GET_DCSTATUSUPDATE"
_BITS, _ENDS = "MOT_GET_STATUSBITS", "MOT_MOVE_COMPLETED MOT_MOVE_STOPPED"
_JOG, _DONE, _HOMED = "MOT_MOVE_JOG", "MOT_MOVE_COMPLETED", "MOT_MOVE_HOMED"
_REQUEST = frame("HW_REQ_INFO", dest=0x50, source=1)
_ALL_BITS = f"{_STATUS} {_DC} {_BITS} {_ENDS}"
_FLIP, _TIME = ("flipper",), ("flipper-time",)
_ABSOLUTE = ("home", "move-absolute")


def without(at: int, mask: int) -> Change:
    """Clear bits of a byte."""
    return lambda raw: byte(at, raw[at] & ~mask)(raw) if len(raw) > at else raw


def with_bits(at: int, mask: int) -> Change:
    """Set bits of a byte."""
    return lambda raw: byte(at, raw[at] | mask)(raw) if len(raw) > at else raw


def bits(more: int, less: int) -> Change:
    """Set and clear status bits in every message that has them."""

    def change(raw: bytes) -> bytes:
        at = 8 if name_of(raw) == _BITS else 16
        if len(raw) < at + 4:
            return raw
        present = int.from_bytes(raw[at : at + 4], "little")
        return raw[:at] + (present & ~less | more).to_bytes(4, "little") + raw[at + 4 :]

    return change


def other_value(set_name: str, at: int, factor: float) -> Callable[[], LinkFault]:
    """Act on another value than the one that is reported."""

    def make() -> LinkFault:
        told: list[bytes] = []

        def note(raw: bytes) -> bytes:
            if name_of(raw) != set_name:
                return raw
            told[:] = [raw]
            return scaled(at, factor)(raw)

        def answer(raw: bytes) -> bytes:
            if told and name_of(raw) == set_name.replace("_SET_", "_GET_"):
                return raw[:at] + told[0][at : at + 4] + raw[at + 4 :]
            return raw

        return LinkFault(to_host=answer, to_controller=note)

    return make


def toggles() -> LinkFault:
    """Move to the other position with each jog, whatever its direction."""
    number = [0]

    def change(raw: bytes) -> bytes:
        number[0] += 1
        return byte(3, 1 + number[0] % 2)(raw)

    return LinkFault(to_controller=of(_JOG, change))


def moves_again() -> LinkFault:
    """Leave the position for a while when a jog goes to the present position."""
    last, left = [0], [0]

    def jog(raw: bytes) -> bytes:
        left[0] = 10 if raw[3] == last[0] else left[0]
        last[0] = raw[3]
        return raw

    def show(raw: bytes) -> bytes:
        left[0] = max(0, left[0] - 1)
        return without(8, 3)(raw) if left[0] else raw

    return LinkFault(of(_BITS, show), of(_JOG, jog))


def after(event: str, names: str, change: Change) -> Callable[[], LinkFault]:
    """Change messages from the controller after one of them has been sent."""

    def make() -> LinkFault:
        seen = [False]

        def answer(raw: bytes) -> bytes:
            seen[0] = seen[0] or name_of(raw) == event
            return change(raw) if seen[0] and name_of(raw) in names.split() else raw

        return LinkFault(to_host=answer)

    return make


def silent_after(count: int) -> Callable[[], LinkFault]:
    """Send nothing after some messages, whether or not keep-alive messages arrive."""

    def make() -> LinkFault:
        left = [count]

        def answer(raw: bytes) -> bytes:
            left[0] -= name_of(raw) in (_STATUS, _DC)
            return raw if left[0] > 0 or name_of(raw) not in (_STATUS, _DC) else b""

        return LinkFault(to_host=answer)

    return make


def jog_answered(raw: bytes) -> bytes:
    """Report the end of a jog when the next status is sent."""
    return frame(_DONE, 1) + raw


MOTION = (
    # flippers
    F("A jog of a flipper is ignored",
      "MFF101", takes(_JOG, dropped), _FLIP, "flipper-positions"),
    F("A flipper always goes to the first position",
      "MFF101", takes(_JOG, byte(3, 1)), _FLIP, "flipper-positions"),
    F("A flipper goes to the second position only",
      "MFF102", takes(_JOG, byte(3, 2)), _FLIP, "flipper-positions"),
    F("Each jog moves a flipper to the other position",
      "MFF101", toggles, _FLIP, "flipper-positions"),
    F("A flipper moves again when it is jogged to its present position",
      "MFF101", moves_again, _FLIP, "flipper-positions"),
    F("A flipper shows both positions",
      "MFF101", says(_BITS, with_bits(8, 3)), _FLIP, "flipper-position-bits"),
    F("A flipper shows no position",
      "MFF102", says(_BITS, without(8, 3)), _FLIP, "flipper-position-bits"),
    F("A flipper shows its target during a move",
      "MFF101", says(_BITS, lambda raw: byte(8, {0x10: 1, 0x20: 2}.get(raw[8], raw[8]))(raw)), _FLIP,
      "flipper-position-bits"),
    F("A flipper reports the end of a jog",
      "MFF101", says(_BITS, jog_answered), _FLIP, "flipper-reports-no-end"),
    F("The transit time is ignored",
      "MFF101", other_value("MOT_SET_MFF_OPERPARAMS", 8, 0.65), _TIME, "flipper-transit-time"),
    F("The transit time is taken twice",
      "MFF102", other_value("MOT_SET_MFF_OPERPARAMS", 8, 2), _TIME, "flipper-transit-time"),
    F("The transit time in counts is 0",
      "MFF101", says("MOT_GET_MFF_OPERPARAMS", long(12, 0)), _TIME, "flipper-transit-counts"),
    # ends of motions
    F("The end of a move has 13 bytes of data",
      "KDC101", says(_ENDS, shorter), _ABSOLUTE, "data-length-bytes"),
    F("The end of a move is not reported",
      "MLJ050", says(_DONE, dropped), _ABSOLUTE, "absolute-move-completed"),
    F("The end of a move is reported twice",
      "K10CR1", says(_DONE, twice), _ABSOLUTE, "absolute-move-completed"),
    F("A stop is not reported",
      "KST101", says("MOT_MOVE_STOPPED", dropped), ("home", "move-stop"), "stop-completed"),
    F("The end of homing is not reported",
      "LTS150", says(_HOMED, dropped), ("home",), "home-completed"),
    F("The end of homing has the channel of no axis",
      "KBD101", says(_HOMED, byte(2, 0)), ("home",), "motor-single-channel"),
    F("The end of a move has the position 0",
      "KST201", says(_DONE, long(8, 0)), _ABSOLUTE, "move-completed-status"),
    # homing
    F("Homing is ignored",
      "KDC101", takes("MOT_MOVE_HOME", dropped), ("home",), "home-completed"),
    F("Homing ends at the index, not at 0",
      "KBD101", after(_HOMED, f"{_DC} MOT_GET_POSCOUNTER", plus(9, 8)), ("home",),
      "position-after-homing"),
    F("Homing ends at the switch, not at the offset",
      "LTS300", after(_HOMED, f"{_STATUS} MOT_GET_POSCOUNTER", plus(9, 64)), ("home",),
      "position-after-homing"),
    F("The homed bit is never set",
      "KDC101", says(_ALL_BITS, bits(0, 0x400)), ("home",), "dc-status-bits-motion"),
    # moves
    F("Stops are ignored",
      "KST101", takes("MOT_MOVE_STOP", dropped), ("home", "move-stop"), "stop-any-move"),
    F("A relative move goes the other way",
      "K10CR1", takes("MOT_MOVE_RELATIVE", scaled(8, -1)), ("home", "move-relative"), "relative-move"),
    F("A target has sixteen bits",
      "KST201", takes("MOT_MOVE_ABSOLUTE", lambda raw: raw[:10] + b"\0\0" + raw[12:]), _ABSOLUTE,
      "absolute-move-long"),
    F("Targets are in 128 microsteps",
      "LTS150", takes("MOT_MOVE_ABSOLUTE MOT_MOVE_RELATIVE", scaled(8, 16 / 15)), _ABSOLUTE,
      "absolute-move"),
    F("Moves are at a sixteenth of the velocity",
      "K10CR1", other_value("MOT_SET_VELPARAMS", 16, 1 / 16), ("home", "profile"), "velocity-parameters"),
    F("Jogs ignore their direction",
      "KST101", takes(_JOG, byte(3, 1)), ("home", "move-jog"), "jog-direction-values"),
    F("A move of the second bay moves the first one",
      "BSC203", takes("MOT_MOVE_ABSOLUTE", lambda raw: byte(4, 0xA1)(raw) if raw[4] == 0xA2 else raw),
      ("home", "move-absolute"), "absolute-move"),
    # status
    F("The limit switches are always active",
      "KST101", says(_ALL_BITS, bits(3, 0)), ("status",), "status-bits-limits"),
    F("A motor at rest is reported as moving",
      "LTS150", says(_ALL_BITS, bits(0x10, 0)), ("status",), "status-bits-motion"),
    F("The enabled bit is inverted",
      "KDC101", says(_ALL_BITS, bits(0, 0x8000_0000)), ("status", "enable"), "dc-status-bit-enabled"),
    F("The status has the position of the encoder",
      "BSC201", says(_STATUS, long(8, 12345)), ("status",), "status-position"),
    F("The velocity at rest is not 0",
      "KBD101", says(_DC, word(12, 500)), ("status",), "dc-status-velocity"),
    # updates and keep-alive
    F("Updates end although keep-alive messages arrive",
      "KDC101", silent_after(60), ("updates", "keep-alive"), "updates-until-stop"),
    F("Updates cannot be stopped",
      "KST101", takes("HW_STOP_UPDATEMSGS", dropped), ("updates",), "updates-stop"),
    F("Updates do not begin",
      "TBD001", takes("HW_START_UPDATEMSGS", dropped), ("updates",), "updates-start"),
    F("Keep-alive messages are answered",
      "KBD101", takes("MOT_ACK_DCSTATUSUPDATE", followed_by(_REQUEST)), ("keep-alive-reply",),
      "keep-alive-no-response"),
    # outputs
    F("A channel cannot be disabled",
      "BBD302", takes("MOD_SET_CHANENABLESTATE", byte(3, 1)), ("enable",), "channel-enable"),
    F("The solenoid stays closed",
      "KSC101", takes("MOT_SET_SOL_STATE", byte(3, 2)), ("solenoid-state",), "solenoid-state"),
    F("The solenoid has one mode",
      "KSC101", takes("MOT_SET_SOL_OPERATINGMODE", byte(3, 1)), ("solenoid-mode",), "solenoid-mode"),
    F("A cycle of the solenoid is in microseconds",
      "KSC101", takes("MOT_SET_SOL_CYCLEPARAMS", scaled(8, 1.001)), ("readback",), "solenoid-cycle"),
)  # fmt: skip
"""Faults of moves, reports and outputs."""
