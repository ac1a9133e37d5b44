"""PnPQ drives a virtual K10CR1, KBD101 and MPC320 on pseudo-terminals, with the calls of its device classes.

PnPQ finds its port by the serial number of the USB device, which a pseudo-terminal does not have: the list of
ports is replaced. It needs Python 3.13.
"""

from __future__ import annotations

import logging
from typing import Any

from results import Results
from watched import Watched, on_pty

import stagewire_virtual as virtual
from stagewire_apt import stages


def find_port(url: str, serial_number: str) -> None:
    """Let pyserial list one port: a pseudo-terminal with a serial number."""
    from serial.tools import list_ports
    from serial.tools.list_ports_common import ListPortInfo

    port = ListPortInfo(url, skip_link_detection=True)
    port.serial_number = serial_number
    list_ports.comports = lambda include_links=False: [port]


def drive(results: Results, unit: str, watched: Watched, serial_number: str) -> None:
    """Make all calls of the class for a unit."""
    from pnpq.apt.connection import AptConnection
    from pnpq.apt.protocol import JogDirection
    from pnpq.devices.odl_thorlabs_kbd101 import OpticalDelayLineThorlabsKBD101
    from pnpq.devices.waveplate_thorlabs_k10cr1 import WaveplateThorlabsK10CR1
    from pnpq.units import pnpq_ureg

    def call(what: str, function: Any) -> Any:
        return results.call(unit, what, function)

    def at(what: str, expected: float) -> None:
        near = abs(float(watched.position.split()[0]) - expected) < 1e-3
        results.check(unit, what, near, watched.position)

    rotary = unit == "K10CR1"
    length = pnpq_ureg("degree") if rotary else pnpq_ureg("mm")
    device_class = WaveplateThorlabsK10CR1 if rotary else OpticalDelayLineThorlabsKBD101
    find_port(watched.url, serial_number)
    with AptConnection(serial_number=serial_number) as connection:
        device = call("opens and homes", lambda: device_class(connection=connection))
        if device is None:
            return
        call("move_absolute", lambda: device.move_absolute(20 * length))
        at("reaches its target", 20)
        call(
            "set_velparams", lambda: device.set_velparams(maximum_velocity=5 * length / pnpq_ureg.s)
        )
        call("get_velparams", device.get_velparams)
        call("set_jogparams", lambda: device.set_jogparams(jog_step_size=2 * length))
        call("get_jogparams", device.get_jogparams)
        homing = call("get_homeparams", device.get_homeparams)
        if homing is not None:
            call("set_homeparams", lambda: device.set_homeparams(**homing))
        call("jog", lambda: device.jog(JogDirection.FORWARD))
        at("jogs forward", 22)
        call("home", device.home)
        call(
            "is_homed" if rotary else "get_status", device.is_homed if rotary else device.get_status
        )
        call("identify", device.identify)


def turn(results: Results, watched: Watched, serial_number: str) -> None:
    """Make all calls of the class for paddles; it enables a paddle for each motion only."""
    from pnpq.apt.connection import AptConnection
    from pnpq.apt.protocol import ChanIdent, JogDirection
    from pnpq.devices.polarization_controller_thorlabs_mpc import (
        PolarizationControllerThorlabsMPC320,
    )
    from pnpq.units import pnpq_ureg

    def call(what: str, function: Any) -> Any:
        return results.call("MPC320", what, function)

    find_port(watched.url, serial_number)
    with AptConnection(serial_number=serial_number) as connection:
        paddles = call("opens", lambda: PolarizationControllerThorlabsMPC320(connection=connection))
        if paddles is None:
            return
        for number, paddle in enumerate(
            (ChanIdent.CHANNEL_1, ChanIdent.CHANNEL_2, ChanIdent.CHANNEL_3), 1
        ):
            call("home", lambda paddle=paddle: paddles.home(paddle))
            target = 300 * number
            call(
                "move_absolute",
                lambda paddle=paddle, target=target: paddles.move_absolute(
                    paddle, target * pnpq_ureg.mpc320_step
                ),
            )
            found = call("get_status", lambda paddle=paddle: paddles.get_status(paddle))
            near = found is not None and found.position == target
            results.check("MPC320", f"paddle {number} reaches its target", near, f"{found}")
        call("set_params", lambda: paddles.set_params(jog_step_3=50 * pnpq_ureg.mpc320_step))
        params = call("get_params", paddles.get_params)
        kept = params is not None and params["jog_step_3"].magnitude == 50
        results.check("MPC320", "keeps its parameters", kept, f"{params}")
        call("jog", lambda: paddles.jog(ChanIdent.CHANNEL_3, JogDirection.FORWARD))
        found = call("get_status", lambda: paddles.get_status(ChanIdent.CHANNEL_3))
        jogged = found is not None and found.position == 950
        results.check("MPC320", "paddle 3 jogs forward", jogged, f"{found}")
        call("get_status_all", paddles.get_status_all)
        call("identify", lambda: paddles.identify(ChanIdent.CHANNEL_1))


def main() -> None:
    """Drive the three units."""
    results = Results("pnpq")
    if results.installed:
        import structlog

        structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.ERROR))
        with on_pty(virtual.K10CR1(serial_number=55000001)) as watched:
            drive(results, "K10CR1", watched, "55000001")
        with on_pty(virtual.KBD101(serial_number=28000001, stage=stages.DDS100)) as watched:
            drive(results, "KBD101", watched, "28000001")
        with on_pty(virtual.MPC320(serial_number=38000001)) as watched:
            turn(results, watched, "38000001")
    results.finish()


if __name__ == "__main__":
    main()
