"""Diagnosis of the computer: missing permission, missing port, or no controller."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from serial_ports import linux, port, show, windows
from stagewire._discovery import ports as usb_ports
from stagewire._discovery.ports import usb_devices, without_port
from stagewire.discovery import Diagnosis, Port, Verdict, diagnose_computer

INSTANCE = r"USB\VID_0403&PID_FAF0\83828433"


@pytest.fixture(autouse=True)
def made_up_computer(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Simulate a computer without controllers, with the USB devices of the kernel in a directory."""
    show(monkeypatch)
    monkeypatch.setattr(sys, "platform", "linux")
    real = usb_devices
    monkeypatch.setattr(usb_ports, "usb_devices", lambda: real(tmp_path))
    return tmp_path


def plug_in(
    root: Path,
    name: str,
    *,
    ids: str = "0403:faf0",
    driver: str = "",
    port: str = "",
    serial_number: str = "83828433",
) -> None:
    """Create the files with which the kernel lists a device."""
    folder = root / name
    interface = folder / f"{name}:1.0"
    interface.mkdir(parents=True)
    vid, pid = ids.split(":")
    for file, text in (("idVendor", vid), ("idProduct", pid), ("serial", serial_number)):
        (folder / file).write_text(f"{text}\n")
    if driver:
        made = root.parent / f"{root.name}-drivers" / driver
        made.mkdir(parents=True, exist_ok=True)
        (interface / "driver").symlink_to(made)
    if port:
        (interface / port).mkdir()


def wrong(told: list[Diagnosis]) -> list[Diagnosis]:
    assert all(one.advice for one in told if one.verdict is Verdict.WRONG)
    return [one for one in told if one.verdict is Verdict.WRONG]


@pytest.mark.parametrize(
    ("system", "said"),
    [("linux", "lsusb"), ("win32", "Load VCP"), ("darwin", "Privacy & Security"), ("aix", "USB")],
)
def test_without_a_controller_the_advice_fits_the_system(
    monkeypatch: pytest.MonkeyPatch, system: str, said: str
) -> None:
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(usb_ports, "present", list)
    [told] = wrong(diagnose_computer())
    assert "no controller found" in told.text
    assert said in told.advice


def test_a_controller_with_permission_is_fine(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    device = tmp_path / "ttyUSB0"
    device.touch()
    show(monkeypatch, linux(str(device), "83828433"))
    [told] = diagnose_computer()
    assert told == Diagnosis(
        Verdict.FINE,
        str(device),
        "TDC001: One-channel T-Cube DC servo driver",
        f"from stagewire_apt import TDC001; next: stagewire monitor {device}",
    )


def test_the_advice_for_missing_permission_names_the_group_and_a_udev_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    device = tmp_path / "ttyUSB0"
    device.touch()
    show(monkeypatch, linux(str(device), "83828433"))
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    [told] = wrong(diagnose_computer(ask=True))  # such a port is not opened
    assert "permission denied for this user" in told.text
    assert "sudo usermod -aG" in told.advice
    assert 'ATTRS{idVendor}=="0403", ATTRS{idProduct}=="faf0"' in told.advice


def test_an_unknown_port_is_a_note_with_the_command_to_ask_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    show(monkeypatch, port("/dev/ttyS9"))
    noted, nothing = diagnose_computer()
    assert noted.verdict is Verdict.NOTE
    assert "stagewire doctor /dev/ttyS9" in noted.advice
    assert nothing.verdict is Verdict.WRONG


@pytest.mark.parametrize(
    ("driver", "said", "advice"),
    [
        ("", "no driver is bound", "echo 0403 faf0 | sudo tee /sys/bus/usb-serial"),
        ("usbfs", "a program controls its USB chip directly", "close the program"),
        ("cdc_subset", "the driver cdc_subset has not created a serial port", "dmesg"),
    ],
)
def test_a_controller_without_a_port_on_linux(
    made_up_computer: Path, driver: str, said: str, advice: str
) -> None:
    plug_in(made_up_computer, "1-2", driver=driver)
    plug_in(made_up_computer, "1-3", ids="046d:c31c", driver="usbhid")  # a keyboard
    [told] = wrong(diagnose_computer())
    assert told.about == "controller 83828433"
    assert said in told.text
    assert advice in told.advice


def test_a_controller_with_a_port_is_not_reported_as_missing_one(
    monkeypatch: pytest.MonkeyPatch, made_up_computer: Path
) -> None:
    plug_in(made_up_computer, "1-2", driver="ftdi_sio", port="ttyUSB0")
    show(monkeypatch, linux("/dev/there-is-none", "83828433"))
    [device] = usb_devices(made_up_computer)
    assert (device.driver, device.has_port) == ("ftdi_sio", True)
    assert wrong(diagnose_computer()) == []


def test_unreadable_files_of_the_kernel_are_ignored(made_up_computer: Path) -> None:
    plug_in(made_up_computer, "1-2", ids="zz:faf0")
    (made_up_computer / "usb1").mkdir()
    assert usb_devices(made_up_computer) == []
    assert usb_devices(made_up_computer / "no such folder") == []


def test_a_controller_without_a_serial_number_is_reported(made_up_computer: Path) -> None:
    plug_in(made_up_computer, "1-2", serial_number="")
    (made_up_computer / "1-2" / "serial").unlink()
    [told] = wrong(diagnose_computer())
    assert told.about == "controller without a serial number"


def test_the_advice_for_windows_explains_how_to_get_a_com_port(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(usb_ports, "present", lambda: [INSTANCE])
    [told] = wrong(diagnose_computer())
    assert told.about == "controller 83828433"
    assert "tick “Load VCP” on the page “Advanced”" in told.advice


def test_windows_with_a_com_port_is_fine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(usb_ports, "present", lambda: [INSTANCE])
    show(monkeypatch, windows("COM3", "83828433"))
    assert wrong(diagnose_computer()) == []


def test_controllers_without_a_com_port_are_found_on_windows() -> None:
    instances = [
        INSTANCE,
        INSTANCE.replace("83828433", "80000001").lower(),
        r"USB\VID_0403&PID_6001\A50285BI",
        r"USB\VID_046D&PID_C31C\5&2c",
        "nonsense",
    ]
    assert without_port(instances, [Port("COM3", serial_number="83828433")]) == ["80000001"]


def test_the_windows_registry_is_not_read_on_other_systems() -> None:
    assert usb_ports.present() == []


class MadeUpRegistry:
    """A substitute for the module ``winreg``; ``values`` is None if the key does not exist."""

    HKEY_LOCAL_MACHINE = object()

    def __init__(self, values: dict[str, object] | None) -> None:
        self.values = values

    @contextmanager
    def OpenKey(self, root: object, path: str) -> Iterator[dict[str, object]]:
        assert root is self.HKEY_LOCAL_MACHINE
        assert path.endswith(r"\FTDIBUS\Enum")
        if self.values is None:
            raise FileNotFoundError(path)
        yield self.values

    def QueryInfoKey(self, key: dict[str, object]) -> tuple[int, int, int]:
        return 0, len(key), 0

    def EnumValue(self, key: dict[str, object], index: int) -> tuple[str, object, int]:
        name = list(key)[index]
        return name, key[name], 1


@pytest.mark.parametrize(
    ("values", "found"),
    [({"0": INSTANCE, "Count": 1, "NextInstance": 1, "1": 7}, [INSTANCE]), ({}, []), (None, [])],
    ids=["one", "none", "never installed"],
)
def test_devices_of_the_driver_are_read_from_the_windows_registry(
    monkeypatch: pytest.MonkeyPatch, values: dict[str, object] | None, found: list[str]
) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setitem(sys.modules, "winreg", MadeUpRegistry(values))
    assert usb_ports.present() == found
