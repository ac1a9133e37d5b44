"""Unsolicited events: subscriptions of threads and of tasks."""

from __future__ import annotations

import asyncio
import logging
import threading
from typing import Any

import pytest
from scripted_links import USB, AsyncTestLink, TestLink, answer, velocity

from stagewire.errors import (
    OutOfRangeError,
    ReplyTimeoutError,
    SessionClosedError,
    StagewireError,
    TransportLostError,
)
from stagewire.sessions import AsyncFramedSession, FramedSession
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_virtual import stepped

HOMED = m.MotMoveHomed(1)
reading = pytest.mark.parametrize("background", [True, False], ids=["background", "no thread"])


def homed(chan: int = 1) -> bytes:
    return m.MotMoveHomed(chan).pack(1, USB)


@reading
def test_a_thread_gets_the_wanted_events(background: bool) -> None:
    link = TestLink(answer)
    with FramedSession(PROTOCOL, link, background=background) as session:
        with session.subscribe(m.MotMoveHomed) as homings, session.subscribe() as everything:
            link.say(homed())
            event: Any = homings.get(5)
            assert event.frame.message == HOMED
            session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), USB)
            link.say(velocity().pack(1, USB))
            assert [everything.get(5).raw for _ in range(2)] == [homed(), velocity().pack(1, USB)]
            for timeout in (0, 0.02, -1, float("nan")):
                with pytest.raises(ReplyTimeoutError):
                    homings.get(timeout)
        with pytest.raises(SessionClosedError):
            homings.get()


@reading
def test_received_events_can_be_taken_without_waiting(background: bool) -> None:
    link = TestLink()
    with FramedSession(PROTOCOL, link, background=background) as session:
        homings = session.subscribe(m.MotMoveHomed)
        link.say(homed())
        if background:
            session.pause(0.05)
        assert homings.get(0).raw == homed()


@reading
def test_an_iteration_ends_with_the_session(background: bool) -> None:
    link = TestLink()
    session = FramedSession(PROTOCOL, link, background=background)
    closing = threading.Timer(0.05, session.close)
    homings = session.subscribe(m.MotMoveHomed)
    link.say(homed() * 3)
    closing.start()
    assert [event.raw for event in homings] == [homed()] * 3
    closing.join()


@reading
def test_an_iteration_ends_with_its_subscription(background: bool) -> None:
    link = TestLink()
    with FramedSession(PROTOCOL, link, background=background) as session:
        homings = session.subscribe(m.MotMoveHomed)
        closing = threading.Timer(0.05, homings.close)
        closing.start()
        assert list(homings) == []
        closing.join()


@reading
def test_the_loss_of_the_link_is_raised_after_earlier_events(background: bool) -> None:
    link = TestLink()
    with FramedSession(PROTOCOL, link, background=background) as session:
        homings = session.subscribe(m.MotMoveHomed)
        link.say(homed())
        threading.Timer(0.05, link.unplug).start()
        assert next(homings).raw == homed()
        for _ in range(2):
            with pytest.raises(TransportLostError):
                next(homings)


@reading
def test_several_threads_share_a_subscription(background: bool) -> None:
    link = TestLink()
    got: list[bytes] = []
    with FramedSession(PROTOCOL, link, background=background) as session:
        homings = session.subscribe(m.MotMoveHomed)
        threads = [
            threading.Thread(target=lambda: got.append(homings.get(30).raw)) for _ in range(4)
        ]
        for thread in threads:
            thread.start()
        for chan in range(1, 5):
            link.say(homed(chan))
        for thread in threads:
            thread.join(30)
    assert sorted(got) == [homed(chan) for chan in range(1, 5)]


def test_events_that_are_not_taken_are_dropped_counted_and_reported(
    caplog: pytest.LogCaptureFixture,
) -> None:
    link = TestLink()
    with FramedSession(PROTOCOL, link, background=False) as session:
        homings = session.subscribe(m.MotMoveHomed, limit=3)
        with caplog.at_level(logging.WARNING, "stagewire"):
            link.say(b"".join(map(homed, range(1, 11))))
            session.pause(0.001)
        assert (len(homings), homings.limit, homings.dropped) == (3, 3, 7)
        assert session.statistics.dropped == 7
        assert [homings.get(0).raw for _ in range(3)] == list(map(homed, (8, 9, 10)))
        assert len(caplog.records) == 1
        with pytest.raises(OutOfRangeError):
            session.subscribe(limit=0)


def test_a_failing_condition_ends_only_its_subscription() -> None:
    link = TestLink(answer)
    with FramedSession(PROTOCOL, link) as session:
        failing = session.subscribe(lambda event: 1 // 0)
        link.say(homed())
        with pytest.raises(StagewireError, match="condition of the subscription failed"):
            failing.get(5)
        session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), USB)


def test_a_task_gets_the_wanted_events() -> None:
    async def main() -> None:
        link = AsyncTestLink(answer)
        async with AsyncFramedSession(PROTOCOL, link) as session:
            async with session.subscribe(m.MotMoveHomed) as homings:
                link.say(homed())
                assert (await homings.get(5)).raw == homed()
                for timeout in (0, 5):
                    with pytest.raises(ReplyTimeoutError):
                        await homings.get(timeout)
                waiting = asyncio.create_task(homings.get())
                await asyncio.sleep(0)
                waiting.cancel()
                link.say(homed())
                assert (await homings.get(5)).raw == homed()
            with pytest.raises(SessionClosedError):
                await homings.get()

    stepped.run(main())


@pytest.mark.parametrize("end", ["subscription", "session", "line"])
def test_an_iteration_of_a_task_ends(end: str) -> None:
    async def main() -> None:
        link = AsyncTestLink()
        session = AsyncFramedSession(PROTOCOL, link)
        homings = session.subscribe(m.MotMoveHomed)

        async def collect() -> list[bytes]:
            return [event.raw async for event in homings]

        task = asyncio.create_task(collect())
        link.say(homed() * 3)
        await asyncio.sleep(1)
        match end:
            case "subscription":
                homings.close()
            case "session":
                await session.close()
            case "line":
                link.unplug()
        if end == "line":
            with pytest.raises(TransportLostError):
                await task
        else:
            assert await task == [homed()] * 3
        await session.close()

    stepped.run(main())
