"""Limits that a controller holds: its software limits, and the positions of its stage."""

from __future__ import annotations

from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_apt
import stagewire_virtual as virtual
from stagewire.errors import LimitError
from stagewire.quantities import Stage
from stagewire_apt import stages


def opened(unit: str, stage: Stage | None = None, controller: Any = None, **options: Any) -> Any:
    controller = controller or getattr(virtual, unit)(stage=stage)
    return getattr(stagewire_apt, unit).open(RecordingLink(controller), stage=stage, **options)


def limit(
    part: Any, low: float, high: float, mode: str = "STOP_PROFILED", unit: str = "mm"
) -> None:
    ends = {f"cw_soft_limit_{unit}": high, f"ccw_soft_limit_{unit}": low}
    part.change_lim_switch_params(**ends, software_limit_mode=mode)


@pytest.mark.parametrize("mode", ["STOP_IMMEDIATE", "STOP_PROFILED"])
def test_targets_outside_the_software_limits_are_refused(mode: str) -> None:
    with opened("KST101", stages.ZFS25B) as device:
        device.move_absolute(mm=11)
        limit(device, 0, 10, mode)
        assert "limits of the controller: 0 to 10 mm (from MOT_GET_LIMSWITCHPARAMS)" in str(device)
        for call, distance in ((device.move_absolute, 12), (device.move_relative, 1)):
            with pytest.raises(
                LimitError,
                match=r"12 mm is outside the limits of the controller, 0 to 10 mm \(from",
            ):
                call(mm=distance)
        assert device.move_absolute(mm=10).values.position_mm == pytest.approx(10)
        with pytest.raises(
            LimitError, match="absolute_position: 11 mm is outside the limits of the"
        ):
            device.set_move_abs_params(mm=11)


def test_software_limits_of_a_rotary_stage_are_in_degrees() -> None:
    with opened("K10CR1") as device:
        limit(device, 0, 90, unit="deg")
        assert "limits of the controller: 0 to 90 deg (from MOT_GET_LIMSWITCHPARAMS)" in str(device)
        with pytest.raises(LimitError, match="91 deg is outside the limits of the controller"):
            device.move_absolute(deg=91)


def test_software_limits_are_read_when_a_controller_is_opened() -> None:
    controller = virtual.KDC101()
    with opened("KDC101", controller=controller) as device:
        device.change_lim_switch_params(
            cw_soft_limit=500, ccw_soft_limit=-300, software_limit_mode="STOP_PROFILED"
        )
    with opened("KDC101", controller=controller) as device:
        assert "limits of the controller: -300 to 500 counts (from MOT_GET_LIMSWITCHPARAMS)" in str(
            device
        )
        with pytest.raises(LimitError, match="501 counts is outside the limits of the controller"):
            device.move_absolute(counts=501)
        with pytest.raises(LimitError, match="-301 counts is outside the limits of the controller"):
            device.move_relative(counts=-301)
        device.move_absolute(counts=500)


@pytest.mark.parametrize(
    "mode", ["IGNORE", "IGNORE|ROTATION_STAGE", "STOP_PROFILED|ROTATION_STAGE"]
)
def test_software_limits_of_other_modes_are_not_compared(mode: str) -> None:
    with opened("KDC101", stages.Z825) as device:
        limit(device, 0, 2)
        assert "limits of the controller: 0 to 2 mm" in str(device)
        limit(device, 0, 2, mode)
        assert "limits of the controller" not in str(device)
        device.start_move_absolute(mm=3)


@pytest.mark.parametrize("ends", [(5, 5), (2**31, 0), (0, 0)])
def test_software_limits_without_a_range_are_not_compared(ends: tuple[int, int]) -> None:
    with opened("KDC101") as device:
        device.change_lim_switch_params(
            cw_soft_limit=ends[0], ccw_soft_limit=ends[1], software_limit_mode="STOP_PROFILED"
        )
        assert "limits of the controller" not in str(device)


def test_a_tdc001_has_no_software_limits() -> None:
    controller = virtual.TDC001()
    link = RecordingLink(controller)
    with stagewire_apt.TDC001.open(link) as device:
        assert "MOT_REQ_LIMSWITCHPARAMS" not in link.names(device.facts.protocol)
        device.change_lim_switch_params(cw_soft_limit=5, software_limit_mode="STOP_PROFILED")
        assert "limits of the controller" not in str(device)


def test_positions_of_a_brushless_stage_are_compared_after_homing() -> None:
    with opened("BBD102", stages.MLS203) as rack:
        bay = rack.bay(1)
        shown = (
            "limits of the controller: 0 to 110 mm after homing (from MOT_GET_PMDSTAGEAXISPARAMS)"
        )
        assert shown in str(rack)
        bay.move_relative(mm=-2)  # not homed: it is unknown where the travel begins
        bay.home()
        for call, distance in ((bay.move_absolute, -1), (bay.move_relative, -1)):
            with pytest.raises(
                LimitError, match=r"-1 mm is outside .*, or pass travel_mm= to open"
            ):
                call(mm=distance)
        bay.move_absolute(mm=80)
        values = bay.get_pmd_stage_axis_params()
        bay.change_pmd_stage_axis_params(max_pos=values.max_pos // 2)
        with pytest.raises(
            LimitError, match="70 mm is outside the limits of the controller, 0 to 55 mm"
        ):
            bay.move_absolute(mm=70)
        with pytest.raises(LimitError, match="81 mm is outside the limits of the controller"):
            bay.move_relative(mm=1)
        rack.bay(2).move_absolute(mm=70)  # each bay has its own


def test_ends_of_the_user_replace_those_of_a_brushless_stage() -> None:
    with opened("BBD102", stages.MLS203, travel_mm=(-1, 110)) as rack:
        assert "limits of the controller" not in str(rack)
        bay = rack.bay(1)
        bay.home()
        bay.set_pos_counter(mm=100)
        bay.move_relative(mm=5)


def test_positions_of_a_brushless_stage_do_not_limit_an_endless_one() -> None:
    with opened("KBD101", stages.DDR100) as device:
        device.change_pmd_stage_axis_params(max_pos_deg=360)
        assert "limits of the controller" not in str(device)
        device.home()
        device.start_move_absolute(deg=361)
