"""Fake serial ports, as pyserial describes them on each system."""

from __future__ import annotations

import pytest
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo


def port(device: str, **facts: object) -> ListPortInfo:
    """Return a port with these facts; all others keep the defaults of pyserial."""
    info = ListPortInfo(device, skip_link_detection=True)
    for name, value in facts.items():
        setattr(info, name, value)
    return info


def linux(device: str, serial_number: str, pid: int = 0xFAF0, maker: str = "Thorlabs"):
    return port(
        device,
        vid=0x0403,
        pid=pid,
        serial_number=serial_number,
        manufacturer=maker,
        product="APT DC Motor Controller",
        description="APT DC Motor Controller",
        location="1-2",
    )


def windows(device: str, serial_number: str):
    """Return a port on Windows, where the driver adds a letter to the serial number and hides the product."""
    return port(
        device,
        vid=0x0403,
        pid=0xFAF0,
        serial_number=f"{serial_number}A",
        manufacturer="FTDI",
        description=f"USB Serial Port ({device})",
    )


def macos(device: str, serial_number: str):
    return port(
        device,
        vid=0x0403,
        pid=0xFAF0,
        serial_number=serial_number,
        product="APT DC Motor Controller",
        description="APT DC Motor Controller",
    )


def show(monkeypatch: pytest.MonkeyPatch, *infos: ListPortInfo) -> None:
    """Make pyserial list only these serial ports."""
    monkeypatch.setattr(list_ports, "comports", lambda: list(infos))
