"""What a controller reports about itself and its stage, and messages that real clients send."""

from __future__ import annotations

import pytest
from apt_host import host_of
from motor_host import MotorHost

from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_virtual.options import Settings


def information(unit: str, stage: str, **options: object) -> bytes:
    """Return the payload of HW_GET_INFO of a unit with a stage."""
    channels = (Settings(stage=getattr(stages, stage)),) if stage else ()
    far = host_of(unit, channels=channels, **options)
    far.say(m.HwReqInfo())
    [raw] = far.heard_raw()
    return raw[6:]


@pytest.mark.parametrize(
    ("unit", "stage", "stage_id", "actuator"),
    [
        ("KDC101", "MTS25_Z8", 7, 0),
        ("KDC101", "PRM1_Z8", 6, 0),
        ("KDC101", "Z825", 9, 0),
        ("KDC101", "Z825B", 9, 0),  # another mounting
        ("KDC101", "", 0, 0),
        ("TDC001", "MTS25_Z8", 0, 0),  # it is not known to report its stage
        ("KST201", "ZST213", 0, 0x31),
        ("KST201", "ZST213B", 0, 0x31),
        ("KST201", "", 0, 0),
        ("KST101", "ZST213", 0, 0),
    ],
)
def test_a_unit_reports_its_stage_in_its_own_field(
    unit: str, stage: str, stage_id: int, actuator: int
) -> None:
    payload = information(unit, stage)
    assert payload[76:78] == stage_id.to_bytes(2, "little")
    assert payload[80:82] == actuator.to_bytes(2, "little")


def test_the_option_replaces_the_id_of_the_stage() -> None:
    assert information("KDC101", "Z825", stage_id=12)[76:78] == b"\x0c\x00"
    assert information("KDC101", "Z825", stage_id=0)[76:78] == b"\x00\x00"


@pytest.mark.parametrize(
    ("stage", "stage_id", "axis_id", "name"),
    [
        ("MLS203_X", 0x10, 0x10, "MLS203 X"),
        ("MLS203_Y", 0x11, 0x11, "MLS203 Y"),
        ("DDS220", 0x13, 0x12, "DDS220"),
        ("DDR100", 0x75, 0x03, "DDR100"),
    ],
)
def test_a_brushless_controller_names_its_stage(
    stage: str, stage_id: int, axis_id: int, name: str
) -> None:
    chosen = getattr(stages, stage)
    host = MotorHost("KBD101", stage=chosen)
    found = host.ask(m.MotReqPmdStageAxisParams(1))
    assert (found.stage_id, found.axis_id, found.part_no_axis) == (stage_id, axis_id, name)
    assert found.cnts_per_unit == chosen.scale("position", "KBD101").to_counts(1)


def test_an_lts_reports_the_hardware_that_has_its_microsteps() -> None:
    """Since hardware version 3 the driver has 2048 microsteps: 409,600 counts per mm (page 41)."""
    assert information("LTS300", "")[78:80] == b"\x03\x00"
    host = MotorHost("LTS300", position=409_600 * 10)
    assert host.instrument.rows()[0].position == "0.0000 mm"
    host.say(m.MotMoveAbsolute(1, 409_600))
    host.wait(60)
    assert host.instrument.rows()[0].position == "1.0000 mm"


@pytest.mark.parametrize("unit", ["KST201", "LTS150", "LTS300", "BSC201"])
def test_a_unit_that_the_vendors_software_never_acknowledges_does_not_fall_silent(
    unit: str,
) -> None:
    far = host_of(unit)
    far.say(m.HwStartUpdateMsgs(10))
    far.clock.advance(60)
    assert len(far.heard()) == 600


@pytest.mark.parametrize("unit", ["KDC101", "BSC201"])
def test_channel_0_is_the_only_channel(unit: str) -> None:
    [velocity] = host_of(unit).ask(m.MotReqVelParams(0))
    assert velocity.chan_ident == 1


def test_a_module_with_two_channels_has_no_channel_0() -> None:
    assert host_of("MST602").ask(m.MotReqVelParams(0), 0x21) == []


def test_the_top_panel_is_unlocked_after_power_up_and_can_be_locked() -> None:
    far = host_of("KST201")
    assert far.ask(m.HwReqKcubeMmiLock()) == [m.HwGetKcubeMmiLock(mmi_lock=2)]
    far.say(m.HwSetKcubeMmiLock(mmi_lock=1))
    assert far.ask(m.HwReqKcubeMmiLock()) == [m.HwGetKcubeMmiLock(mmi_lock=1)]
    far.instrument.power_cycle()
    assert far.ask(m.HwReqKcubeMmiLock()) == [m.HwGetKcubeMmiLock(mmi_lock=2)]


def test_zero_motion_parameters_move_nothing_until_they_are_set() -> None:
    host = MotorHost("K10CR1", quirks=frozenset({"zero_motion_parameters"}))
    velocity = host.ask(m.MotReqVelParams(1))
    assert (velocity.acceleration, velocity.max_velocity) == (0, 0)
    assert host.ask(m.MotReqHomeParams(1)).home_velocity == 0
    host.say(m.MotMoveRelative(1, 100_000))
    host.say(m.MotMoveHome(1))
    host.wait(60)
    assert host.said == []
    host.say(m.MotSetVelParams(1, 0, 15_000, 73_000_000))
    host.say(m.MotMoveRelative(1, 100_000))
    host.wait(60)
    assert host.kinds == ["MOT_MOVE_COMPLETED"]
    host.instrument.power_cycle()
    assert host.ask(m.MotReqVelParams(1)).max_velocity == 0
