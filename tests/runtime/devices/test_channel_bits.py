"""Controllers that name channels by bits: no call moves a channel other than the one that was named."""

from __future__ import annotations

import inspect
import re
from contextlib import suppress
from typing import Any

import pytest
from inertial_controller import InertialController, channel_of, controller, moves

from stagewire.errors import BadValueError, OutOfRangeError, StagewireError, UnsupportedError
from stagewire_apt import devices
from stagewire_apt import enumerations as e
from stagewire_virtual.linking import SteppedLink

BITS = {1: 0x01, 2: 0x02, 3: 0x04, 4: 0x08}
UNITS = ("KIM101", "TIM101", "MPC320", "MPC220")
OF_THE_LIBRARY = frozenset(
    {
        "record",
        "restore",
        "scales",
        "session",
        "shows_motion",
        "subscribe",
        "travel",
        "values",
        "wait_for",
    }
)
"""Members of every channel that belong to the library, or that only read."""


def members(unit: str) -> list[str]:
    """Return the calls of a channel of a unit."""
    cls: Any = getattr(devices, unit).channel_class
    names = [name for name in dir(cls) if not name.startswith("_") and name not in OF_THE_LIBRARY]
    return [name for name in names if callable(getattr(cls, name))]


IN_UNITS = re.compile(r"(^|_)(mm|deg|volts|percent|us)$")
"""Names of arguments in a unit; each is an alternative to one in counts."""
UNSUPPORTED = ("apply_stage_defaults", "disable", "enable", "is_enabled", "is_homed", "is_moving")
"""Calls that may raise UnsupportedError before anything is sent."""

CALLS = [(unit, number, name) for unit in UNITS for name in members(unit) for number in BITS
         if number <= getattr(devices, unit).unit.channels]  # fmt: skip


def arguments(call: Any) -> dict[str, Any]:
    """Return an argument for each parameter but those in units: the smallest value that is usually valid."""
    names = [name for name in inspect.signature(call).parameters if name != "timeout"]
    return {name: 100 if "volt" in name else 1 for name in names if not IN_UNITS.search(name)}


def opened(unit: str, enabled: int = 1) -> tuple[Any, InertialController]:
    """Return an open controller whose channel with this number is enabled, and its instrument."""
    line, instrument = controller(unit)
    rating = {} if unit.startswith("MPC") else {"max_volts": 125}
    device = getattr(devices, unit).open(SteppedLink(line), line="usb", **rating)
    if unit == "KIM101":
        device.set_kcube_chan_enable_mode(mode=enabled)
    return device, instrument


@pytest.mark.parametrize(("unit", "number", "name"), CALLS)
def test_a_call_names_only_its_channel(unit: str, number: int, name: str) -> None:
    device, instrument = opened(unit, number)
    with device:
        instrument.frames.clear()
        call = getattr(device.channel(number), name)
        with suppress(StagewireError):  # only what was sent matters here
            call(**arguments(call))
        named = {channel_of(frame) for frame in instrument.frames} - {None}
        assert named == {BITS[number]} or (name in UNSUPPORTED and not named)
        assert set(instrument.moved) <= {BITS[number]}
    assert {channel_of(frame) for frame in instrument.frames} - {None} <= {BITS[number]}


@pytest.mark.parametrize("unit", UNITS)
def test_every_motion_of_a_channel_was_sent_to_it(unit: str) -> None:
    """All motion messages of the unit have a call, and the call moves the channel."""
    wanted = {
        "KIM101": {0x08D3, 0x08D4, 0x08D5, 0x08D9}, "TIM101": {0x08D4, 0x08D9},
        "MPC320": {0x0443, 0x0453, 0x046A}, "MPC220": {0x0443, 0x0453, 0x046A},
    }[unit]  # fmt: skip
    last = getattr(devices, unit).unit.channels
    sent: set[int] = set()
    for name in members(unit):
        if not name.startswith("start_"):
            continue
        device, instrument = opened(unit, last)
        with device:
            call = getattr(device.channel(last), name)
            call(**arguments(call)).wait(timeout=1) if "velocity" not in name else call(
                **arguments(call)
            )
            assert instrument.moved == [BITS[last]], name
            sent |= {int.from_bytes(f[:2], "little") for f in instrument.frames if moves(f)}
    assert sent == wanted


@pytest.mark.parametrize("unit", UNITS)
def test_the_device_itself_starts_no_motion(unit: str) -> None:
    cls: Any = getattr(devices, unit)
    own = [name for name in dir(cls) if name.startswith(("move", "jog", "home", "start_"))]
    assert own == ["start_updates"], "a stop of all channels is the only other call"


@pytest.mark.parametrize(("number", "bit"), BITS.items())
def test_a_jog_has_the_bit_of_the_channel_and_not_its_number(number: int, bit: int) -> None:
    device, instrument = opened("KIM101", number)
    with device:
        instrument.frames.clear()
        device.channel(number).jog("FORWARD")
        assert instrument.frames[-1] == bytes((0xD9, 0x08, bit, 0x01, 0x50, 0x01))


@pytest.mark.parametrize(("number", "bit"), BITS.items())
def test_closing_stops_the_channel_that_moves(number: int, bit: int) -> None:
    device, instrument = opened("KIM101", number)
    with device:
        instrument.ends = False
        device.channel(number).start_move_absolute(counts=100)
        instrument.frames.clear()
    assert bytes((0xD7, 0x08, bit, 0x00, 0x50, 0x01)) in instrument.frames
    assert {channel_of(frame) for frame in instrument.frames} - {None} == {bit}


@pytest.mark.parametrize(("unit", "id"), [("KIM101", 0x08D7), ("TIM101", 0x0465)])
def test_a_move_of_both_controllers_is_stopped_by_a_message_that_the_controller_has(
    unit: str, id: int
) -> None:
    device, instrument = opened(unit, 2)
    with device:
        instrument.ends = False
        device.channel(2).start_move_absolute(counts=100)
        instrument.frames.clear()
    stops = [frame for frame in instrument.frames if channel_of(frame) is not None]
    assert [int.from_bytes(frame[:2], "little") for frame in stops] == [id]


@pytest.mark.parametrize(("unit", "id"), [("KIM101", 0x08D7), ("TIM101", 0x0465)])
@pytest.mark.parametrize(("number", "bit"), BITS.items())
def test_the_call_that_stops_a_channel(unit: str, id: int, number: int, bit: int) -> None:
    """A KIM101 has one call, with the message that the vendor's software sends."""
    device, instrument = opened(unit)
    with device:
        instrument.frames.clear()
        device.channel(number).stop()
        [sent] = instrument.frames
        assert (int.from_bytes(sent[:2], "little"), sent[2]) == (id, bit)
    stops = [name for name in members(unit) if "stop" in name]
    assert stops == ["stop"]


@pytest.mark.parametrize("unit", ["KIM101", "TIM101"])
def test_a_channel_reads_its_position_but_not_whether_it_moves(unit: str) -> None:
    """The status is that of all channels; the position counter is that of one."""
    device, instrument = opened(unit)
    with device:
        channel = device.channel(3)
        channel.set_pos_counters(position=-25)
        instrument.frames.clear()
        assert channel.position_counts == -25
        assert instrument.frames == [bytes((0xC1, 0x08, 0x05, BITS[3], 0x50, 0x01))]
        with pytest.raises(UnsupportedError):
            channel.is_moving()


def test_a_channel_has_a_number_or_a_name() -> None:
    device, _ = opened("KIM101")
    with device:
        assert device.channel("CHAN3") is device.channel(3)
        assert device.channel(e.ChannelBit.CHAN3) is device.channel(3)
        assert device.channel(4) is device.channels[3]
        for wrong in (0, 5, 8, -1):
            with pytest.raises(OutOfRangeError):
                device.channel(wrong)
        for other in ("CHAN5", "4", 2.0, True, e.Channel.CHAN2, None):
            with pytest.raises(BadValueError):
                device.channel(other)
