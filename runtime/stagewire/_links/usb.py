"""The serial port of a controller on USB, found by its serial number: ``usb://27000001``.

The operating system reads the serial number from the USB plug, so no port is opened to find one.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from stagewire._links.serial_port import port_called, ports_there_are
from stagewire.errors import BadValueError, LinkOpenError

SYSFS = Path("/sys/bus/usb/devices")
"""Directory in which Linux lists USB devices."""

_URL = re.compile(r"usb://([^/?#]*)/?\Z", re.IGNORECASE)
_SUFFIXED = re.compile(r"([0-9]+)[A-D]\Z")  # Windows adds the letter of the chip's channel


def number_on_plug(serial_number: str | None) -> str:
    """Return the serial number of a USB plug without the letter that Windows adds; it may be empty."""
    number = serial_number or ""
    suffixed = _SUFFIXED.match(number)
    return suffixed[1] if suffixed else number


def usb_url(serial_number: object) -> str:
    """Return the URL of the port with a serial number.

    Raise :class:`~stagewire.errors.BadValueError` unless it is a positive integer.
    """
    if serial_number is None:
        raise BadValueError(
            "open requires a URL or the name of a port as text, or serial_number=, such as "
            "serial_number=27000001"
        )
    if isinstance(serial_number, bool) or not isinstance(serial_number, int) or serial_number < 1:
        raise BadValueError(
            f"serial_number must be an integer such as 27000001, not {serial_number!r}"
        )
    return f"usb://{serial_number}"


def number_in(url: str) -> str | None:
    """Return the serial number in a ``usb://`` URL; None for any other URL.

    Raise :class:`~stagewire.errors.LinkOpenError` for a ``usb://`` URL without letters and digits.
    """
    if not url.lower().startswith("usb://"):
        return None
    found = _URL.match(url)
    if found is None or not (found[1].isascii() and found[1].isalnum()):
        raise LinkOpenError(
            f"{url} cannot be opened: expected usb:// and the serial number of a controller, such as "
            "usb://27000001"
        )
    return found[1]


def plug_number(url: str) -> int | None:
    """Return the serial number on the USB plug of a port, or in a ``usb://`` URL; None if it has none."""
    number = number_in(url)
    if number is None and "://" not in url:
        port = port_called(url)
        number = number_on_plug(port.serial_number) if port is not None else None
    return int(number) if number and number.isascii() and number.isdigit() else None


def port_with(serial_number: str) -> Any:
    """Return the port with a serial number, as pyserial describes it.

    Raise :class:`~stagewire.errors.LinkOpenError`, with what was found instead and what to do.
    """
    there = ports_there_are()
    found = [port for port in there if number_on_plug(port.serial_number) == serial_number]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(port.device for port in found)
        raise LinkOpenError(
            f"usb://{serial_number} cannot be opened: {len(found)} ports have this serial number: {names}; "
            "open one of them by its name"
        )
    raise LinkOpenError(
        f"usb://{serial_number} cannot be opened: {_without_port(serial_number) or _absent(there)}"
    )


def _absent(there: list[Any]) -> str:
    """Return what was found in place of a controller that is not connected."""
    seen = [
        f"{number_on_plug(port.serial_number)} ({port.device})"
        for port in there
        if port.serial_number
    ]
    shown = (
        f"no port has this serial number; connected: {', '.join(seen)}"
        if seen
        else "no port has a serial number"
    )
    return (
        f"{shown}. Compare it with the label, check that the controller is "
        "switched on and plugged in; stagewire doctor without a port checks the driver"
    )


def _without_port(serial_number: str) -> str:
    """Return why a controller that Linux lists on USB has no port; empty if it is not listed."""
    for folder in sorted(SYSFS.glob("*")) if SYSFS.is_dir() else ():
        if _line(folder / "serial") != serial_number:
            continue
        drivers = [i / "driver" for i in folder.glob("*:*") if (i / "driver").exists()]
        names = {os.path.basename(os.path.realpath(driver)) for driver in drivers}
        bound = f"the driver {', '.join(sorted(names))} is bound" if names else "no driver is bound"
        return (
            f"the controller is plugged in, but {bound} to it, and it has no serial port; run stagewire "
            "doctor, which says how to bind the driver ftdi_sio"
        )
    return ""


def _line(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
