"""What is wrong with this computer where a controller is not found: no port, no permission, no driver."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable

from stagewire.discovery import linux, windows
from stagewire.discovery.diagnosis import Diagnosis, Verdict
from stagewire.discovery.finding import discover
from stagewire.discovery.found import Found
from stagewire.discovery.line_diagnosis import diagnose_line
from stagewire.links.refusal import permission_advice

__all__ = ["diagnose_computer"]


def diagnose_computer(ask: bool = False) -> list[Diagnosis]:
    """Look at all ports, and at controllers that have none.

    :param ask: open the ports that are controllers by their USB plug, and ask them who they are.
    """
    found = discover()
    told = [*map(_port, found), *_without_port(found)]
    if not any(one.is_controller for one in found) and not _wrong(told):
        told.append(_nothing())
    if ask:
        asked = [one.url for one in found if one.port.plug and _may_open(one.url)]
        told += [told for url in asked for told in diagnose_line(url)]
    return told


def _port(found: Found) -> Diagnosis:
    """Say what a port is, and whether this user may open it."""
    if not found.is_controller:
        return Diagnosis(
            Verdict.NOTE,
            found.url,
            found.what,
            f"if it is a controller, ask it: stagewire doctor {found.url}",
        )
    if not _may_open(found.url):
        return Diagnosis(
            Verdict.WRONG,
            found.url,
            f"{found.what}; but this user may not open the port",
            permission_advice(found.url),
        )
    return Diagnosis(Verdict.FINE, found.url, found.what)


def _may_open(device: str) -> bool:
    """Whether the permissions of a port let this user open it; systems without such say yes."""
    return not os.path.exists(device) or os.access(device, os.R_OK | os.W_OK)


def _without_port(found: Iterable[Found]) -> list[Diagnosis]:
    """Say which controllers are on USB and have no serial port."""
    ports = [one.port for one in found]
    lacking = [_windows(number) for number in windows.without_port(windows.present(), ports)]
    if sys.platform.startswith("linux"):
        lacking += [_linux(device) for device in linux.usb_devices() if not device.has_port]
    return lacking


def _windows(serial_number: str) -> Diagnosis:
    return Diagnosis(
        Verdict.WRONG,
        f"controller {serial_number}",
        "it is plugged in, and its driver gives it no COM port",
        "in the Device Manager, under “Universal Serial Bus controllers”, open the properties of the "
        "device (“APT USB Device” or “USB Serial Converter”), tick “Load VCP” on the page “Advanced”, "
        "and plug the controller in again; a COM port then stands under “Ports (COM & LPT)”",
    )


def _linux(device: linux.UsbDevice) -> Diagnosis:
    about = f"controller {device.serial_number or 'without a serial number'}"
    vid, pid = f"{device.plug.vid:04x}", f"{device.pid:04x}"
    if device.driver == "usbfs":
        return Diagnosis(
            Verdict.WRONG,
            about,
            "it is plugged in, but a program drives its USB chip itself, so that there is no serial port",
            "end the program that uses libftdi or the D2XX library, and plug the controller in again",
        )
    if device.driver:
        return Diagnosis(
            Verdict.WRONG,
            about,
            f"it is plugged in, but held by the driver {device.driver}, which gives it no serial port",
            "plug it in again; if that does not help, see what dmesg says of it",
        )
    return Diagnosis(
        Verdict.WRONG,
        about,
        f"it is plugged in ({vid}:{pid}), and no driver is bound to it, so that there is no serial port",
        f"sudo modprobe ftdi_sio; where that is not enough: "
        f"echo {vid} {pid} | sudo tee /sys/bus/usb-serial/drivers/ftdi_sio/new_id",
    )


def _nothing() -> Diagnosis:
    """Say that there is no controller, and where to look on this system."""
    where = {
        "linux": "lsusb lists what is plugged in, dmesg says why a device was refused; in a container or a "
        "virtual machine the device has to be passed on",
        "win32": "the Device Manager shows it under “Universal Serial Bus controllers” or “Other devices”; "
        "without a driver, install that of FTDI (VCP), and tick “Load VCP” in its properties",
        "darwin": "System Information lists it under USB; without a /dev/cu.usbserial… it needs FTDI's VCP "
        "driver, which has to be allowed under Privacy & Security",
    }
    return Diagnosis(
        Verdict.WRONG,
        "USB",
        "no controller is plugged in, as far as this computer knows",
        "see that it is switched on and that the USB cable carries data; "
        + where.get(sys.platform, "see what the system says of its USB devices"),
    )


def _wrong(told: Iterable[Diagnosis]) -> bool:
    return any(one.verdict is Verdict.WRONG for one in told)
