"""A program that begins to home a controller and then ends in a given way; run by test_session_closing.

Usage: closing_program.py WORLD POLICY END PORT
"""

from __future__ import annotations

import asyncio
import os
import signal
import sys

from stagewire.errors import TransportLostError
from stagewire.links import open_async_link, open_link
from stagewire.sessions import AsyncFramedSession, Ends, FramedSession
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m

HOMED = Ends((m.MotMoveHomed,), (m.MotMoveStoppedHeader,))


def last_words() -> bytes:
    return m.MotMoveStop(1, 2).pack(0x50, 1)


def threads(url: str, stop: bool, end: str) -> None:
    session = FramedSession(PROTOCOL, open_link(url), background=end != "terminate reader")
    if stop:
        session.on_close.append(last_words)
    motion = session.begin(m.MotMoveHome(1), HOMED, 0x50)
    print("homing", flush=True)
    match end:
        case "terminate" | "terminate reader" | "SIGHUP" | "SIGQUIT" | "exit on SIGTERM":
            session.wait(motion)
        case "close":
            session.close()
        case "exit":
            return


async def loop(url: str, stop: bool, end: str) -> None:
    session = AsyncFramedSession(PROTOCOL, await open_async_link(url))
    if stop:
        session.on_close.append(last_words)
    motion = await session.begin(m.MotMoveHome(1), HOMED, 0x50)
    print("homing", flush=True)
    match end:
        case "terminate" | "SIGHUP" | "SIGQUIT" | "exit on SIGTERM":
            await session.wait(motion)
        case "close":
            await session.close()
        case "exit":
            sys.exit(0)


def fork(url: str) -> None:
    """Use a session, close it and exit in a fork; then use it in the parent."""
    with FramedSession(PROTOCOL, open_link(url)) as session:
        session.on_close.append(last_words)
        child = os.fork()
        try:
            session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), 0x50)
        except TransportLostError as error:
            print(error, flush=True)
        if child:
            os.waitpid(child, 0)
            session.ask(m.MotReqVelParams(1), (m.MotGetVelParams,), 0x50)
            print("the parent still has it")


if __name__ == "__main__":
    world, policy, end, url = sys.argv[1:]
    if end == "exit on SIGTERM":
        signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(7))
    if world == "fork":
        fork(url)
    elif world == "threads":
        threads(url, policy == "stop", end)
    else:
        asyncio.run(loop(url, policy == "stop", end))
