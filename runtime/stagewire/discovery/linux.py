"""Linux: controllers on USB that no driver gives a serial port."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from stagewire.discovery.usb import Plug, plug_of

__all__ = ["SYSFS", "UsbDevice", "usb_devices"]

SYSFS = Path("/sys/bus/usb/devices")


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """A controller as the kernel sees it on USB.

    :param plug: what it is the plug of.
    :param pid: the USB id of the product.
    :param serial_number: as its plug says; may be empty.
    :param driver: the driver that holds it; empty for none. ``usbfs`` is a program that drives it itself.
    :param has_port: whether there is a serial port for it.
    """

    plug: Plug
    pid: int
    serial_number: str
    driver: str
    has_port: bool


def usb_devices(root: Path = SYSFS) -> list[UsbDevice]:
    """Return the controllers on USB, with a serial port or without; none where the kernel does not say.

    :param root: the folder in which the kernel lists USB devices.
    """
    found = []
    for folder in sorted(root.glob("*")) if root.is_dir() else ():
        vid, pid = _number(folder / "idVendor"), _number(folder / "idProduct")
        plug = plug_of(vid, pid, _line(folder / "manufacturer"))
        if plug is None or pid is None:
            continue
        interfaces = sorted(folder.glob("*:*"))
        drivers = [os.path.basename(os.path.realpath(i / "driver")) for i in interfaces]
        held = [
            name for name, i in zip(drivers, interfaces, strict=True) if (i / "driver").exists()
        ]
        found.append(
            UsbDevice(
                plug=plug,
                pid=pid,
                serial_number=_line(folder / "serial"),
                driver=held[0] if held else "",
                has_port=any(True for i in interfaces for _ in i.glob("tty*")),
            )
        )
    return found


def _number(path: Path) -> int | None:
    try:
        return int(_line(path), 16)
    except ValueError:
        return None


def _line(path: Path) -> str:
    """Return the one line of a file of the kernel's; empty where it has none."""
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
