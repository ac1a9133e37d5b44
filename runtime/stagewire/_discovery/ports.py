"""The serial ports and USB devices of this computer, as the operating system lists them; none is opened.

USB ids are not in the documents of the registries, so each has its own source here. Controllers without a
serial port are also found: on Linux those without a driver, on Windows those whose driver creates no COM
port.
"""

from __future__ import annotations

import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

from stagewire._links.serial_port import PortFacts, port_called, ports_there_are
from stagewire._links.usb import SYSFS, number_in, number_on_plug, port_with

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable

FTDI = 0x0403
"""The vendor of the USB chip inside the controllers; many other devices also use its ids."""


@dataclass(frozen=True, slots=True)
class Plug:
    """USB ids of the controllers of one protocol.

    :param protocol: name of the protocol.
    :param vid: id of the vendor.
    :param pid: id of the product.
    :param manufacturer: part of the name of the manufacturer; other products of ``vid`` with this name also
        match.
    :param source: source of the ids.
    """

    protocol: str
    vid: int
    pid: int
    manufacturer: str
    source: str


PLUGS = (
    Plug(
        protocol="thorlabs_apt",
        vid=FTDI,
        pid=0xFAF0,
        manufacturer="thorlabs",
        source="ftdi_sio_ids.h of the Linux kernel, FTDI_THORLABS_PID: ThorLabs USB motor drivers",
    ),
)


def plug_of(vid: int | None, pid: int | None, manufacturer: str = "") -> Plug | None:
    """Return the plug that matches a USB device, or None.

    A chip with the ids of its own vendor (0403:6001) may be in any adapter, so it only matches with the name
    of the manufacturer.
    """
    for plug in PLUGS:
        if vid == plug.vid and (pid == plug.pid or plug.manufacturer in manufacturer.lower()):
            return plug
    return None


@dataclass(frozen=True, slots=True)
class Port:
    """A serial port.

    :param device: name to open, such as ``/dev/ttyUSB0`` or ``COM3``.
    :param description: description by the operating system; may be empty.
    :param vid: USB id of the vendor; None for a port that is not on USB.
    :param pid: USB id of the product.
    :param serial_number: serial number of the USB device, only its digits if it is a number; may be empty.
    :param manufacturer: manufacturer that the USB device reports; may be empty.
    """

    device: str
    description: str = ""
    vid: int | None = None
    pid: int | None = None
    serial_number: str = ""
    manufacturer: str = ""

    @property
    def plug(self) -> Plug | None:
        """The USB plug of a controller, or None for other ports."""
        return plug_of(self.vid, self.pid, self.manufacturer)

    @property
    def usb(self) -> str:
        """The USB ids, such as ``0403:faf0``; empty for a port that is not on USB."""
        if self.vid is None or self.pid is None:
            return ""
        return f"{self.vid:04x}:{self.pid:04x}"


def serial_ports() -> list[Port]:
    """Return all serial ports, sorted by name, with numbers in numerical order."""
    return sorted(map(_port, ports_there_are()), key=lambda port: _in_order(port.device))


def port_of(url: str) -> Port | None:
    """Return the port of a URL, or None; links such as ``/dev/serial/by-id/…`` are resolved.

    Raise :class:`~stagewire.errors.LinkOpenError` for ``usb://`` with a serial number that no port has.
    """
    if (number := number_in(url)) is not None:
        return _port(port_with(number))
    info = None if "://" in url else port_called(url)
    return None if info is None else _port(info)


def _port(info: PortFacts) -> Port:
    """Return a port from the data of pyserial, which is incomplete in different ways on each system."""
    description = info.description or ""
    return Port(
        device=info.device,
        description="" if description == "n/a" else description,
        vid=info.vid,
        pid=info.pid,
        serial_number=number_on_plug(info.serial_number),
        manufacturer=info.manufacturer or "",
    )


def _in_order(name: str) -> list[tuple[int, str]]:
    """Return a sort key that places COM10 after COM9."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name)]


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """A controller on USB, as the kernel lists it.

    :param plug: matching plug.
    :param pid: USB id of the product.
    :param serial_number: serial number that the USB device reports; may be empty.
    :param driver: bound driver; empty for none. ``usbfs`` means that a program controls the device directly.
    :param has_port: whether it has a serial port.
    """

    plug: Plug
    pid: int
    serial_number: str
    driver: str
    has_port: bool


def usb_devices(root: Path = SYSFS) -> list[UsbDevice]:
    """Return the controllers on USB, with or without a serial port; empty if the kernel has no such list.

    :param root: directory in which the kernel lists USB devices.
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
    """Return the text of a one-line file of the kernel; empty if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""


_DRIVER = r"SYSTEM\CurrentControlSet\Services\FTDIBUS\Enum"
"""Registry key in which Windows lists the devices that the driver of the USB chip currently controls."""
_INSTANCE = re.compile(r"USB\\VID_([0-9A-F]{4})&PID_([0-9A-F]{4})\\([0-9A-Z]+)", re.IGNORECASE)


def present() -> list[str]:
    """Return the instances that the driver of the USB chip controls; empty on other systems than Windows."""
    if sys.platform != "win32":
        return []
    import winreg

    try:
        with winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, _DRIVER) as key:
            number = winreg.QueryInfoKey(key)[1]
            values = [winreg.EnumValue(key, index) for index in range(number)]
    except OSError:  # the driver was never installed, or has no devices
        return []
    return [value for name, value, _ in values if name.isdigit() and isinstance(value, str)]


def without_port(instances: Iterable[str], ports: Iterable[Port]) -> list[str]:
    r"""Return the serial numbers of controllers that are plugged in but have no COM port.

    :param instances: instances of the driver, such as ``USB\VID_0403&PID_FAF0\83828433``.
    :param ports: all serial ports.
    """
    served = {port.serial_number for port in ports}
    found = []
    for instance in instances:
        match = _INSTANCE.match(instance)
        if match and plug_of(int(match[1], 16), int(match[2], 16)) and match[3] not in served:
            found.append(match[3])
    return found
