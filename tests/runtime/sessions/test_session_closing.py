"""Last words of sessions for every way in which a program ends, and handlers that are removed again."""

from __future__ import annotations

import atexit
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from scripted_links import AsyncTestLink, TestLink

import stagewire_virtual as virtual
from stagewire._sessions import termination
from stagewire.sessions import AsyncFramedSession, FramedSession
from stagewire_apt import PROTOCOL, stages
from stagewire_virtual import stepped

PROGRAM = Path(__file__).with_name("closing_program.py")
MOVE_STOP = bytes.fromhex("65 04 01 02 50 01")
MOVE_HOME = bytes.fromhex("43 04 01 00 50 01")

# The ways in which a program ends, and the exit status of each.
ENDS = {
    "terminate": -signal.SIGTERM,
    "terminate reader": -signal.SIGTERM,
    "SIGHUP": -getattr(signal, "SIGHUP", 0),
    "SIGQUIT": -getattr(signal, "SIGQUIT", 0),
    "exit on SIGTERM": 7,
    "close": 0,
    "exit": 0,
}
PROGRAMS = [
    pytest.param(
        world,
        end,
        policy,
        marks=[pytest.mark.matrix] * (policy == "leave" and end != "terminate"),
    )
    for world in ("threads", "loop")
    for end in ENDS
    for policy in ("stop", "leave")
    if (world, end) != ("loop", "terminate reader")  # no thread reads there
]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows ends a process without a signal")
@pytest.mark.parametrize(("world", "end", "policy"), PROGRAMS)
def test_a_program_that_ends_stops_its_motions(world: str, end: str, policy: str) -> None:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
        heard: list[bytes] = []
        tdc.link.observer.received = lambda link, when, data: heard.append(data)  # type: ignore[method-assign]
        command = [sys.executable, "-W", "ignore", str(PROGRAM), world, policy, end, tdc.url]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
            assert program.stdout is not None
            assert program.stdout.readline() == "homing\n"
            if end in ("SIGHUP", "SIGQUIT"):
                program.send_signal(signal.Signals[end])
            elif "SIGTERM" in end or "terminate" in end:
                program.send_signal(signal.SIGTERM)
            assert program.wait(20) == ENDS[end]
        until = time.monotonic() + 10
        while (not heard or tdc.link.connected) and time.monotonic() < until:
            time.sleep(0.005)
        said = b"".join(heard)
    assert said.startswith(MOVE_HOME)
    assert (MOVE_STOP in said) == (policy == "stop")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGHUP")
def test_a_program_that_ignores_hangups_still_does() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    try:
        with FramedSession(PROTOCOL, TestLink()):
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_handler_of_the_program_is_kept() -> None:
    def handler(number: int, frame: object) -> None: ...

    before = signal.signal(signal.SIGTERM, handler)
    try:
        with FramedSession(PROTOCOL, TestLink()):
            assert signal.getsignal(signal.SIGTERM) is handler
        assert signal.getsignal(signal.SIGTERM) is handler
    finally:
        signal.signal(signal.SIGTERM, before)


def test_all_handlers_are_removed_after_the_last_session(monkeypatch: pytest.MonkeyPatch) -> None:
    registered: list[object] = []
    monkeypatch.setattr(atexit, "register", registered.append)
    monkeypatch.setattr(atexit, "unregister", registered.remove)
    before = signal.getsignal(signal.SIGTERM)
    first, second = (FramedSession(PROTOCOL, TestLink()) for _ in range(2))
    assert signal.getsignal(signal.SIGTERM) is termination._on_termination
    first.close()
    assert registered == [termination._at_exit]
    assert signal.getsignal(signal.SIGTERM) is termination._on_termination
    second.close()
    assert signal.getsignal(signal.SIGTERM) is before
    assert not registered
    assert not termination._open


@pytest.mark.skipif(not hasattr(os, "fork"), reason="only POSIX forks")
def test_a_fork_leaves_the_link_to_its_parent() -> None:
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:
        heard: list[bytes] = []
        tdc.link.observer.received = lambda link, when, data: heard.append(data)  # type: ignore[method-assign]
        command = [sys.executable, "-W", "ignore", str(PROGRAM), "fork", "stop", "exit", tdc.url]
        said = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert said.stdout == (
        f"{tdc.url} was opened before this process was forked; open it after the fork; "
        "MOT_REQ_VELPARAMS was not sent\nthe parent still has it\n"
    )
    assert b"".join(heard).count(MOVE_STOP) == 1  # from the parent


@pytest.mark.parametrize("ending", [termination._at_exit, None], ids=["exit", "close"])
def test_failing_last_words_do_not_prevent_others(
    ending: Callable[[], None] | None, caplog: pytest.LogCaptureFixture
) -> None:
    def fail() -> bytes:
        raise ZeroDivisionError

    links = [TestLink(), TestLink()]
    with FramedSession(PROTOCOL, links[0]) as first, FramedSession(PROTOCOL, links[1]) as second:
        first.on_close += [fail, lambda: MOVE_STOP]
        second.on_close.append(lambda: MOVE_STOP)
        if ending:
            ending()
    assert [link.written for link in links] == [[MOVE_STOP], [MOVE_STOP]]
    assert "last words failed" in caplog.text


def test_a_signal_during_closing_loses_no_stop() -> None:
    link = TestLink()
    session = FramedSession(PROTOCOL, link)
    session.on_close.append(lambda: MOVE_STOP)
    link.answer = lambda data: session.say_last() or b""  # type: ignore[func-returns-value]
    session.close()
    assert link.told_now == [MOVE_STOP]
    session.say_last()
    assert link.told_now == [MOVE_STOP]


def test_last_words_do_not_wait_for_the_event_loop() -> None:
    async def main() -> None:
        link = AsyncTestLink()
        async with AsyncFramedSession(PROTOCOL, link) as session:
            session.on_close.append(lambda: MOVE_STOP)
            termination._at_exit()
            assert link.told_now == [MOVE_STOP]

    stepped.run(main())
