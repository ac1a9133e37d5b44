"""Behaviour shared by all links, for threads and for asyncio."""

from __future__ import annotations

import random

import pytest
from far_ends import CAN_BE_LOST, KINDS, FarEnd
from hosts import HOSTS, Loop, Threads

from stagewire.errors import TransportLostError

# pyserial names the thread of rfc2217:// with a method that Python has deprecated
pytestmark = [
    pytest.mark.filterwarnings("ignore:set(Daemon|Name)\\(\\) is deprecated"),
    pytest.mark.parametrize("way", HOSTS),
]
EVERY_BYTE = bytes(range(256))
Host = Threads | Loop


@pytest.mark.parametrize("kind", KINDS)
class TestAnyLine:
    def test_every_byte_is_echoed(self, host: Host) -> None:
        host.write(EVERY_BYTE)
        assert host.read(256) == EVERY_BYTE

    def test_every_byte_is_echoed_when_sent_alone(self, host: Host) -> None:
        for value in EVERY_BYTE:
            host.write(bytes([value]))
        assert host.read(256) == EVERY_BYTE

    def test_64_kib_in_one_write(self, host: Host) -> None:
        data = random.Random(64).randbytes(65_536)
        host.write(data)
        assert host.read(len(data)) == data

    def test_closed_twice_and_then_unusable(self, host: Host) -> None:
        host.link.close() if isinstance(host, Threads) else host._runner.run(host.link.close())
        with pytest.raises(TransportLostError, match="was closed by this side"):
            host.write(b"x")

    def test_opened_again_after_closing(self, way: str, far_end: FarEnd) -> None:
        for _ in range(2):
            host = HOSTS[way](far_end.url)
            host.write(b"again")
            assert host.read(5) == b"again"
            host.close()


@pytest.mark.parametrize("kind", CAN_BE_LOST)
class TestLostLine:
    def test_a_waiting_reader_gets_the_loss(self, host: Host, far_end: FarEnd) -> None:
        host.write(b"alive")
        assert host.read(5) == b"alive"
        far_end.hang_up()
        loss = host.wait_lost()
        assert type(loss) is TransportLostError
        assert far_end.url in str(loss)
        assert "then read the state" in str(loss)

    def test_later_writes_fail(self, host: Host, far_end: FarEnd) -> None:
        far_end.hang_up()
        loss = host.wait_lost()
        with pytest.raises(TransportLostError) as second:
            host.write(b"move")
        assert second.value is not loss
        assert str(second.value) == str(loss)

    def test_bytes_before_the_loss_are_still_read(self, host: Host, far_end: FarEnd) -> None:
        host.write(EVERY_BYTE)
        host.read(256)
        far_end.hang_up()
        host.wait_lost()
        assert host.heard == EVERY_BYTE
