"""Sessions for asyncio."""

from __future__ import annotations

import asyncio
import select
import socket
import threading
from collections.abc import Callable

import pytest
from scripted_links import BAYS, HOST, USB, AsyncTestLink, answer, jog, silent, velocity

from stagewire.errors import (
    MotionStoppedError,
    MotionTimeoutError,
    ReplyTimeoutError,
    SessionClosedError,
    StagewireError,
    TransportLostError,
)
from stagewire.links import open_async_link
from stagewire.sessions import AsyncFramedSession, Ends
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_virtual import stepped

HOMED = Ends((m.MotMoveHomed,), (m.MotMoveStoppedHeader,))
STOPPED = Ends((m.MotMoveStoppedHeader,), ())
STOP = m.MotMoveStop(1, 2)


def session(link: AsyncTestLink) -> AsyncFramedSession:
    return AsyncFramedSession(PROTOCOL, link)


async def ask(
    session: AsyncFramedSession, dest: int = USB, timeout: float | None = None
) -> m.MotGetVelParams:
    frame = await session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), dest, timeout)
    assert isinstance(frame.message, m.MotGetVelParams)
    return frame.message


def test_a_request_gets_its_reply() -> None:
    async def main() -> None:
        link = AsyncTestLink(answer)
        async with session(link) as one:
            assert await ask(one) == velocity()
        assert link.written == [m.MotReqVelParams(1).pack(USB, 1)]
        assert link.closed

    stepped.run(main())


def test_a_silent_controller_costs_exactly_the_timeout() -> None:
    async def main() -> None:
        async with session(AsyncTestLink()) as one:
            before = one.now()
            with pytest.raises(ReplyTimeoutError):
                await ask(one, timeout=0.05)
            assert one.now() - before == pytest.approx(0.05)

    stepped.run(main())


def test_two_timeouts_end_at_their_own_times() -> None:
    async def main() -> None:
        async with session(AsyncTestLink()) as one:
            later = asyncio.create_task(ask(one, BAYS[0], timeout=30))
            await asyncio.sleep(0)
            with pytest.raises(ReplyTimeoutError):
                await ask(one, BAYS[1], timeout=0.05)
            assert one.now() == pytest.approx(0.05)
            with pytest.raises(ReplyTimeoutError):
                await later
            assert one.now() == pytest.approx(30)

    stepped.run(main())


def test_a_request_cancelled_while_waiting_is_never_sent() -> None:
    async def main() -> None:
        link = AsyncTestLink()
        async with session(link) as one:
            tasks = [asyncio.create_task(ask(one)) for _ in range(2)]
            await asyncio.sleep(0)
            tasks[1].cancel()
            await asyncio.wait([tasks[1]])
            assert one.statistics.cancelled == 1
            link.say(velocity().pack(1, USB))
            assert await tasks[0] == velocity()
            await one.pause(10)
        assert len(link.written) == 1

    stepped.run(main())


def test_a_hundred_tasks_get_their_own_replies() -> None:
    async def main() -> None:
        async with session(AsyncTestLink(answer)) as one:
            dests = [BAYS[n % 3] for n in range(100)]
            got = await asyncio.gather(*(ask(one, dest) for dest in dests))
            assert got == [velocity(1, dest) for dest in dests]

    stepped.run(main())


def test_waiting_for_a_motion() -> None:
    async def main() -> None:
        link = AsyncTestLink()
        ended: list[object] = []
        async with session(link) as one:
            motion = await one.begin(m.MotMoveHome(1), HOMED, USB, on_done=ended.append)
            assert link.written == [m.MotMoveHome(1).pack(USB, 1)]
            with pytest.raises(
                MotionTimeoutError, match="nothing was stopped, so you can wait again"
            ):
                await one.wait(motion, 0.01)
            assert not ended
            waiting = [asyncio.create_task(one.wait(motion)) for _ in range(3)]
            await asyncio.sleep(0)
            waiting[0].cancel()
            link.say(m.MotMoveHomed(1).pack(1, USB))
            assert (await waiting[1]).message == m.MotMoveHomed(1)
            assert await waiting[2] is await one.wait(motion)
            assert waiting[0].cancelled()
        assert ended == [motion]

    stepped.run(main())


def test_a_stopped_motion_raises() -> None:
    async def main() -> None:
        link = AsyncTestLink()
        async with session(link) as one:
            motion = await one.begin(m.MotMoveHome(1), HOMED, USB)
            link.answer = answer
            stopped = await one.halt(STOP, STOPPED, USB)
            assert stopped is not None
            assert stopped.message == m.MotMoveStoppedHeader(1)
            with pytest.raises(MotionStoppedError):
                await one.wait(motion)

    stepped.run(main())


def test_a_stop_overtakes_a_hundred_waiting_requests() -> None:
    async def main() -> None:
        link = AsyncTestLink()
        one = session(link)
        tasks = [asyncio.create_task(ask(one)) for _ in range(100)]
        await asyncio.sleep(0)
        await one.halt(STOP, None, USB)
        assert link.written[1:] == [STOP.pack(USB, 1)]
        link.unplug()
        failed = await asyncio.gather(*tasks, return_exceptions=True)
        assert all(isinstance(error, TransportLostError) for error in failed)
        assert len(set(map(id, failed))) == 100  # each caller gets its own
        await one.close()

    stepped.run(main())


def test_a_lost_link_ends_all_calls() -> None:
    async def main() -> None:
        link = AsyncTestLink()
        async with session(link) as one:
            motion = await one.begin(m.MotMoveHome(1), HOMED, USB)
            waiting = asyncio.create_task(one.pause(30))
            await asyncio.sleep(0)
            link.unplug()
            with pytest.raises(TransportLostError, match="the plug was pulled"):
                await waiting
            for call in (
                one.wait(motion), ask(one), one.pause(30), one.send(STOP, USB),
                one.begin(m.MotMoveHome(1), HOMED, USB),
            ):  # fmt: skip
                with pytest.raises(TransportLostError):
                    await call
            assert one.lost
            assert len(link.written) == 1
            assert one.now() < 1

    stepped.run(main())


def test_closing_ends_waiting_calls_and_stops_motions() -> None:
    async def main() -> None:
        link = AsyncTestLink()
        one = session(link)
        one.on_close.append(lambda: STOP.pack(USB, 1))
        tasks = [asyncio.create_task(ask(one)), asyncio.create_task(one.pause(30))]
        await asyncio.sleep(0)
        await one.close()
        await one.close()
        for failed in await asyncio.gather(*tasks, return_exceptions=True):
            assert isinstance(failed, SessionClosedError)
        with pytest.raises(SessionClosedError):
            await ask(one)
        assert link.written[-1] == STOP.pack(USB, 1)
        assert one.closed

    stepped.run(main())


def test_keep_alive_messages_are_sent_between_calls() -> None:
    async def main() -> None:
        link = AsyncTestLink()
        async with session(link) as one:
            ack = m.MotAckDcStatusUpdate()
            one.keep_alive(ack, (0x21, 0x22))
            await asyncio.sleep(60)
            for dest in (0x21, 0x22):
                assert 120 <= b"".join(link.written).count(ack.pack(dest, 1)) <= 122

    stepped.run(main())


def test_no_thread_is_started() -> None:
    async def main() -> None:
        before = threading.active_count()
        async with session(AsyncTestLink(answer)) as one:
            await ask(one)
            assert threading.active_count() == before

    asyncio.run(main())


def test_a_session_cannot_be_used_in_another_loop() -> None:
    async def opened() -> AsyncFramedSession:
        return session(AsyncTestLink(answer))

    async def used() -> None:
        with pytest.raises(StagewireError, match="another event loop"):
            await ask(one)
        with pytest.raises(StagewireError, match="another event loop"):
            await one.pause(1)

    first = stepped.SteppedEventLoop()
    one = first.run_until_complete(opened())
    stepped.run(used())
    first.run_until_complete(one.close())
    first.close()


def test_a_pause_takes_the_given_time() -> None:
    async def main() -> None:
        async with session(AsyncTestLink()) as one:
            await one.pause(3600)
            assert one.now() == 3600

    stepped.run(main())


# Cancelled at every await

Call = Callable[[AsyncFramedSession], object]
CALLS = {
    "ask": lambda one: ask(one),
    "send": lambda one: one.send(m.HwStopUpdateMsgs(), USB),
    "begin and wait": lambda one: home(one),
    "halt": lambda one: one.halt(STOP, STOPPED, USB),
}


async def home(one: AsyncFramedSession) -> object:
    return await one.wait(await one.begin(m.MotMoveHome(1), HOMED, USB))


@pytest.mark.parametrize("name", CALLS)
def test_a_call_cancelled_at_any_step_leaves_the_session_usable(name: str) -> None:
    """Another request waits before it. Both replies are late, and the next request gets its own reply."""

    async def main(steps: int) -> bool:
        link = AsyncTestLink()
        one = session(link)
        first = asyncio.create_task(ask(one))
        await asyncio.sleep(0)
        link.answer = answer
        task = asyncio.ensure_future(CALLS[name](one))  # type: ignore[arg-type,var-annotated]
        for step in range(steps):
            if step == 1:
                link.say(velocity().pack(1, USB))
            await asyncio.sleep(0)
        done = task.done()
        task.cancel()
        await asyncio.wait([task])
        link.answer = silent
        link.say(answer(b"".join(link.written)))  # repeat all replies
        await asyncio.sleep(0)
        link.answer = answer
        reply = await one.ask(m.MotReqJogParams(1), (m.MotGetJogParams,), USB, 5)
        assert reply.message == jog()
        await one.halt(STOP, STOPPED, USB, 5)
        assert isinstance(await home(one), object)
        await asyncio.wait([first])
        await one.close()
        return done

    steps = 0
    while not stepped.run(main(steps)):
        steps += 1
        assert steps < 50


def test_an_error_while_processing_bytes_ends_the_session(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(data: bytes, now: float) -> None:
        raise ZeroDivisionError("made up")

    async def main() -> None:
        async with session(AsyncTestLink(answer)) as one:
            monkeypatch.setattr(one._core, "receive", fail)
            with pytest.raises(TransportLostError, match="failed: ZeroDivisionError"):
                await ask(one, timeout=1000)
            assert one.now() < 1

    stepped.run(main())


def test_bytes_that_arrived_while_the_loop_was_busy_do_not_answer_a_later_request() -> None:
    """A program that computes for a while and then sends a request has not read the bytes before it."""
    early = m.MotGetVelParams(1, 1, 1, 1).pack(HOST, USB)
    with socket.create_server(("127.0.0.1", 0)) as listener:

        async def main() -> None:
            link = await open_async_link(f"socket://127.0.0.1:{listener.getsockname()[1]}")
            far, _ = listener.accept()
            with far:
                async with AsyncFramedSession(PROTOCOL, link) as session:
                    await asyncio.sleep(0)
                    far.sendall(early + early[:10])
                    select.select([link._socket], (), (), 30)  # type: ignore[attr-defined]
                    asking = asyncio.create_task(
                        session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), USB, 30)
                    )
                    loop = asyncio.get_running_loop()
                    assert await loop.run_in_executor(None, far.recv, 6)
                    far.sendall(velocity(1, USB).pack(HOST, USB))
                    assert (await asking).message == velocity(1, USB)

        asyncio.run(main())
