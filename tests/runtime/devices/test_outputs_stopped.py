"""`stop()` of units whose outputs or loops are ended by several messages, or by one with values."""

from __future__ import annotations

from typing import Any

import pytest
from output_controller import UNITS_THAT_HEAT, OutputController
from proof_line import SIDES, Side, settled

import stagewire_virtual as virtual
from stagewire_apt import devices
from stagewire_apt.devices.facts import UNITS

LATCH = "03 06 02 00 50 01"
OPEN_LOOP = "70 08 04 00 d0 01 07 00 02 00"
STOPS = {
    "KNA101": [LATCH, "a2 06 00 00 50 01"],
    "TNA001": [LATCH],
    "BNT001": [LATCH],
    "MNA601": ["03 06 02 00 21 01"],
    "KPA101": [OPEN_LOOP],
    "TPA101": [OPEN_LOOP],
    "TQD001": [OPEN_LOOP],
    "KPZ101": ["07 07 01 00 50 01"],
    "TPZ001": ["07 07 01 00 50 01"],
    "KSC101": ["cb 04 01 02 50 01"],
    "TSC001": ["cb 04 01 02 50 01"],
    "BPC303": ["07 07 01 00 21 01", "07 07 01 00 22 01", "07 07 01 00 23 01"],
}
"""Unit -> the frames of its stop, from the pages of the document."""


def parts(device: Any) -> list[Any]:
    """Return the parts of a device that have the stop."""
    inside = [*getattr(device, "bays", ()), *getattr(device, "channels", ())]
    return (
        [device] if hasattr(device, "stop") else [part for part in inside if hasattr(part, "stop")]
    )


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", STOPS)
def test_a_stop_sends_what_ends_the_outputs_and_loops(unit: str, side: Side) -> None:
    far = OutputController(unit)

    async def scenario(bench: Any) -> None:
        async with bench.open(unit, identify=False, on_close="leave") as device:
            far.frames.clear()
            for part in parts(device):
                await settled(part.stop())

    side.run(far, scenario)
    keeps_alive = {UNITS[unit].keep_alive} - {None}
    ids = {cls.layout.id.to_bytes(2, "little") for cls in keeps_alive if cls is not None}
    sent = [frame.hex(" ") for frame in far.frames if frame[:2] not in ids]
    assert sent == STOPS[unit]


def test_every_unit_with_such_a_stop_sends_something() -> None:
    """No class has a stop that sends nothing, and each unit with a state or a stop message has one."""
    for name, unit in UNITS.items():
        cls: Any = getattr(devices, name)
        inside = [cls, getattr(cls, "bay_class", None), getattr(cls, "channel_class", None)]
        stops = any(hasattr(one, "stop") for one in inside)
        ended = unit.safe_state or unit.stop_state or unit.halts
        own = {"MOT_MOVE_STOP", "PZMOT_MOVE_STOP"} & unit.messages
        assert stops == bool(ended or own), name
    assert {name for name in UNITS if UNITS[name].safe_state} == {*UNITS_THAT_HEAT}


@pytest.mark.parametrize(
    "unit", ["PPC001", "PPC102", "CT1P", "KSG101", "TSG001", "MFF101", "MFF102"]
)
def test_a_unit_without_a_stop_says_that_its_outputs_continue(unit: str) -> None:
    with (
        getattr(virtual, unit)().tcp() as server,
        getattr(devices, unit).open(server.url) as device,
    ):
        part = device.bay(1) if unit == "PPC102" else device
        assert not hasattr(part, "stop")
        with pytest.raises(
            AttributeError, match=r"has no stop: none of its messages ends .* continue"
        ):
            part.stop()


def test_a_channel_without_a_stop_names_that_of_the_device() -> None:
    with virtual.KNA101().tcp() as server, devices.KNA101.open(server.url) as device:
        channel: Any = device.channel(1)
        with pytest.raises(
            AttributeError, match=r"KNA101Channel has no stop; stop\(\) of the device"
        ):
            channel.stop()
