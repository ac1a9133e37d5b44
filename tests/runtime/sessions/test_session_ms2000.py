"""Sessions with a controller whose replies have no frame, for threads and for asyncio."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from scripted_links import AsyncTestLink, TestLink

from stagewire.capture import read_capture
from stagewire.errors import OutOfRangeError, ReplyTimeoutError, WrongModeError
from stagewire.links import open_async_link, open_link
from stagewire.sessions import AsyncCommandSession, CommandSession
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as m
from stagewire_virtual import stepped

X = 24
URL = "virtual://MS2000"
TARGET = 1_000_000  # 100 mm, so that the axis is still moving when stopped


@pytest.mark.parametrize("background", [True, False], ids=["background", "no thread"])
def test_both_formats_for_threads(background: bool, tmp_path: Path) -> None:
    log = tmp_path / "log"
    with CommandSession(PROTOCOL, open_link(URL), background=background, log=log) as session:
        assert session.mode == "unknown"
        with pytest.raises(WrongModeError):
            session.ask(m.ReadMotorPosition(), X)
        session.send(m.SwitchToHighLevel())
        assert session.text("W X").startswith(":A")
        assert session.mode == "high_level"
        session.send(m.SwitchToLowLevel())
        session.send(m.WriteTargetPosition(TARGET), X)
        session.halt(m.StopMotor(), X)
        assert 0 <= session.ask(m.ReadMotorPosition(), X).position < TARGET
        with pytest.raises(WrongModeError):
            session.text("W X")
    said = [one.comment for one in read_capture(log).recorded]
    assert said[0] == "SWITCH_TO_HIGH_LEVEL"
    assert said[-1] == "reply to READ_MOTOR_POSITION"


def test_both_formats_for_asyncio() -> None:
    async def main() -> None:
        async with AsyncCommandSession(PROTOCOL, await open_async_link(URL)) as session:
            with pytest.raises(WrongModeError):
                await session.ask(m.ReadMotorPosition(), X)
            await session.send(m.SwitchToHighLevel())
            assert (await session.text("W X")).startswith(":A")
            assert session.mode == "high_level"
            await session.send(m.SwitchToLowLevel())
            await session.send(m.WriteTargetPosition(TARGET), X)
            await session.halt(m.StopMotor(), X)
            assert (await session.ask(m.ReadMotorPosition(), X)).position == 0

    stepped.run(main())


@pytest.mark.parametrize("background", [True, False], ids=["background", "no thread"])
def test_eight_threads_read_one_after_the_other(background: bool) -> None:
    """Replies have three bytes and nothing to identify them, but each thread gets that of its axis."""

    def answer(data: bytes) -> bytes:
        return bytes((data[0], 0, 0)) if data[:1] != b"\xff" else b""

    def read(axis: int) -> None:
        for _ in range(50):
            reply = session.ask(m.ReadMotorPosition(), axis)
            if reply != m.ReadMotorPositionReply(axis):
                wrong.append(reply)

    wrong: list[object] = []
    with CommandSession(PROTOCOL, TestLink(answer), background=background) as session:
        session.send(m.SwitchToLowLevel())
        threads = [threading.Thread(target=read, args=(axis,)) for axis in range(1, 9)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
    assert not wrong


def test_a_stop_overtakes_a_waiting_read() -> None:
    link = TestLink()
    with CommandSession(PROTOCOL, link) as session:
        session.send(m.SwitchToLowLevel())

        def read() -> None:
            with pytest.raises(ReplyTimeoutError):
                session.ask(m.ReadStatus(), X, 0.3)

        waiting = threading.Thread(target=read)
        waiting.start()
        while len(link.written) < 2:
            session.pause(0.001)
        session.halt(m.StopMotor(), X)
        assert link.written[-1] == bytes((X, 66, 0x3A))
        waiting.join()


def test_values_that_contain_a_switch_are_refused_on_request() -> None:
    value = int.from_bytes(b"\xff\x41\x00", "little")

    async def main() -> None:
        link = AsyncTestLink()
        async with AsyncCommandSession(PROTOCOL, link, refuse_prefix_bytes=True) as session:
            await session.send(m.SwitchToLowLevel())
            with pytest.raises(OutOfRangeError, match="SWITCH_TO_HIGH_LEVEL"):
                await session.send(m.WriteTargetPosition(value), X)
            assert len(link.written) == 1

    stepped.run(main())
