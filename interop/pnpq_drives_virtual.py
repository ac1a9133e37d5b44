"""PnPQ drives a virtual K10CR1 and KBD101 on pseudo-terminals, with every call of its two device classes.

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


def main() -> None:
    """Drive both units."""
    results = Results("pnpq")
    if results.installed:
        import structlog

        structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.ERROR))
        with on_pty(virtual.K10CR1(serial_number=55000001)) as watched:
            drive(results, "K10CR1", watched, "55000001")
        with on_pty(virtual.KBD101(serial_number=28000001, stage=stages.DDS100)) as watched:
            drive(results, "KBD101", watched, "28000001")
    results.finish()


if __name__ == "__main__":
    main()
