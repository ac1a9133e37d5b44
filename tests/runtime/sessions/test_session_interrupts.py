"""Ctrl-C at every moment of a call leaves the session intact."""

from __future__ import annotations

import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType, FunctionType

import pytest
from scripted_links import USB, TestLink, answer, velocity

from stagewire._links.link import AsyncClosing, Closing
from stagewire._sessions import interrupts
from stagewire._sessions.asynchronous import AsyncCommandSession, AsyncFramedSession
from stagewire._sessions.driver import Driver
from stagewire._sessions.options import SessionOptions
from stagewire._sessions.subscriptions import AsyncSubscription, BlockingSubscription
from stagewire._sessions.synchronous import CommandSession, FramedSession
from stagewire._sessions.thread_driver import ThreadDriver
from stagewire.links import open_link
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m

QUICK = SessionOptions(pacing=0, quiet=0.001)
STRIDE = 7  # between the tested moments; testing all takes a minute


class CtrlC:
    """Presses Ctrl-C after a number of steps at which Python would notice it."""

    def __init__(self, steps: int) -> None:
        self.left = steps
        self.pressed = False

    def __call__(self, frame: FrameType, event: str, argument: object) -> None:
        if self.pressed or event not in ("call", "c_return"):
            return
        self.left -= 1
        if self.left < 0:
            self.pressed = True
            sys.setprofile(None)
            signal.raise_signal(signal.SIGINT)


def ask(session: FramedSession) -> None:
    session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), USB)


def send(session: FramedSession) -> None:
    session.send(m.ModIdentify(), USB)


def stop(session: FramedSession) -> None:
    session.halt(m.MotMoveStop(1, 2), None, USB)


def press_within(session: FramedSession, call: Callable[[FramedSession], None], steps: int) -> bool:
    """Call and press Ctrl-C after some steps; return whether the call lasted that long."""
    ctrl_c = CtrlC(steps)
    came = False
    try:
        sys.setprofile(ctrl_c)
        call(session)
        sys.setprofile(None)
        until = time.monotonic() + 10
        while ctrl_c.pressed and time.monotonic() < until:
            time.sleep(0.001)  # the interrupt may come later
    except KeyboardInterrupt:
        came = True
    finally:
        sys.setprofile(None)
    assert came == ctrl_c.pressed
    return came


@pytest.mark.parametrize("call", [ask, send, stop])
@pytest.mark.parametrize("background", [True, False], ids=["background", "no thread"])
def test_an_interrupt_leaves_the_session_usable(
    call: Callable[[FramedSession], None], background: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interrupts, "_AGAIN", 0.001)
    link = TestLink(answer)
    with FramedSession(PROTOCOL, link, background=background, options=QUICK) as session:
        for steps in range(0, 10_000, STRIDE):
            if not press_within(session, call, steps):
                break
            frame = session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), USB)
            assert frame.message == velocity(1, USB)
    assert steps > 20


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not interrupt a wait for a lock")
def test_an_interrupt_during_a_wait_is_raised_immediately() -> None:
    with FramedSession(PROTOCOL, TestLink()) as session:
        main = threading.main_thread().ident
        assert main is not None
        timer = threading.Timer(0.05, lambda: signal.pthread_kill(main, signal.SIGINT))
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), USB, timeout=60)
        timer.join()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not interrupt a wait for a lock")
@pytest.mark.parametrize("waits_in", ["condition", "poll"])
def test_an_interrupt_while_the_link_waits_is_raised_immediately(waits_in: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        url = "virtual://TDC001" if waits_in == "condition" else f"socket://127.0.0.1:{port}"
        with FramedSession(PROTOCOL, open_link(url), background=False) as session:
            main = threading.main_thread().ident
            assert main is not None
            timer = threading.Timer(0.05, lambda: signal.pthread_kill(main, signal.SIGINT))
            timer.start()
            began = time.monotonic()
            with pytest.raises(KeyboardInterrupt):
                session.pause(60)
            assert time.monotonic() - began < interrupts._LONGEST
            timer.join()


@pytest.mark.parametrize(
    "cls",
    [
        FramedSession,
        CommandSession,
        BlockingSubscription,
        AsyncFramedSession,
        AsyncCommandSession,
        AsyncSubscription,
    ],
)
def test_every_method_of_a_session_defers_interrupts(cls: type) -> None:
    bases = [base for base in cls.__mro__ if base.__module__.startswith("stagewire.")]
    assert any(issubclass(base, Driver) or "Subscription" in base.__name__ for base in bases)
    for base in bases:
        if base in (Closing, AsyncClosing):
            continue
        for name, member in vars(base).items():
            function = getattr(member, "fget", None) or getattr(member, "__wrapped__", member)
            if isinstance(function, FunctionType):
                assert function.__code__ in interrupts._deferring, f"{base.__name__}.{name}"


def test_the_function_that_reads_the_link_is_registered() -> None:
    assert interrupts._reading == {ThreadDriver._read.__code__}


def test_a_handler_of_the_program_is_kept() -> None:
    def handler(number: int, frame: object) -> None: ...

    before = signal.signal(signal.SIGINT, handler)
    try:
        with FramedSession(PROTOCOL, TestLink()):
            assert signal.getsignal(signal.SIGINT) is handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_after_the_session_the_default_handler_is_restored() -> None:
    with FramedSession(PROTOCOL, TestLink()):
        assert signal.getsignal(signal.SIGINT) is interrupts.on_interrupt
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
