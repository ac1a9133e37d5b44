"""Controllers served by TCP, opened with plain sockets and with pyserial's socket://."""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
import serial
from echo_instrument import TICK, EchoInstrument, Notebook

import stagewire_virtual as virtual
from stagewire_virtual.clock import SECOND, Clock, SteppedClock
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.errors import ServingError, VirtualError
from stagewire_virtual.serving.link import BACKLOG
from stagewire_virtual.serving.server import ServedController

PATIENCE = 20.0
REQ_INFO = bytes.fromhex("05 00 00 00 50 01")
START_UPDATES = bytes.fromhex("11 00 00 00 50 01")


def echo_link(clock: SteppedClock | None = None) -> VirtualController:
    return VirtualController(EchoInstrument, clock, "echo")


@contextmanager
def host(served: ServedController) -> Iterator[socket.socket]:
    address, _, port = served.url.removeprefix("socket://").rpartition(":")
    with socket.create_connection((address.strip("[]"), int(port)), timeout=PATIENCE) as line:
        yield line


def read(line: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size and (more := line.recv(size - len(data))):
        data += more
    return data


def speaks(served: ServedController) -> bool:
    with host(served) as line:
        line.sendall(b"alive")
        return read(line, 5) == b"alive"


def until(condition: Callable[[], bool]) -> None:
    """Wait for a condition, at most PATIENCE seconds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        threading.Event().wait(0.002)


def test_a_served_controller_gives_the_same_answer_as_in_memory() -> None:
    with (
        virtual.TDC001(seed=1).tcp() as served,
        serial.serial_for_url(served.url, timeout=PATIENCE) as port,
    ):
        assert served.url.startswith("socket://127.0.0.1:")
        port.write(REQ_INFO)
        said = port.read(90)
    with virtual.TDC001(seed=1) as in_memory:
        in_memory.write(REQ_INFO)
        assert said == in_memory.read()


def test_updates_arrive_in_real_time() -> None:
    with virtual.TDC001().tcp() as served, host(served) as line:
        line.sendall(START_UPDATES)
        began = time.monotonic()
        assert read(line, 40)[:2] == read(line, 20)[:2] == b"\x91\x04"
        assert (
            time.monotonic() - began > 0.25
        )  # three updates, 100 ms apart; the first after 100 ms


@pytest.mark.parametrize("address", ["127.0.0.1:0", "[::1]:0"])
def test_ipv4_and_ipv6_loopback_addresses_work(address: str) -> None:
    with echo_link().tcp(address) as served, host(served) as line:
        line.sendall(b"hello")
        assert read(line, 5) == b"hello"


def test_a_second_host_is_turned_away_with_a_note() -> None:
    with echo_link().tcp() as served:
        book = served.link.observer = Notebook()
        with host(served) as first:
            first.sendall(b"first")
            assert read(first, 5) == b"first"
            with host(served) as second:
                assert second.recv(1) == b""
                names = ["{}:{}".format(*line.getsockname()[:2]) for line in (second, first)]
            first.sendall(b"still")
            assert read(first, 5) == b"still"
        said = "{} turned away: a line has one host, and {} is connected".format(*names)
        assert said in book.notes


def test_hosts_can_connect_one_after_another() -> None:
    with echo_link().tcp() as served:
        for number in range(20):
            with host(served) as line:
                line.sendall(b"%02d" % number)
                assert read(line, 2) == b"%02d" % number


def test_messages_without_a_host_are_lost() -> None:
    with echo_link(SteppedClock()).tcp() as served:
        with host(served) as line:
            line.sendall(b"t")
            served.advance(0.01)
            assert read(line, 5) == TICK
        until(lambda: not served.link.connected)
        served.advance(10)
        assert served.link.sent == 1
        with host(served) as line:
            line.sendall(b"s")
            served.advance(10)
            line.sendall(b"hello")
            assert read(line, 5) == b"hello"


def test_a_delayed_frame_does_not_reach_the_next_host() -> None:
    tdc = virtual.TDC001(clock=SteppedClock(), faults=["to_host delay frame by=5"])
    with tdc.tcp() as served:
        with host(served) as line:
            line.sendall(REQ_INFO)
            until(lambda: served.call(lambda: served.link.received) == len(REQ_INFO))
        until(lambda: not served.link.connected)
        with host(served):
            until(lambda: served.link.connected)
            served.advance(10)
            assert served.link.sent == 0


def test_a_host_that_does_not_read_loses_whole_frames() -> None:
    frame = 1000
    with echo_link().tcp() as served, host(served) as line:
        until(lambda: served.link.connected)

        def flood(frames: int) -> int:
            for number in range(frames):
                served.link.far_end.on_send(bytes([number % 251]) * frame)
            return served.link._backlog()

        end = time.monotonic() + PATIENCE
        while not served.link.dropped:
            assert served.call(flood, 1000) <= BACKLOG
            assert time.monotonic() < end
        sent = served.link.sent
        said = read(line, sent * frame)
        frames = [said[at : at + frame] for at in range(0, len(said), frame)]
        assert len(frames) == sent
        assert all(len(set(each)) == 1 for each in frames)
        line.sendall(b"alive")
        assert read(line, 5) == b"alive"


def test_advancing_first_processes_bytes_of_the_host() -> None:
    with echo_link(SteppedClock()).tcp() as served:
        for _ in range(20):
            with host(served) as line:
                line.sendall(b"t")
                served.advance(0.01)
                assert read(line, 5) == TICK
                line.sendall(b"s")
                served.advance(0.01)
            until(lambda: not served.link.connected)


def test_controllers_that_share_a_clock_advance_together() -> None:
    clock = SteppedClock()
    with (
        echo_link(clock).tcp() as one,
        echo_link(clock).tcp() as other,
        host(one) as a,
        host(other) as b,
    ):
        a.sendall(b"t")
        b.sendall(b"t")
        one.advance(0.02)
        assert read(a, 10) == read(b, 10) == 2 * TICK


def test_real_time_cannot_be_advanced() -> None:
    with (
        echo_link().tcp() as served,
        pytest.raises(VirtualError, match=r"cannot advance real time.*clock=SteppedClock"),
    ):
        served.advance(1)


def test_a_host_can_reconnect_after_unplugging() -> None:
    with echo_link().tcp() as served:
        with host(served) as line:
            line.sendall(b"hello")
            assert read(line, 5) == b"hello"
            served.unplug()
            assert line.recv(1) == b""
        with host(served) as line:
            line.sendall(b"again")
            assert read(line, 5) == b"again"


def test_a_fault_can_disconnect_within_a_frame() -> None:
    with (
        virtual.TDC001(faults=["to_host disconnect byte at=7"]).tcp() as served,
        host(served) as line,
    ):
        line.sendall(REQ_INFO)
        assert 0 < len(read(line, 90)) < 90


def test_a_port_in_use_is_named_in_the_error() -> None:
    with echo_link().tcp() as served:
        address = served.url.removeprefix("socket://")
        with pytest.raises(
            ServingError, match=rf"cannot listen on {address}: address already in use"
        ):
            echo_link().tcp(address)
        with pytest.raises(ServingError, match="already in use"):
            echo_link().tcp(int(address.rpartition(":")[2]))


def test_a_network_address_requires_bind() -> None:
    with pytest.raises(ServingError, match="every host that connects is obeyed"):
        echo_link().tcp("0.0.0.0:0")
    with pytest.raises(ServingError, match="address to bind to is empty"):
        echo_link().tcp(bind="")
    with echo_link().tcp(bind="0.0.0.0") as served:
        assert served.url.startswith("socket://0.0.0.0:")


def test_the_thread_ends_with_the_last_controller() -> None:
    def threads() -> list[str]:
        return [thread.name for thread in threading.enumerate()]

    assert "stagewire-virtual" not in threads()
    one, other = echo_link().tcp(), echo_link().tcp()
    assert threads().count("stagewire-virtual") == 1
    one.close()
    one.close()
    assert "stagewire-virtual" in threads()
    other.close()
    assert "stagewire-virtual" not in threads()
    with pytest.raises(VirtualError, match="echo is no longer served"):
        one.power_cycle()


def test_closing_a_controller_closes_those_served_from_it() -> None:
    with echo_link() as in_memory:
        served = in_memory.tcp()
    assert "(closed)" in repr(served)


def test_calls_run_in_the_server_thread_and_raise_in_the_caller() -> None:
    with echo_link().tcp() as served:
        assert served.call(threading.current_thread).name == "stagewire-virtual"
        assert served.call(lambda: served.call(divmod, 7, 2)) == (3, 1)
        with pytest.raises(ZeroDivisionError):
            served.call(divmod, 1, 0)
        served.call(served.instrument.receive, b"t")
        served.power_cycle()
        assert not served.call(lambda: served.instrument.ticking)


def test_system_exit_in_a_call_reaches_only_the_caller() -> None:
    with echo_link().tcp() as served:
        with pytest.raises(SystemExit, match="3"):
            served.call(sys.exit, 3)
        assert speaks(served)


def test_the_server_thread_cannot_serve_or_close_controllers() -> None:
    with echo_link().tcp() as served:
        for waits_for_itself in (served.close, echo_link().tcp):
            with pytest.raises(VirtualError, match="do it from another thread"):
                served.call(waits_for_itself)
        assert speaks(served)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_forked_process_has_its_own_server_thread() -> None:
    with echo_link().tcp() as served:
        child = os.fork()
        if not child:
            signal.alarm(round(PATIENCE))  # ends a child that hangs
            status = 1
            try:
                with echo_link().tcp() as own:
                    assert speaks(own)
                with pytest.raises(VirtualError, match="not running in this process"):
                    served.close()
                status = 0
            finally:
                os._exit(status)
        assert os.waitpid(child, 0)[1] == 0
        assert speaks(served)


def test_a_stepped_clock_runs_in_the_thread_of_its_controllers() -> None:
    clock = SteppedClock()
    threads: list[str] = []
    clock.call_later(1, lambda: threads.append(threading.current_thread().name))
    clock.call_later(SECOND, lambda: threads.append(threading.current_thread().name))
    with echo_link(clock) as in_memory, in_memory.tcp() as served, host(served) as line:
        line.sendall(b"t")
        in_memory.advance(0.01)
        assert read(line, 5) == TICK
        assert threads == ["stagewire-virtual"]
    clock.advance(1)
    assert threads[1:] == [threading.current_thread().name]


def test_closing_reports_a_failed_controller() -> None:
    served = echo_link().tcp()
    with host(served) as line:
        line.sendall(b"!")
        assert line.recv(1) == b""
    with pytest.raises(VirtualError, match="the instrument failed"):
        served.close()


def test_a_failed_controller_does_not_prevent_closing_others() -> None:
    in_memory = echo_link()
    one, other = in_memory.tcp(), in_memory.tcp()
    with host(other) as line:
        line.sendall(b"!")
        assert line.recv(1) == b""
    with pytest.raises(VirtualError, match="the instrument failed"):
        in_memory.close()
    assert all("(closed)" in repr(served) for served in (one, other))
    assert all(thread.name != "stagewire-virtual" for thread in threading.enumerate())


def test_a_maker_that_raises_leaves_no_server_thread() -> None:
    def refuse(clock: Clock) -> EchoInstrument:
        if not isinstance(clock, SteppedClock):
            raise VirtualError("no instrument today")
        return EchoInstrument(clock)

    with pytest.raises(VirtualError, match="no instrument today"):
        VirtualController(refuse).tcp()
    assert all(thread.name != "stagewire-virtual" for thread in threading.enumerate())
