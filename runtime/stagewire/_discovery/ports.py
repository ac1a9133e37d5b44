"""The serial ports and USB devices of this computer, as the operating system describes them; none is opened.

No document that a registry was made from gives the numbers of USB plugs; the origin of each is noted with it.
Linux also lists controllers on USB that no driver gives a serial port, and Windows controllers whose driver
is not set to give them a COM port.
"""

from __future__ import annotations

import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

from stagewire._links.serial_port import PortFacts, port_called, ports_there_are

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable

FTDI = 0x0403
"""The vendor of the USB chip inside the controllers; its ids are on many other things, too."""


@dataclass(frozen=True, slots=True)
class Plug:
    """A USB device that is a controller of one protocol.

    :param protocol: the protocol that it speaks.
    :param vid: id of the vendor.
    :param pid: id of the product.
    :param manufacturer: what its manufacturer's name contains; with it, other products of ``vid`` fit, too.
    :param source: where the numbers come from.
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
    """Return what a USB device is the plug of, or None for anything else.

    A chip that kept the ids of its own vendor (0403:6001) may be in any adapter: it is taken for a
    controller only where the name of the manufacturer says so.
    """
    for plug in PLUGS:
        if vid == plug.vid and (pid == plug.pid or plug.manufacturer in manufacturer.lower()):
            return plug
    return None


_SERIAL_NUMBER = re.compile(r"([0-9]+)[A-D]?\Z")  # Windows adds the letter of the chip's channel


@dataclass(frozen=True, slots=True)
class Port:
    """A serial port.

    :param device: what opens it, such as ``/dev/ttyUSB0`` or ``COM3``.
    :param description: what the operating system calls it; may be empty.
    :param vid: USB id of the vendor; None for a port that is not on USB.
    :param pid: USB id of the product.
    :param serial_number: that of the USB device, digits alone where it is a number; may be empty.
    :param manufacturer: as the USB device says; may be empty.
    """

    device: str
    description: str = ""
    vid: int | None = None
    pid: int | None = None
    serial_number: str = ""
    manufacturer: str = ""

    @property
    def plug(self) -> Plug | None:
        """The plug of a controller that this is, or None."""
        return plug_of(self.vid, self.pid, self.manufacturer)

    @property
    def usb(self) -> str:
        """The USB ids, such as ``0403:faf0``; empty for a port that is not on USB."""
        if self.vid is None or self.pid is None:
            return ""
        return f"{self.vid:04x}:{self.pid:04x}"


def serial_ports() -> list[Port]:
    """Return all serial ports, in the order of their names, with numbers as numbers."""
    return sorted(map(_port, ports_there_are()), key=lambda port: _in_order(port.device))


def port_of(url: str) -> Port | None:
    """Return the port that a URL names, also through a link such as ``/dev/serial/by-id/…``; or None."""
    info = None if "://" in url else port_called(url)
    return None if info is None else _port(info)


def _port(info: PortFacts) -> Port:
    """Return what pyserial says of a port; each system leaves out something else."""
    serial_number = info.serial_number or ""
    number = _SERIAL_NUMBER.match(serial_number)
    description = info.description or ""
    return Port(
        device=info.device,
        description="" if description == "n/a" else description,
        vid=info.vid,
        pid=info.pid,
        serial_number=number[1] if number else serial_number,
        manufacturer=info.manufacturer or "",
    )


def _in_order(name: str) -> list[tuple[int, str]]:
    """Return a key by which COM10 comes after COM9."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name)]


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


_DRIVER = r"SYSTEM\CurrentControlSet\Services\FTDIBUS\Enum"
"""Where Windows lists what is plugged in now and held by the driver of the USB chip."""
_INSTANCE = re.compile(r"USB\\VID_([0-9A-F]{4})&PID_([0-9A-F]{4})\\([0-9A-Z]+)", re.IGNORECASE)


def present() -> list[str]:
    """Return the instances that the driver of the USB chip holds; none elsewhere than on Windows."""
    if sys.platform != "win32":
        return []
    import winreg

    try:
        with winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, _DRIVER) as key:
            number = winreg.QueryInfoKey(key)[1]
            values = [winreg.EnumValue(key, index) for index in range(number)]
    except OSError:  # the driver was never installed, or holds nothing
        return []
    return [value for name, value, _ in values if name.isdigit() and isinstance(value, str)]


def without_port(instances: Iterable[str], ports: Iterable[Port]) -> list[str]:
    r"""Return the serial numbers of controllers that are plugged in and have no COM port.

    :param instances: what the driver holds, such as ``USB\VID_0403&PID_FAF0\83828433``.
    :param ports: the serial ports there are.
    """
    served = {port.serial_number for port in ports}
    found = []
    for instance in instances:
        match = _INSTANCE.match(instance)
        if match and plug_of(int(match[1], 16), int(match[2], 16)) and match[3] not in served:
            found.append(match[3])
    return found
