"""What every line does, whatever it is made of, for threads and for asyncio."""

from __future__ import annotations

import random

import pytest
from far_ends import CAN_BE_LOST, KINDS, FarEnd
from hosts import HOSTS, Loop, Threads

from stagewire.errors import TransportLostError

# pyserial names the thread of rfc2217:// in a way that Python has given up
pytestmark = [
    pytest.mark.filterwarnings("ignore:set(Daemon|Name)\\(\\) is deprecated"),
    pytest.mark.parametrize("way", HOSTS),
]
EVERY_BYTE = bytes(range(256))
Host = Threads | Loop


@pytest.mark.parametrize("kind", KINDS)
class TestAnyLine:
    def test_every_byte_goes_there_and_back(self, host: Host) -> None:
        host.write(EVERY_BYTE)
        assert host.read(256) == EVERY_BYTE

    def test_every_byte_by_itself(self, host: Host) -> None:
        for value in EVERY_BYTE:
            host.write(bytes([value]))
        assert host.read(256) == EVERY_BYTE

    def test_64_kib_at_once(self, host: Host) -> None:
        data = random.Random(64).randbytes(65_536)
        host.write(data)
        assert host.read(len(data)) == data

    def test_closed_twice_and_used_no_more(self, host: Host) -> None:
        host.link.close() if isinstance(host, Threads) else host._runner.run(host.link.close())
        with pytest.raises(TransportLostError, match="was closed by this side"):
            host.write(b"x")

    def test_opened_again_when_it_was_closed(self, way: str, far_end: FarEnd) -> None:
        for _ in range(2):
            host = HOSTS[way](far_end.url)
            host.write(b"again")
            assert host.read(5) == b"again"
            host.close()


@pytest.mark.parametrize("kind", CAN_BE_LOST)
class TestLostLine:
    def test_whoever_waits_hears_of_it(self, host: Host, far_end: FarEnd) -> None:
        host.write(b"alive")
        assert host.read(5) == b"alive"
        far_end.hang_up()
        loss = host.wait_lost()
        assert type(loss) is TransportLostError
        assert far_end.url in str(loss)
        assert "read the state again" in str(loss)

    def test_nothing_is_written_any_more(self, host: Host, far_end: FarEnd) -> None:
        far_end.hang_up()
        loss = host.wait_lost()
        with pytest.raises(TransportLostError) as second:
            host.write(b"move")
        assert second.value is not loss
        assert str(second.value) == str(loss)

    def test_what_was_said_before_still_comes(self, host: Host, far_end: FarEnd) -> None:
        host.write(EVERY_BYTE)
        host.read(256)
        far_end.hang_up()
        host.wait_lost()
        assert host.heard == EVERY_BYTE
