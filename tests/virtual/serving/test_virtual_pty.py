"""Controllers on pseudo-terminals, opened with pyserial."""

from __future__ import annotations

import builtins
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import serial
from echo_instrument import TICK, EchoInstrument, Notebook

import stagewire_virtual as virtual
from stagewire_virtual.clock import Clock, SteppedClock
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.errors import ServingError
from stagewire_virtual.faults.link import FaultyLink
from stagewire_virtual.serving.link import BACKLOG

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

PATIENCE = 20.0
EVERY_BYTE = bytes(range(256))


def echo_link(clock: SteppedClock | None = None) -> VirtualController:
    return VirtualController(EchoInstrument, clock, "echo")


def port(url: str) -> serial.Serial:
    return serial.Serial(url, 115200, timeout=PATIENCE)


def until(condition: Callable[[], bool]) -> None:
    """Wait for a condition, at most PATIENCE seconds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        threading.Event().wait(0.002)


def test_every_byte_passes_through_a_pseudo_terminal() -> None:
    with echo_link().pty() as served, port(served.url) as line:
        line.write(EVERY_BYTE)
        assert line.read(256) == EVERY_BYTE


def test_a_pseudo_terminal_is_raw_from_the_first_byte() -> None:
    """Even without pyserial, which sets raw mode itself: no echo, no translation, no signals."""
    with echo_link(SteppedClock()).pty() as served:
        line = os.open(served.url, os.O_RDWR | os.O_NOCTTY)
        try:
            os.write(line, b"\x03\x04\r\n\x11\x13")
            said = b""
            while len(said) < 6:
                said += os.read(line, 10)
            assert said == b"\x03\x04\r\n\x11\x13"
            assert served.link.received == 6
        finally:
            os.close(line)


def test_a_program_can_open_it_again() -> None:
    with echo_link().pty() as served:
        for number in range(5):
            with port(served.url) as line:
                line.write(b"%d" % number)
                assert line.read(1) == b"%d" % number


def test_a_controller_on_a_pseudo_terminal_runs_in_real_time() -> None:
    with echo_link().pty() as served, port(served.url) as line:
        line.write(b"t")
        assert line.read(15) == 3 * TICK


def test_a_hang_up_is_an_error_and_another_terminal_follows() -> None:
    with echo_link().pty() as served:
        book = served.link.observer = Notebook()
        first = served.url
        with port(first) as line:
            served.unplug()
            with pytest.raises((serial.SerialException, OSError)):
                line.read(1)
            assert served.url != first
            assert book.notes == [f"hung up; now at {served.url}"]
            with port(served.url) as again:
                again.write(b"again")
                assert again.read(5) == b"again"


def test_bytes_sent_before_a_hang_up_can_still_be_read() -> None:
    """Systems discard unread bytes of a terminal that hangs up, so the link waits until they are read."""

    def make(clock: Clock) -> FaultyLink:
        return FaultyLink(EchoInstrument(clock), ["to_host disconnect at=7"])

    with VirtualController(make).pty() as served:
        first = served.url
        with port(first) as line:
            line.write(EVERY_BYTE)
            until(lambda: served.url != first)  # the line is cut, and nothing has been read yet
            assert line.read(7) == EVERY_BYTE[:7]
            with pytest.raises((serial.SerialException, OSError)):
                line.read(1)


def test_unread_bytes_delay_a_hang_up_only_for_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stagewire_virtual.serving.pty._GRACE", 0.02)
    with echo_link().pty() as served, port(served.url) as line:
        device = Path(served.url)
        line.write(b"left")
        until(lambda: line.in_waiting == 4)
        served.unplug()
        until(lambda: not device.exists())


def test_closing_does_not_wait_for_unread_bytes() -> None:
    with echo_link().pty() as served, port(served.url) as line:
        line.write(b"left")
        until(lambda: line.in_waiting == 4)
        device = Path(served.url)
        served.unplug()
        served.close()
        assert not device.exists()


def test_a_symbolic_link_exists_while_it_is_served(tmp_path: Path) -> None:
    name = tmp_path / "x-stage"
    with echo_link().pty(name) as served:
        assert served.url == str(name)
        device = os.readlink(name)
        with port(str(name)) as line:
            line.write(b"hello")
            assert line.read(5) == b"hello"
            served.unplug()
            assert os.readlink(name) != device
        with port(str(name)) as line:
            line.write(b"again")
            assert line.read(5) == b"again"
    assert not name.is_symlink()


def answers(name: Path) -> bool:
    with port(str(name)) as line:
        line.write(b"hello")
        return line.read(5) == b"hello"


def test_a_stale_symbolic_link_is_replaced(tmp_path: Path) -> None:
    name = tmp_path / "x-stage"
    with echo_link().pty() as served:
        gone = Path(served.url).with_name("999999")
    name.symlink_to(gone)
    with echo_link().pty(name):
        assert answers(name)
    assert not name.is_symlink()


def test_a_stale_link_to_the_same_terminal_is_replaced(tmp_path: Path) -> None:
    """Systems assign the lowest free number, so a server can find its own link after being killed."""
    name = tmp_path / "x-stage"
    with echo_link().pty() as served:
        device = served.url
    name.symlink_to(device)
    with echo_link().pty(name):
        if os.readlink(name) == device:  # no other process got this number
            assert answers(name)


def test_the_link_of_another_server_is_not_replaced(tmp_path: Path) -> None:
    name = tmp_path / "x-stage"
    with echo_link().pty(name):
        with pytest.raises(
            ServingError, match=r"symbolic link .*: File exists; choose an unused name"
        ):
            echo_link().pty(name)
        assert answers(name)


@pytest.mark.parametrize("kind", ["file", "folder", "link to a file"])
def test_nothing_else_is_overwritten(tmp_path: Path, kind: str) -> None:
    name = tmp_path / "taken"
    if kind == "folder":
        name.mkdir()
    else:
        name.write_text("precious")
    if kind == "link to a file":
        name = tmp_path / "link"
        name.symlink_to(tmp_path / "taken")
    with pytest.raises(
        ServingError, match=r"(?s)symbolic link .*: File exists; choose an unused name"
    ):
        echo_link().pty(name)
    assert kind == "folder" or (tmp_path / "taken").read_text() == "precious"
    assert name.exists()


def test_a_link_that_was_changed_is_not_removed(tmp_path: Path) -> None:
    name = tmp_path / "x-stage"
    with echo_link().pty(name):
        name.unlink()
        name.symlink_to("elsewhere")
    assert os.readlink(name) == "elsewhere"


def test_a_missing_directory_is_a_serving_error(tmp_path: Path) -> None:
    with pytest.raises(ServingError, match="a directory that you can write to"):
        echo_link().pty(tmp_path / "no" / "x-stage")


def test_a_program_that_does_not_read_uses_bounded_memory() -> None:
    frame = 1000
    with echo_link().pty() as served, port(served.url) as line:

        def flood() -> int:
            for number in range(100):
                served.link.far_end.on_send(bytes([number]) * frame)
            return served.link._backlog()

        end = time.monotonic() + PATIENCE
        while not served.link.dropped:
            assert served.call(flood) <= BACKLOG
            assert time.monotonic() < end
        sent = served.link.sent
        said = line.read(sent * frame)
        assert len(said) == sent * frame
        assert all(len(set(said[at : at + frame])) == 1 for at in range(0, len(said), frame))
        until(lambda: served.call(served.link._backlog) == 0)
        line.write(b"alive")
        assert line.read(5) == b"alive"


def test_a_system_without_pseudo_terminals_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    imported = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name in ("pty", "tty"):
            raise ImportError(name)
        return imported(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ServingError, match="no pseudo-terminals; use TCP instead"):
        echo_link().pty()


def test_a_unit_answers_on_a_pseudo_terminal() -> None:
    with virtual.TDC001().pty() as served, port(served.url) as line:
        line.write(bytes.fromhex("05 00 00 00 50 01"))
        assert line.read(90)[:2] == b"\x06\x00"
