"""Sessions for threads: the behaviour for several callers."""

from __future__ import annotations

import itertools
import threading
import time

import pytest
from scripted_links import BAYS, HOST, TestLink, answer, jog, velocity

from stagewire._sessions.waiters import Waiter
from stagewire.errors import ReplyTimeoutError, StagewireError
from stagewire.links import LinkSettings
from stagewire.sessions import FramedSession, SessionOptions
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_virtual.linking import open_link

CALLS = 100
THREADS = 8

reading = pytest.mark.parametrize("background", [True, False], ids=["background", "no thread"])


def run_all(threads: list[threading.Thread]) -> None:
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
        assert not thread.is_alive()


@reading
def test_each_of_eight_threads_gets_its_own_replies(background: bool) -> None:
    wrong: list[object] = []

    def call(number: int) -> None:
        dest = BAYS[number % len(BAYS)]
        for turn in range(CALLS):
            if (number + turn) % 2:
                got = session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), dest)
                expected: object = velocity(1, dest)
            else:
                got = session.ask(m.MotReqJogParams(1), (m.MotGetJogParams,), dest)
                expected = jog(1, dest)
            if got.message != expected or got.source != dest:
                wrong.append((got, expected))

    with FramedSession(PROTOCOL, TestLink(answer), background=background) as session:
        run_all([threading.Thread(target=call, args=(n,)) for n in range(THREADS)])
    assert not wrong


@reading
def test_a_thread_that_stops_waiting_hands_over_reading(background: bool) -> None:
    """The first waiting thread gives up before the reply to the second arrives."""
    link = TestLink()
    got: list[object] = []

    def impatient() -> None:
        with pytest.raises(StagewireError):
            session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), BAYS[0], 0.1)
        link.say(velocity(1, BAYS[1]).pack(1, BAYS[1]))

    def patient() -> None:
        while not link.written:
            time.sleep(0.001)
        message = session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), BAYS[1], 30).message
        got.append(message)

    with FramedSession(PROTOCOL, link, background=background) as session:
        run_all([threading.Thread(target=impatient), threading.Thread(target=patient)])
    assert got == [velocity(1, BAYS[1])]


@reading
def test_a_paced_frame_is_written_when_its_pause_is_over(background: bool) -> None:
    """Frames without a reply are paced, no matter which threads send them and how long a write takes."""
    link = TestLink()
    times: list[tuple[float, float]] = []  # begin and end of each write
    write = link.write

    def timed(data: bytes) -> None:
        begin = time.monotonic()
        time.sleep(0.015)
        write(data)
        times.append((begin, time.monotonic()))

    link.write = timed  # type: ignore[method-assign]
    options = SessionOptions(pacing=0.02)
    with FramedSession(PROTOCOL, link, background=background, options=options) as session:
        run_all(
            [
                threading.Thread(target=session.send, args=(m.HwStopUpdateMsgs(), BAYS[0], 5))
                for _ in range(3)
            ]
        )
    assert len(times) == 3
    assert all(begin - end >= 0.02 for (_, end), (begin, _) in itertools.pairwise(times))


@reading
def test_a_virtual_controller_serves_eight_threads(background: bool) -> None:
    def call(number: int) -> None:
        for _ in range(20):
            if number % 2:
                got = session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), 0x50).message
            else:
                got = session.ask(m.MotReqJogParams(1), (m.MotGetJogParams,), 0x50).message
            right.append(isinstance(got, m.MotGetVelParams if number % 2 else m.MotGetJogParams))

    right: list[bool] = []
    link = open_link("virtual://TDC001", LinkSettings())
    with FramedSession(PROTOCOL, link, background=background) as session:
        run_all([threading.Thread(target=call, args=(n,)) for n in range(THREADS)])
    assert right == [True] * (20 * THREADS)


@reading
def test_a_blocked_write_does_not_delay_the_timeouts_of_other_calls(background: bool) -> None:
    """The link accepts no bytes. Only the thread that writes waits longer than its timeout."""
    taken, writing = threading.Event(), threading.Event()

    def take_slowly(data: bytes) -> bytes:
        writing.set()
        taken.wait(60)
        return answer(data)

    link = TestLink(take_slowly)
    with FramedSession(PROTOCOL, link, background=background) as session:
        first = threading.Thread(
            target=session.ask, args=(m.MotReqVelParams(1), (m.MotGetVelParams,), BAYS[0], 60)
        )
        first.start()
        assert writing.wait(60)
        for call in (
            lambda: session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), BAYS[1], 0.05),
            lambda: session.send(m.ModIdentify(), BAYS[1], 0.05),
        ):
            with pytest.raises(ReplyTimeoutError, match="was not sent"):
                call()
            assert first.is_alive()
        with pytest.raises(ReplyTimeoutError, match="it is sent as soon as it does"):
            session.halt(m.MotMoveStop(1, 2), None, BAYS[0], 0.05)
        taken.set()
        first.join(60)
        session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), BAYS[2])
    stop = m.MotMoveStop(1, 2).pack(BAYS[0], HOST)
    assert b"".join(link.written).count(stop) == 1


def test_a_thread_may_be_woken_twice() -> None:
    waiter = Waiter()
    waiter.end()
    waiter.nudge()
    assert waiter.done
    assert waiter.sleep(0)
    assert not waiter.sleep(0)


@reading
def test_a_request_after_half_a_frame_is_answered(background: bool) -> None:
    """The reply is not taken for the rest of the frame, which never arrives."""
    status = m.MotGetDcStatusUpdate(chan_ident=1, position=5, velocity=0, status_bits=0)
    raw = status.pack(HOST, BAYS[0])
    link = TestLink(answer)
    with FramedSession(PROTOCOL, link, background=background) as session:
        for length in range(1, len(raw)):
            with session.subscribe(m.MotGetDcStatusUpdate) as updates:
                link.say(raw + raw[:length])  # when the whole frame arrives, the half was read
                assert updates.get(30).frame.message.chan_ident == 1
            for dest in BAYS[:2]:
                frame = session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), dest, 30)
                assert frame.message == velocity(1, dest)


def test_only_the_reading_thread_detects_silence() -> None:
    """It is delayed between two reads, while the rest of a reply is unread and another thread runs."""
    reply = velocity(1, BAYS[0]).pack(HOST, BAYS[0])
    link = TestLink(lambda data: reply[:10] if data[4] == BAYS[0] else b"")
    held_up, goes_on = threading.Event(), threading.Event()
    read = link.read
    has_read = False

    def held_up_once(timeout: float) -> bytes:
        nonlocal has_read
        if has_read and not held_up.is_set():
            held_up.set()
            goes_on.wait(30)
            return reply[10:]
        data = read(timeout)
        has_read = has_read or bool(data)
        return data

    link.read = held_up_once  # type: ignore[method-assign]
    got: list[object] = []

    def ask() -> None:
        frame = session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), BAYS[0], 30)
        got.append(frame.message)

    with FramedSession(PROTOCOL, link) as session:
        link.wake()  # end the read that began before the replacement
        asking = threading.Thread(target=ask)
        asking.start()
        assert held_up.wait(30)
        with pytest.raises(ReplyTimeoutError):  # the wait is longer than a silence
            session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), BAYS[1], 0.2)
        goes_on.set()
        asking.join(30)
    assert got == [velocity(1, BAYS[0])]


class CountingLink(TestLink):
    """A link that reports unread bytes."""

    def has_unread(self) -> bool:
        return bool(self._said)


def test_no_request_is_sent_while_the_reading_thread_is_delayed() -> None:
    """A message that arrived before the request and is still unread does not answer it."""
    link = CountingLink(answer)
    held_up, goes_on = threading.Event(), threading.Event()
    read = link.read

    def held_up_once(timeout: float) -> bytes:
        if not held_up.is_set():
            held_up.set()
            goes_on.wait(30)
        return read(timeout)

    link.read = held_up_once  # type: ignore[method-assign]
    got: list[object] = []

    def ask() -> None:
        frame = session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), BAYS[0], 30)
        got.append(frame.message)

    with FramedSession(PROTOCOL, link) as session:
        link.wake()  # end the read that began before the replacement
        assert held_up.wait(30)
        link.say(velocity(7, BAYS[0]).pack(HOST, BAYS[0]))
        early = m.MotGetVelParams(1, 1, 1, 1)
        link.say(early.pack(HOST, BAYS[0]))
        asking = threading.Thread(target=ask)
        asking.start()
        session.halt(m.MotMoveStop(1, 2), None, BAYS[1], 30)  # a stop does not wait for the reader
        goes_on.set()
        asking.join(30)
    assert got == [velocity(1, BAYS[0])]
