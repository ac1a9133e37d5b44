"""The serial ports of this computer, as the operating system describes them; none is opened."""

from __future__ import annotations

import re
from dataclasses import dataclass

from stagewire.discovery.usb import Plug, plug_of
from stagewire.links.ports import PortFacts, port_called, ports_there_are

__all__ = ["Port", "port_of", "serial_ports"]

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
