"""Sessions for threads: the behaviour for one caller."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import pytest
from scripted_links import USB, TestLink, answer, jog, silent, velocity

from stagewire.errors import (
    MotionStoppedError,
    MotionTimeoutError,
    ReplyTimeoutError,
    SessionClosedError,
    TransportLostError,
)
from stagewire.sessions import Ends, FramedSession
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m

VELOCITY = (m.MotGetVelParams,)
HOMED = Ends((m.MotMoveHomed,), (m.MotMoveStoppedHeader,))
STOPPED = Ends((m.MotMoveStoppedHeader,), ())
STOP = m.MotMoveStop(1, 2)

Make = Callable[..., FramedSession]


@pytest.fixture(params=[True, False], ids=["background", "without a thread"])
def session(request: pytest.FixtureRequest) -> Iterator[Make]:
    """``session(link)``: a session with or without a background thread, closed after the test."""
    made: list[FramedSession] = []

    def make(link: TestLink, **options: object) -> FramedSession:
        made.append(FramedSession(PROTOCOL, link, background=request.param, **options))  # type: ignore[arg-type]
        return made[-1]

    yield make
    for one in made:
        one.close()
    assert not [one for one in threading.enumerate() if one.name.startswith("stagewire test")]


def ask(session: FramedSession, timeout: float | None = None) -> m.MotGetVelParams:
    message = session.ask(m.MotReqVelParams(1), VELOCITY, USB, timeout).message
    assert isinstance(message, m.MotGetVelParams)
    return message


def test_a_request_gets_its_reply(session: Make) -> None:
    link = TestLink(answer)
    assert ask(session(link)) == velocity()
    assert link.written == [m.MotReqVelParams(1).pack(USB, 1)]


@pytest.mark.parametrize("timeout", [0.05, 0.2])
def test_a_silent_controller_costs_no_more_than_the_timeout(session: Make, timeout: float) -> None:
    silent_session = session(TestLink())
    with pytest.raises(ReplyTimeoutError):
        ask(silent_session, timeout)


def test_a_message_before_a_request_does_not_answer_it(session: Make) -> None:
    link = TestLink()
    one = session(link)
    link.say(m.MotGetVelParams(1, 7, 7, 7).pack(1, USB))
    if one._thread is not None:
        one.pause(0.05)  # until the thread has passed the bytes to the core
    link.answer = answer
    assert ask(one) == velocity()


def test_a_reply_cut_into_bytes_arrives(session: Make) -> None:
    link = TestLink()

    def byte_by_byte(data: bytes) -> bytes:
        def say() -> None:
            for byte in answer(data):
                link.say(bytes((byte,)))
                time.sleep(0.001)

        thread.append(threading.Thread(target=say))
        thread[-1].start()
        return b""

    thread: list[threading.Thread] = []
    link.answer = byte_by_byte
    assert ask(session(link)) == velocity()
    thread[0].join()


def test_waiting_for_a_motion(session: Make) -> None:
    link = TestLink()
    one = session(link)
    ended: list[object] = []
    motion = one.begin(m.MotMoveHome(1), HOMED, USB, on_done=ended.append)
    assert link.written == [m.MotMoveHome(1).pack(USB, 1)]
    for _ in range(2):
        with pytest.raises(MotionTimeoutError, match="nothing was stopped, so you can wait again"):
            one.wait(motion, 0.01)
    assert not ended
    link.say(m.MotMoveHomed(1).pack(1, USB))
    assert one.wait(motion, 5).message == m.MotMoveHomed(1)
    assert one.wait(motion) is motion.value()
    assert ended == [motion]


def test_a_stopped_motion_raises(session: Make) -> None:
    link = TestLink()
    one = session(link)
    motion = one.begin(m.MotMoveHome(1), HOMED, USB)
    link.answer = answer
    stopped = one.halt(STOP, STOPPED, USB)
    assert stopped is not None
    assert stopped.message == m.MotMoveStoppedHeader(1)
    with pytest.raises(MotionStoppedError):
        one.wait(motion)


def test_a_motion_times_out_even_if_no_call_waits_for_it(session: Make) -> None:
    one = session(TestLink())
    over = threading.Event()
    motion = one.begin(m.MotMoveHome(1), HOMED, USB, 0.05, on_done=lambda _: over.set())
    if one._thread is not None:
        assert over.wait(5)
    with pytest.raises(MotionTimeoutError):
        one.wait(motion)


def test_a_stop_overtakes_a_hundred_waiting_requests(session: Make) -> None:
    link = TestLink()
    one = session(link)
    failed: list[Exception] = []

    def request() -> None:
        try:
            ask(one, 5)
        except TransportLostError as error:
            failed.append(error)

    threads = [threading.Thread(target=request) for _ in range(100)]
    for thread in threads:
        thread.start()
    while not link.written:
        time.sleep(0.001)
    one.halt(STOP, None, USB)
    assert link.written[1:] == [STOP.pack(USB, 1)]
    link.unplug()
    for thread in threads:
        thread.join(5)
    assert len(failed) == 100
    assert len(set(map(id, failed))) == 100  # each caller gets its own


def test_a_lost_link_ends_all_calls(session: Make) -> None:
    link = TestLink()
    one = session(link)
    motion = one.begin(m.MotMoveHome(1), HOMED, USB)
    threading.Timer(0.1, link.unplug).start()
    with pytest.raises(TransportLostError, match="the plug was pulled"):
        ask(one, 30)
    with pytest.raises(TransportLostError):
        one.wait(motion)
    assert one.lost
    for call in (
        lambda: ask(one),
        lambda: one.send(STOP, USB),
        lambda: one.halt(STOP, STOPPED, USB),
        lambda: one.begin(m.MotMoveHome(1), HOMED, USB),
        lambda: one.pause(30),
    ):
        with pytest.raises(TransportLostError):
            call()
    assert len(link.written) == 2


def test_a_link_lost_during_a_write(session: Make) -> None:
    def cut(data: bytes) -> bytes:
        raise TransportLostError("cut in writing")

    with pytest.raises(TransportLostError, match="cut in writing"):
        ask(session(TestLink(cut)), 30)


def test_closing_ends_waiting_calls(session: Make) -> None:
    link = TestLink()
    one = session(link)
    closing = threading.Timer(0.02, one.close)
    closing.start()
    with pytest.raises(SessionClosedError):
        ask(one, 30)
    closing.join()
    with pytest.raises(SessionClosedError):
        ask(one)
    with pytest.raises(SessionClosedError):
        one.pause(30)
    one.close()
    assert link.closed
    assert one.closed
    assert not one.lost


def test_closing_stops_motions(session: Make) -> None:
    link = TestLink()
    one = session(link)
    one.on_close.append(lambda: STOP.pack(USB, 1))
    one.on_close.append(lambda: b"")
    one.close()
    one.close()
    assert link.written == [STOP.pack(USB, 1)]


def test_keep_alive_messages_are_sent_between_calls(session: Make) -> None:
    link = TestLink()
    one = session(link)
    ack = m.MotAckDcStatusUpdate()
    one.keep_alive(ack, (0x21, 0x22), period=0.02)
    one.pause(0.05)  # without a thread, a call has to wait
    sent = b"".join(link.written)
    assert sent.count(ack.pack(0x21, 1)) >= 2
    assert sent.count(ack.pack(0x22, 1)) >= 2


def test_an_invalid_call_leaves_the_session_usable(session: Make) -> None:
    one = session(TestLink(answer))
    with pytest.raises(ZeroDivisionError):
        one.perform(lambda now: 1 // 0)  # type: ignore[arg-type,return-value]
    assert ask(one) == velocity()


def test_an_interrupted_call_cancels_its_request(session: Make) -> None:
    link = TestLink()
    one = session(link)

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    link.answer = interrupt  # type: ignore[assignment]
    with pytest.raises(KeyboardInterrupt):
        ask(one)
    assert one.statistics.cancelled == 1
    link.answer = silent
    link.say(velocity().pack(1, USB))  # the late reply, which answers nothing
    link.answer = answer
    assert one.ask(m.MotReqJogParams(1), (m.MotGetJogParams,), USB).message == jog()
