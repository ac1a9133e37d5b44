"""The serial ports of this computer, as far as opening one needs them."""

from __future__ import annotations

import contextlib
import os
from typing import Any, TypeAlias

__all__ = ["PortFacts", "port_called", "ports_there_are"]

PortFacts: TypeAlias = Any  # pyserial's ListPortInfo: device, vid, pid, serial_number, description


def ports_there_are() -> list[PortFacts]:
    """Return every port, by name; nothing where the system does not tell."""
    from serial.tools.list_ports import comports  # type: ignore[import-untyped]

    with contextlib.suppress(
        Exception
    ):  # it asks drivers and registries, and these fail in many ways
        return sorted(comports())
    return []


def port_called(name: str) -> PortFacts | None:
    """Return what is known of a port by its name, or by a link to it."""
    names = {name.casefold(), os.path.realpath(name).casefold()}
    return next((port for port in ports_there_are() if port.device.casefold() in names), None)
