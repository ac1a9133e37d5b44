"""Firmware with a wrong status: stale, with another layout, or inconsistent with other messages."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from firmware_defects import Change, Defect, Draw, NotHereError, Says, named, of
from firmware_frames import Frame, entry
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

_MOTORS = ("MOT_GET_DCSTATUSUPDATE", "MOT_GET_STATUSUPDATE")
_STATUSES = (*_MOTORS, "PZ_GET_PZSTATUSUPDATE")
_ENDS = ("MOT_MOVE_COMPLETED", "MOT_MOVE_STOPPED")
_ALONE = ("MOT_GET_STATUSBITS", "PZ_GET_PZSTATUSBITS")
_LIMITS = ("forward_hardware_limit", "reverse_hardware_limit")
_MOVING = ("moving_forward", "moving_reverse", "jogging_forward", "jogging_reverse")
_WITH_SWITCHES = ("TDC001", "TST001", "OST001", "ODC001", "BSC002", "BSC102")
_MOVES = (
    "home move-absolute move-relative move-stored move-jog move-velocity move-stop move-updates"
)


def _bits(name: str) -> Mapping[str, int]:
    """Return the bits of a status by name."""
    layout = entry(name)["layouts"][0]
    flags = next(field["flags"] for field in layout["fields"] if field["name"] == "status_bits")
    assert isinstance(flags, dict)
    return flags


def _told(
    seed: int,
    name: str,
    found_by: str,
    change: Callable[[str], Change],
    which: tuple[str, ...] = _MOTORS,
) -> Defect:
    """Return a defect in the status, solicited or not."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        status = draw.one_of(*which)
        return Says(named(status), change(status)), status

    return Defect(seed, name, of(found_by), make)


def _bit_set(*wanted: str) -> Callable[[str], Change]:
    """Return a change that sets bits."""

    def change(status: str) -> Change:
        mask = sum(_bits(status)[name] for name in wanted)
        return lambda frame: [frame.with_("status_bits", frame["status_bits"] | mask)]

    return change


def _stuck(*wanted: str, on: bool) -> Callable[[Draw], tuple[Firmware, str]]:
    """Return a status whose bits never change, in every message that has them."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        status = draw.one_of(*_MOTORS)
        if any(name not in _bits(status) for name in wanted):
            raise NotHereError
        if (
            not on and "channel_enabled" not in wanted
        ):  # a unit without motion never sets the others
            draw.moves()
        mask = sum(_bits(status)[name] for name in wanted)

        def change(frame: Frame) -> list[Frame]:
            if "status_bits" not in frame.fields:
                return [frame]
            bits = frame["status_bits"]
            return [frame.with_("status_bits", bits | mask if on else bits & ~mask)]

        return Says(named(status, *_ENDS, *_ALONE), change), ""

    return make


def _frozen(field: str) -> Callable[[Draw], tuple[Firmware, str]]:
    """Return a status that always repeats its first value while something moves."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.moves()
        status = draw.one_of(*_MOTORS)
        first: dict[tuple[int, int | None], int] = {}

        def again(frame: Frame) -> list[Frame]:
            key = frame.source, frame.channel
            return [frame.with_(field, first.setdefault(key, frame[field]))]

        return Says(named(status), again), status

    return make


def _one_behind(draw: Draw) -> tuple[Firmware, str]:
    """Report the bits of the previous status."""
    draw.moves()
    status = draw.one_of(*_MOTORS)
    last: dict[tuple[int, int | None], int] = {}

    def change(frame: Frame) -> list[Frame]:
        key = frame.source, frame.channel
        before = last.get(key, frame["status_bits"])
        last[key] = frame["status_bits"]
        return [frame.with_("status_bits", before)]

    return Says(named(status), change), ""


def _shifted(status: str) -> Change:
    """Pack the status with a wider field, so that everything after the position is two bytes later."""
    return lambda frame: [frame.patched(12, frame.raw[10:-2] if len(frame.raw) > 12 else b"")]


def _of_the_other_family(draw: Draw) -> tuple[Firmware, str]:
    """Send the status of a stepper instead of that of a servo, or vice versa."""
    status = draw.one_of(*_MOTORS)
    other = _MOTORS[1 - _MOTORS.index(status)]
    return Says(named(status), lambda frame: [frame.renamed(other)]), status


def _at_odds(draw: Draw) -> tuple[Firmware, str]:
    """Report other bits in the message that contains only bits."""
    alone = draw.one_of(*_ALONE)
    mask = 0x400 if alone.startswith("MOT") else 0x11  # homed; actuator connected, zeroed
    return Says(
        named(alone), lambda frame: [frame.with_("status_bits", frame["status_bits"] ^ mask)]
    ), alone


def _other_position(draw: Draw) -> tuple[Firmware, str]:
    counter = draw.one_of("MOT_GET_POSCOUNTER")
    return Says(
        named(counter), lambda frame: [frame.with_("position", frame["position"] + 1000)]
    ), counter


def _channel_zero(status: str) -> Change:
    return lambda frame: [frame.with_("chan_ident", 0)]


STATUS = (
    Defect(1, "Both limit bits are stuck on", of("status"), _stuck(*_LIMITS, on=True),
           result=Result.NON_STRICT),
    _told(1, "The status reports motion in both directions", "status", _bit_set(*_MOVING[:2])),
    Defect(3, "The moving bit is stuck on", of("status"), _stuck("moving_forward", on=True)),
    Defect(7, "The moving bits are never set", of(_MOVES), _stuck(*_MOVING, on=False)),
    Defect(1, "The homed bit is never set", of("home"), _stuck("homed", on=False)),
    Defect(7, "The homing bit is never set", of("home"), _stuck("homing", on=False)),
    Defect(2, "The limit bits are never set", of("limits"), _stuck(*_LIMITS, on=False), _WITH_SWITCHES),
    Defect(15, "The enabled bit is never set", of("enabled-bit enable"), _stuck("channel_enabled", on=False)),
    Defect(1, "The position in the status is stale", of("status counters"), _frozen("position")),
    Defect(1, "The bits in the status are stale", of(f"status {_MOVES}"), _frozen("status_bits")),
    Defect(1, "The status is one behind", of(f"status {_MOVES}"), _one_behind),
    _told(10, "A field of the status has another width", f"status answers {_MOVES}", _shifted),
    Defect(1, "The status is that of another family", of("status answers"), _of_the_other_family),
    _told(1, "The status is about channel 0", "status answers updates", _channel_zero, _STATUSES),
    Defect(1, "Two messages report different status bits", of("status"), _at_odds),
    Defect(1, "Counter and status report different positions", of("status"), _other_position),
)  # fmt: skip
