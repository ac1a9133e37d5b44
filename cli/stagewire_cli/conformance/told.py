"""Whether a controller says that it is another unit than the one that was named."""

from __future__ import annotations

from stagewire.discovery import by_name, by_serial_number
from stagewire.links import Link
from stagewire.protocols import FramedProtocol
from stagewire_cli.output import printable
from stagewire_conformance.device.declared import declare
from stagewire_conformance.device.lines.apt_line import AptLine
from stagewire_conformance.device.permissions import Permissions

__all__ = ["contradiction"]


def contradiction(link: Link, unit: str) -> str:
    """Return in words what a controller says that it is, where that is another unit; else nothing.

    :param unit: what was named. One whose protocol does not let it say what it is contradicts nothing.

    Raises :class:`~stagewire.errors.StagewireError` where nothing answers.
    """
    declared = declare(unit)
    if not isinstance(declared.protocol, FramedProtocol):
        return ""
    line = AptLine(link, declared, Permissions())
    with line.silent():
        told = line.contact()
    model = str(told.get("model_number", "")).strip()
    found = by_name(declared.protocol, model)
    serial_number = str(told.get("serial_number", ""))
    known = [found] if found else by_serial_number(declared.protocol, serial_number)
    units = {each.unit for each in known}
    if not units - {None} or declared.unit.name in units:
        return ""
    return (
        f"--unit {declared.unit.name} was named, and the controller says that it is a "
        f"{printable(model)} with the serial number {printable(serial_number)}"
    )
