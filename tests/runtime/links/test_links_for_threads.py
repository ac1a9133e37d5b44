"""Behaviour of links for threads only: timeouts, waking, several threads, stalled links."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from far_ends import KINDS, FarEnd
from hosts import PATIENCE

from stagewire._links.descriptor import Readiness
from stagewire._links.pumped import PumpedLink
from stagewire.errors import TransportLostError
from stagewire.links import Link, open_link

pytestmark = pytest.mark.filterwarnings("ignore:set(Daemon|Name)\\(\\) is deprecated")
_SOON = 0.02  # seconds that a read waits when nothing arrives


@pytest.fixture
def link(far_end: FarEnd) -> Iterator[Link]:
    with open_link(far_end.url) as opened:
        yield opened


@contextmanager
def thread(call: Callable[[], Any]) -> Iterator[list[Any]]:
    """Run a call in another thread; the list holds its result or error after the block."""
    ended: list[Any] = []

    def run() -> None:
        try:
            ended.append(call())
        except TransportLostError as error:
            ended.append(error)

    beside = threading.Thread(target=run)
    begun = time.monotonic()
    beside.start()
    yield ended
    beside.join(PATIENCE)
    assert not beside.is_alive()
    assert time.monotonic() - begun < PATIENCE / 2, "it ended by its timeout"


def heard_more(link: Link) -> bytes:
    more = link.read(PATIENCE)
    assert more
    return more


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


@pytest.mark.parametrize("kind", KINDS)
class TestReading:
    def test_nothing_arrives(self, link: Link) -> None:
        assert link.read(_SOON) == b""
        assert link.read(0) == b""
        assert link.read(-1) == b""

    def test_available_bytes_are_read_without_waiting(self, link: Link) -> None:
        heard = bytearray()
        link.write(b"heard")
        until(lambda: len(heard.__iadd__(link.read(0))) == 5)
        assert heard == b"heard"

    def test_woken_while_reading(self, link: Link) -> None:
        with thread(lambda: link.read(PATIENCE)) as ended:
            link.wake()
        assert ended == [b""]

    def test_woken_before_reading(self, link: Link) -> None:
        link.wake()
        link.wake()
        assert link.read(PATIENCE) == b""
        assert link.read(_SOON) == b""

    def test_waking_loses_no_bytes(self, link: Link) -> None:
        heard = b""
        link.write(b"whole")
        for _ in range(1000):
            link.wake()
            heard += link.read(PATIENCE)
            if len(heard) == 5:
                break
            time.sleep(0.001)
        assert heard == b"whole"

    def test_another_thread_writes_during_a_read(self, link: Link) -> None:
        with thread(lambda: link.read(PATIENCE)) as ended:
            link.write(b"!")
        assert ended == [b"!"]

    def test_another_thread_closes_during_a_read(self, link: Link) -> None:
        with thread(lambda: link.read(PATIENCE)) as ended:
            link.close()
        assert "closed by this side" in str(ended[0])

    def test_read_after_closing(self, link: Link) -> None:
        link.close()
        for timeout in (0, PATIENCE):
            with pytest.raises(TransportLostError, match="closed by this side"):
                link.read(timeout)
        link.wake()
        link.write_now(b"x")

    def test_written_from_many_threads(self, link: Link) -> None:
        """The bytes of each write stay together."""
        heard = b""
        words = [bytes([letter]) * 50 for letter in b"abcd"]

        def write(word: bytes) -> None:
            for _ in range(20):
                link.write(word)

        beside = [threading.Thread(target=write, args=(word,)) for word in words]
        for one in beside:
            one.start()
        while len(heard) < 4 * 20 * 50:
            heard += heard_more(link)
        for one in beside:
            one.join()
        assert sorted(heard[at : at + 50] for at in range(0, len(heard), 50)) == sorted(words * 20)

    def test_write_now(self, link: Link) -> None:
        link.write_now(b"stop")
        heard = b""
        while len(heard) < 4:
            heard += heard_more(link)
        assert heard == b"stop"


class TestStalled:
    """The far end is connected but reads nothing."""

    @pytest.fixture
    def deaf(self) -> Iterator[tuple[str, socket.socket]]:
        with socket.create_server(("127.0.0.1", 0)) as listener:
            yield f"socket://127.0.0.1:{listener.getsockname()[1]}", listener

    def test_lost_after_the_stall_timeout(self, deaf: tuple[str, socket.socket]) -> None:
        with open_link(deaf[0], stall_timeout=0.05) as link:
            with pytest.raises(TransportLostError, match=r"it accepted no bytes for 0.05 s"):
                link.write(bytes(50_000_000))
            with pytest.raises(TransportLostError, match="accepted no bytes"):
                link.read(PATIENCE)

    def test_closed_during_a_write(self, deaf: tuple[str, socket.socket]) -> None:
        with open_link(deaf[0], stall_timeout=3600) as link:
            with thread(lambda: link.write(bytes(50_000_000))) as ended:
                time.sleep(0.05)  # let the write begin
                link.close()
            assert "closed by this side" in str(ended[0])

    def test_lost_when_a_write_is_interrupted(
        self, deaf: tuple[str, socket.socket], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The next write would be mistaken for the rest of the interrupted one."""

        def interrupted(readiness: Readiness, timeout: float) -> bool:
            raise KeyboardInterrupt

        with open_link(deaf[0]) as link:
            monkeypatch.setattr(Readiness, "writable", interrupted)
            with pytest.raises(KeyboardInterrupt):
                link.write(bytes(50_000_000))
            monkeypatch.undo()
            with pytest.raises(TransportLostError, match="interrupted halfway"):
                link.write(b"stop")

    def test_bytes_that_are_read_slowly_are_all_sent(self, deaf: tuple[str, socket.socket]) -> None:
        size = 8_000_000
        with open_link(deaf[0], stall_timeout=PATIENCE) as link:
            far = deaf[1].accept()[0]
            with far, thread(lambda: link.write(bytes(size))):
                while size:
                    size -= len(far.recv(min(size, 65_536)))

    def test_a_stop_written_before_closing_arrives(self, deaf: tuple[str, socket.socket]) -> None:
        """The host has unread bytes, and the controller has much to read before the stop."""
        link = open_link(deaf[0])
        far = deaf[1].accept()[0]
        with far:
            far.sendall(bytes(100_000))
            until(lambda: link.read(0) != b"")
            link.write(bytes(1_000_000) + b"stop")
            link.close()
            heard = bytearray()
            while data := far.recv(65_536):
                heard += data
            assert heard.endswith(b"stop")


def test_a_port_whose_read_ends_early_is_lost() -> None:
    """The read was not cancelled and has no timeout. A second read might wait indefinitely."""

    class Port:
        port = "COM9"
        in_waiting = 3

        def __init__(self) -> None:
            self.said = [b"a", b"bc"]

        def read(self, size: int) -> bytes:
            return self.said.pop(0)

        def close(self) -> None:
            pass

    with PumpedLink("COM9", Port()) as link:
        assert link.read(PATIENCE) == b"abc"
        with pytest.raises(TransportLostError, match="hung up"):
            link.read(PATIENCE)
