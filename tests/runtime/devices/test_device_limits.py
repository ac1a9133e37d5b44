"""Limits of a stage: travel, maximum velocity and maximum acceleration. Nothing is sent above a limit."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire import Scale, Stage
from stagewire.errors import BadValueError, LimitError, UnknownScaleError
from stagewire.quantities import UnknownLimit
from stagewire_apt import BBD102, PROTOCOL, TDC001, TPZ001, TST001, aio, stages
from stagewire_ms2000 import MS2000


def z8(**options: Any) -> tuple[RecordingLink, TDC001]:
    """Return a line to a TDC001 with a Z8, and the device."""
    line = RecordingLink(virtual.TDC001(stage=stages.Z8))
    tdc = TDC001.open(line, **{"stage": "Z8", "line": "rs232", **options})
    line.forget()
    return line, tdc


TOO_FAST: dict[str, Callable[[TDC001], object]] = {
    "set_vel_params": lambda tdc: tdc.set_vel_params(
        min_velocity=0, acceleration=100, max_velocity_mm_per_s=100
    ),
    "set_vel_params in counts": lambda tdc: tdc.set_vel_params(
        min_velocity=0, acceleration=100, max_velocity=1_995_156
    ),
    "change_vel_params": lambda tdc: tdc.change_vel_params(max_velocity_mm_per_s="2.60001"),
    "change_vel_params, minimum": lambda tdc: tdc.change_vel_params(min_velocity_mm_per_s=-3),
    "change_jog_params": lambda tdc: tdc.change_jog_params(max_velocity_mm_per_s=3),
    "change_home_params": lambda tdc: tdc.change_home_params(velocity_mm_per_s=3),
    "change_pot_params": lambda tdc: tdc.change_pot_params(vel4_mm_per_s=3),
}


@pytest.mark.parametrize("call", TOO_FAST.values(), ids=TOO_FAST)
def test_nothing_is_sent_for_a_velocity_above_the_maximum(
    call: Callable[[TDC001], object],
) -> None:
    line, tdc = z8()
    with tdc, pytest.raises(LimitError, match=r"exceeds the maximum velocity, 2\.6 mm/s \(Z8, "):
        call(tdc)
    assert line.raw == b""


def test_the_limit_itself_can_be_set_in_units_and_in_counts() -> None:
    with z8()[1] as tdc:
        counts = tdc.change_vel_params(max_velocity_mm_per_s="2.6").max_velocity
        assert tdc.change_vel_params(max_velocity=counts).max_velocity == counts == 1_995_155
    with BBD102.open("virtual://BBD102", stage="MLS203") as rack:
        # The counts of the example on page 76, slightly more than 200 mm/s
        written = rack.bay(1).change_vel_params(max_velocity=26843546, acceleration=27488)
        assert written.exact("max_velocity_mm_per_s") > 200
        with pytest.raises(LimitError, match=r"maximum acceleration, 2000 .*page 76"):
            rack.bay(1).change_vel_params(acceleration=27489)


def test_options_of_open_raise_and_lower_a_limit() -> None:
    with z8(max_velocity_mm_per_s=3)[1] as tdc:
        tdc.change_vel_params(max_velocity_mm_per_s="2.9")
        with pytest.raises(LimitError, match=r"3 mm/s \(set by max_velocity_mm_per_s\)"):
            tdc.change_vel_params(max_velocity_mm_per_s="3.1")
    with z8(max_velocity_mm_per_s="0.5")[1] as tdc, pytest.raises(LimitError):
        tdc.change_vel_params(max_velocity_mm_per_s="0.6")
    with BBD102.open(
        "virtual://BBD102?stage=MLS203", stage="MLS203", max_velocity_mm_per_s={2: 250}
    ) as rack:
        rack.bay(2).change_vel_params(max_velocity_mm_per_s=250)
        with pytest.raises(LimitError):
            rack.bay(1).change_vel_params(max_velocity_mm_per_s=250)


def test_a_stored_value_above_the_limit_is_not_written_back() -> None:
    line = RecordingLink(virtual.TDC001(stage=stages.Z8))
    with TDC001.open(line, stage="Z8", max_velocity_mm_per_s=9) as tdc:
        tdc.change_vel_params(max_velocity_mm_per_s=8)
    line = RecordingLink(line.controller)
    with TDC001.open(line, stage="Z8", line="rs232") as tdc:
        line.forget()
        with pytest.raises(LimitError, match="holds a value that cannot be written back"):
            tdc.change_vel_params(min_velocity=0)
        assert line.names(PROTOCOL) == ["MOT_REQ_VELPARAMS"]
        tdc.change_vel_params(max_velocity_mm_per_s=1)


def test_asyncio_has_the_same_limits() -> None:
    async def scenario() -> None:
        async with aio.TDC001.open("virtual://TDC001?stage=Z812", stage="Z812") as tdc:
            with pytest.raises(LimitError, match="maximum velocity"):
                await tdc.change_vel_params(max_velocity_mm_per_s=100)
            with pytest.raises(LimitError, match="travel"):
                await tdc.move_absolute(mm=13)
            await tdc.move_absolute(mm="0.1")

    asyncio.run(scenario())


def test_a_travel_of_the_registry_is_a_length_independent_of_the_counter() -> None:
    controller = virtual.TDC001(stage=stages.Z812, position=0)
    line = RecordingLink(controller)
    with TDC001.open(line, stage="Z812", line="rs232") as tdc:
        line.forget()
        with pytest.raises(
            LimitError, match=r"from 0 mm to 12\.2\d* mm is longer than the travel, 12 mm"
        ):
            tdc.move_absolute(mm="12.2")
        assert line.names(PROTOCOL) == ["MOT_REQ_DCSTATUSUPDATE"]
        line.forget()
        with pytest.raises(LimitError, match="longer than the travel"):
            tdc.move_relative(mm="-12.01")
        with pytest.raises(LimitError, match="longer than the travel"):
            tdc.change_jog_params(step_size_mm="12.01")
        assert line.raw == b""
        tdc.set_pos_counter(mm=100)
        tdc.move_absolute(mm=101)
        with pytest.raises(LimitError, match="from 101 mm to 1 mm"):
            tdc.move_absolute(mm=1)
        tdc.set_move_abs_params(mm=1)
        with pytest.raises(LimitError, match="from 101 mm to 1 mm"):
            tdc.move_absolute_stored()
    with TDC001.open(RecordingLink(controller), stage="Z812", travel_mm=(0, 102)) as tdc:
        tdc.start_move_absolute(mm=1)


def test_a_stage_a_few_counts_before_its_end_can_move_its_whole_travel() -> None:
    with TDC001.open("virtual://TDC001?stage=Z812&position=0", stage="Z812") as tdc:
        tdc.set_pos_counter(mm="-0.01")
        tdc.start_move_absolute(mm=12)


def test_a_stage_of_a_user_has_the_limits_of_the_user() -> None:
    scales = {
        "position": Scale.counts_per("mm", 1000),
        "velocity": Scale.counts_per("mm/s", 100),
        "acceleration": Scale.counts_per("mm/s^2", 10),
    }
    mine = Stage.of_user(
        "slide", travel_mm=20, max_velocity_mm_per_s="1.5", max_acceleration_mm_per_s2=4, **scales
    )
    with TDC001.open("virtual://TDC001", stage=mine) as tdc:
        with pytest.raises(LimitError, match=r"1\.5 mm/s \(slide, your own stage\)"):
            tdc.set_vel_params(min_velocity=0, acceleration=40, max_velocity=151)
        with pytest.raises(LimitError, match="maximum acceleration"):
            tdc.set_vel_params(min_velocity=0, acceleration=41, max_velocity=150)
        tdc.set_vel_params(min_velocity=0, acceleration=40, max_velocity=150)
        with pytest.raises(LimitError, match="travel, 20 mm"):
            tdc.move_relative(mm=21)
        # A limit of the user is never ignored silently.
        with pytest.raises(UnknownScaleError, match="vel1 cannot be compared with the maximum"):
            tdc.change_pot_params(vel1=1)
    with pytest.raises(BadValueError, match="above 0"):
        Stage.of_user("slide", max_velocity_mm_per_s=0)


@pytest.mark.parametrize(
    ("unit", "options", "words"),
    [
        (TDC001, {"stage": "Z8", "max_acceleration_mm_per_s2": 3}, "cannot be checked: .*accel"),
        (TDC001, {"max_velocity_mm_per_s": 3}, "cannot be checked: .*pass stage="),
        (TST001, {"stage": "APT_STEPPER", "max_velocity_mm_per_s": 3}, "cannot be checked"),
        (TPZ001, {"max_velocity_mm_per_s": 3}, "a TPZ001 has no values in mm/s"),
        (MS2000, {"max_acceleration_mm_per_s2": 3}, "a MS2000 has no values in mm/s"),
    ],
)
def test_a_limit_that_cannot_be_checked_is_refused(
    unit: Any, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(UnknownScaleError, match=words):
        unit.open(f"virtual://{unit.unit.name}", **options)


@pytest.mark.parametrize("value", [0, -1, "fast", float("nan"), {2: 1}])
def test_a_limit_must_be_above_0_and_on_a_known_channel(value: Any) -> None:
    with pytest.raises(BadValueError, match="max_velocity_mm_per_s"):
        TDC001.open("virtual://NO_SUCH_UNIT", stage="Z8", max_velocity_mm_per_s=value)


def test_an_ms2000_has_the_maximum_velocity_of_the_user() -> None:
    with MS2000.open("virtual://MS2000", max_velocity_mm_per_s={"X": 5}) as ms, ms.low_level():
        ms.axis("X").write_top_speed(um_per_s=5000)
        ms.axis("Y").write_top_speed(um_per_s=5001)
        with pytest.raises(LimitError, match="top_speed: 5001 um/s"):
            ms.axis("X").write_top_speed(um_per_s=5001)
        with pytest.raises(LimitError, match="vector_speed: 6000 um/s"):
            ms.axis("X").write_vector_speed(um_per_s=6000)


def test_printing_a_device_shows_each_limit_and_its_source() -> None:
    settings = (
        "ThorlabsDefaultSettings.xml 1.14.52.1 of the vendor, the same for Z806, Z812 and Z825"
    )
    with z8()[1] as tdc:
        lines = str(tdc).splitlines()
    assert lines[2:6] == [
        "  channel 1: stage Z8, chosen by the user",
        "    travel: unknown (the series has actuators of 6, 12 and 25 mm; specify stage Z806, Z812 or "
        "Z825); not checked; set it with travel_mm=",
        f"    maximum velocity: 2.6 mm/s (Z8, {settings})",
        f"    maximum acceleration: 4 mm/s^2 (Z8, {settings}); acceleration not checked: scale unknown",
    ]
    with TDC001.open("virtual://TDC001") as tdc:
        assert "    maximum velocity: unknown; not checked; cannot be set: scale unknown" in str(
            tdc
        )
    with BBD102.open("virtual://BBD102", stages={2: "MLS203_Y"}) as rack:
        assert "    travel: 75 mm (MLS203_Y, Issue 3, page 76)" in str(rack)
        assert "    maximum velocity: 200 mm/s (MLS203_Y, Issue 3, page 76)" in str(rack)


def test_every_limit_of_the_registry_has_a_source() -> None:
    known = {
        (name, limit): getattr(stages, name).limits[limit]
        for name in stages.__all__
        for limit in getattr(stages, name).limits
    }
    assert {name for name, _ in known} == set(stages.__all__)
    for limit in known.values():
        assert limit.reason if isinstance(limit, UnknownLimit) else limit.source
    assert known["Z8", "max_velocity"].value == Fraction("2.6")
    lengths = {name: known[name, "travel"] for name in ("Z806", "Z812", "Z825")}
    assert {name: limit.value for name, limit in lengths.items()} == {
        "Z806": 6, "Z812": 12, "Z825": 25,
    }  # fmt: skip
    assert isinstance(known["APT_STEPPER", "max_velocity"], UnknownLimit)


def test_an_ms2000_compares_the_length_of_a_travel_with_its_position() -> None:
    line = RecordingLink(virtual.MS2000())
    with (
        MS2000.open(line, stage=Stage.of_user("slide", travel_mm=20)) as ms2000,
        ms2000.low_level(),
    ):
        line.forget()
        with pytest.raises(LimitError, match="30 mm is longer than the travel, 20 mm"):
            ms2000.axis("X").move_absolute(um=30_000)
        assert bytes((24, 84)) not in line.raw  # the command that moves
        assert ms2000.axis("X").move_absolute(um=100).seconds > 0
