"""Mistakes of users; each line ends with the findings of mypy and pyright."""

from __future__ import annotations

from stagewire_apt import BBD102, TDC001, TPZ001
from stagewire_apt import messages as m


def one_stage(tdc: TDC001) -> None:
    """A stage in millimetres."""
    tdc.move_absolute(1)  # wrong: call-arg reportCallIssue
    tdc.move_absolute(um=1.5)  # wrong: call-arg reportCallIssue
    tdc.move_absolute(mm=[1.5])  # wrong: arg-type reportArgumentType
    tdc.move_absolute(counts=1.5)  # wrong: arg-type reportArgumentType
    tdc.move_absolute(mm=1.5).wait()  # wrong: attr-defined reportAttributeAccessIssue
    print(tdc.home().values.position)  # wrong: attr-defined reportAttributeAccessIssue
    tdc.start_move_absolute(mm=1.5, timeout=3)  # wrong: call-arg reportCallIssue
    tdc.jog()  # wrong: call-arg reportCallIssue
    tdc.jog(1.5)  # wrong: arg-type reportArgumentType
    tdc.set_vel_params(max_velocity_mm_s=2)  # wrong: call-arg reportCallIssue
    print(tdc.get_vel_params().max_velocity_mm)  # wrong: attr-defined reportAttributeAccessIssue
    tdc.get_vel_params().max_velocity = 3  # wrong: assignment reportAttributeAccessIssue
    tdc.set_output_volts(volts=3)  # wrong: attr-defined reportAttributeAccessIssue
    tdc.subscribe("MOT_GET_DCSTATUSUPDATE")  # wrong: call-overload reportArgumentType
    for status in tdc.subscribe(m.MotGetDcStatusUpdate):
        print(status.position_mm)  # wrong: attr-defined reportAttributeAccessIssue


def others(bbd102: BBD102, tpz001: TPZ001) -> str:
    """Attributes that only other units have."""
    bbd102.home()  # wrong: attr-defined reportAttributeAccessIssue
    bbd102.bay("2").home()  # wrong: arg-type reportArgumentType
    bbd102.channel(1).home()  # wrong: attr-defined reportAttributeAccessIssue
    tpz001.move_absolute(mm=1)  # wrong: attr-defined reportAttributeAccessIssue
    TDC001.open(port="/dev/ttyUSB0")  # wrong: call-arg reportCallIssue
    TDC001.open("/dev/ttyUSB0", travel=25)  # wrong: call-arg reportCallIssue
    TDC001.open("/dev/ttyUSB0", on_close="park")  # wrong: arg-type reportArgumentType
    TDC001("/dev/ttyUSB0").home()  # wrong: arg-type reportArgumentType
    return tpz001.get_output_volts().volts  # wrong: return-value reportReturnType
