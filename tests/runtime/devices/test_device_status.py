"""Position, homed state and status bits of every motor, by short names."""

from __future__ import annotations

import asyncio
import inspect
import pydoc
import re
import textwrap
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import (
    BadValueError,
    MotionTimeoutError,
    UnknownScaleError,
    UnsupportedError,
)
from stagewire.quantities import find_stages
from stagewire_apt import (
    BSC203,
    K10CR1,
    KDC101,
    KIM001,
    MFF101,
    TDC001,
    TPZ001,
    aio,
    devices,
    stages,
)
from stagewire_apt import messages as m
from stagewire_apt.devices.facts import UNITS
from stagewire_ms2000 import MS2000
from stagewire_virtual.factory import simulated_units

INERTIAL = ("KIM101", "KIM001", "TIM101", "PDXC2")
"""Inertial drives, whose status is not that of a motor."""
MOTORS = [
    name
    for name, unit in UNITS.items()
    if unit.status_query is not None
    and unit.positions is None
    and unit.kind != "bay"
    and name not in INERTIAL
    and name in simulated_units()
    and not {"PZ_SET_NTMODE", "MOT_SET_SOL_STATE"}
    & simulated_units()[name].messages  # without a motor
]


def test_the_position_has_the_unit_of_the_stage() -> None:
    with KDC101.open(RecordingLink(virtual.KDC101(stage=stages.Z825B))) as kdc:
        kdc.home()
        kdc.move_absolute(counts=34555)
        assert kdc.position_counts == 34555
        assert kdc.position == kdc.position_mm == pytest.approx(34555 / 34554.96)
        with pytest.raises(UnknownScaleError, match=r"is a linear stage: .* read position_mm"):
            _ = kdc.position_deg


def test_the_position_of_a_rotary_stage_is_in_degrees() -> None:
    with K10CR1.open(RecordingLink(virtual.K10CR1())) as mount:
        mount.home()
        mount.move_absolute(deg=3)
        assert mount.position == mount.position_deg == pytest.approx(3)
        with pytest.raises(UnknownScaleError, match=r"is a rotary stage: .* read position_deg"):
            _ = mount.position_mm


def test_a_position_without_a_known_stage_is_in_counts_only() -> None:
    with TDC001.open("virtual://TDC001") as tdc:
        assert tdc.position_counts == 0
        with pytest.raises(UnknownScaleError, match="raw counts need no scale"):
            _ = tdc.position


@pytest.mark.parametrize("unit", [*MOTORS, "KIM001", "PDXC2"])
def test_every_motor_reports_its_position_and_whether_it_is_homed(unit: str) -> None:
    with getattr(devices, unit).open(f"virtual://{unit}") as device:
        motor = device.bay(1) if UNITS[unit].kind == "rack" else device
        motor = motor.channel(1) if hasattr(motor, "channel") else motor
        assert isinstance(motor.position_counts, int)
        assert motor.is_homed() is False
        plain = motor.wait_for("homed", on=False).asdict()
        assert not any("homed" in bits for bits in plain.values() if isinstance(bits, list))


def test_an_inertial_drive_with_one_channel_reports_the_short_form_of_the_status() -> None:
    with KIM001.open(RecordingLink(virtual.KIM001())) as kim:
        kim.enable()
        kim.move_relative(counts=120)
        status = kim.get_status_update()
        assert status.position == kim.position_counts == 120
        assert "channel_enabled" in status.status_bits.names
        assert "position_1" not in status.asdict()


def example_of(unit: str) -> str:
    """Return the program in the help of a unit."""
    text = inspect.getdoc(getattr(devices, unit)) or ""
    lines = [line for line in text.split("::\n", 1)[1].splitlines() if line.startswith("    ")]
    return textwrap.dedent("\n".join(lines))


@pytest.mark.parametrize("unit", MOTORS)
def test_the_help_of_every_motor_starts_with_a_program_that_works(
    unit: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code = example_of(unit)
    named = re.search(r'stage="([^"]+)"', code)
    given = {"stage": find_stages("stagewire_apt", named[1])[0]} if named else {}
    link = RecordingLink(getattr(virtual, unit)(**given))
    exec(code.replace('"COM3"', "link"), {unit: getattr(devices, unit), "link": link})
    target = 1000 if "counts=1000" in code else 1
    assert float(capsys.readouterr().out) == pytest.approx(target, rel=1e-2)


def test_help_begins_with_the_class_and_not_with_its_mixins() -> None:
    text = pydoc.render_doc(TDC001, renderer=pydoc.plaintext)
    assert "\nclass TDC001(_TDC001Calls)\n" in text
    assert text.index("tdc001.home()") < text.index("CanHome")


def test_a_position_is_read_with_one_request() -> None:
    line = RecordingLink(virtual.TDC001())
    with TDC001.open(line) as tdc:
        line.forget()
        assert tdc.position_counts == 0
        assert line.raw == m.MotReqDcStatusUpdate(chan_ident=1).pack(0x50, 0x01)


def test_an_axis_of_an_ms2000_has_a_position_in_um_and_mm() -> None:
    with MS2000.open(RecordingLink(virtual.MS2000())) as ms, ms.low_level():
        axis = ms.axis("X")
        axis.move_absolute(um=1500)
        assert axis.position == pytest.approx(1500)
        assert axis.position_mm == pytest.approx(1.5)
        with pytest.raises(UnsupportedError, match="does not report whether it is homed"):
            axis.is_homed()


def test_wait_for_returns_the_status_with_the_bit() -> None:
    with KDC101.open(RecordingLink(virtual.KDC101(stage=stages.Z825B))) as kdc:
        kdc.home()
        motion = kdc.start_move_absolute(mm=2)
        assert kdc.wait_for("moving_forward").status_bits.moving_forward
        assert not kdc.wait_for("moving_forward", on=False).status_bits.moving_forward
        assert motion.wait().values.position_mm == pytest.approx(2, abs=1e-4)
        assert kdc.is_homed()


def test_wait_for_a_bit_that_stays_clear_ends_with_a_timeout() -> None:
    with TDC001.open("virtual://TDC001") as tdc:
        with pytest.raises(MotionTimeoutError, match=r"homed was not set within 0\.2 s"):
            tdc.wait_for("homed", timeout=0.2)
        with pytest.raises(BadValueError, match=r"unknown status bit 'home' .choose .*homed"):
            tdc.wait_for("home")


def test_a_unit_without_a_motor_says_so() -> None:
    with TPZ001.open("virtual://TPZ001") as piezo:
        for ask in (lambda: piezo.position, piezo.is_homed, lambda: piezo.wait_for("homed")):
            with pytest.raises(UnsupportedError, match="a TPZ001 has no request for the status"):
                ask()


def test_a_flipper_has_no_counts_and_is_never_homed() -> None:
    with MFF101.open("virtual://MFF101") as flipper:
        assert flipper.position == 1
        with pytest.raises(UnsupportedError, match="no position of a motor"):
            _ = flipper.position_counts
        with pytest.raises(UnsupportedError, match="whether it is homed"):
            flipper.is_homed()


def test_the_names_are_the_same_in_asyncio() -> None:
    async def use() -> tuple[Any, ...]:
        async with aio.BSC203.open("virtual://BSC203?stage=NRT100", stage="NRT100") as rack:
            bay = rack.bay(2)
            await bay.wait_for("homed", on=False)
            return await bay.position_mm, await bay.position_counts, await bay.is_homed()

    assert asyncio.run(use()) == (0, 0, False)
    with BSC203.open("virtual://BSC203?stage=NRT100", stage="NRT100") as rack:
        assert (rack.bay(2).position_mm, rack.bay(2).is_homed()) == (0, False)
