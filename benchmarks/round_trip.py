"""The cost of a session over a bare socket: a request of 6 bytes and its reply of 20, on loopback TCP.

The bare socket sends and receives the same bytes and does nothing with them. One process is the other end
for all contenders. Sessions build, pack and send the message, wait, and return the decoded reply. Devices
also convert its values; they have no bound. The time is wall-clock time, since most of it is waiting: the
median of a thousand round trips. Contenders are interleaved, and the ratio within a round is the result.

Both processes share one core if the system allows it. On two cores, a bare round trip takes 14 or 60 us,
depending on the scheduler, because waking another core costs more than everything else. On one core the bare
socket is always fast, which gives the largest ratio.

    python benchmarks/round_trip.py
"""

from __future__ import annotations

import asyncio
import os
import socket
import statistics
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack

from measure import Bound, Runner, interleave, report
from peer import DEVICE, HOST, REPLY, REQUEST, Peer, peer

from stagewire.links import open_async_link, open_link
from stagewire.sessions import AsyncFramedSession, FramedSession
from stagewire_apt import PROTOCOL, TDC001
from stagewire_apt import messages as m

NUMBER = 1000
BARE = "bare socket"
WITHOUT = "session without a reader thread"
WITH = "session with a reader thread"
ASYNCIO = "asyncio session"
DEVICE_WITHOUT = "device without a reader thread"
DEVICE_WITH = "device with a reader thread"


def timed(call: Callable[[], object]) -> Runner:
    """Return a runner that takes the median of many calls."""

    def run() -> float:
        seconds = []
        for _ in range(NUMBER):
            start = time.perf_counter()
            call()
            seconds.append(time.perf_counter() - start)
        return statistics.median(seconds)

    return run


def bare(other: Peer, stack: ExitStack) -> Runner:
    """Send and receive the same bytes through a socket."""
    line = stack.enter_context(socket.create_connection(("127.0.0.1", other.port)))
    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    request = REQUEST.pack(dest=DEVICE, source=HOST)
    size = len(REPLY.pack(dest=HOST, source=DEVICE))

    def ping() -> None:
        line.sendall(request)
        left = size
        while left:
            left -= len(line.recv(left))

    return timed(ping)


def session(other: Peer, stack: ExitStack, background: bool) -> Runner:
    """Send requests through a session for threads."""
    line = stack.enter_context(FramedSession(PROTOCOL, open_link(other.url), background=background))
    replies = (m.MotGetVelParams,)
    return timed(lambda: line.ask(m.MotReqVelParams(chan_ident=1), replies, DEVICE))


def device(other: Peer, stack: ExitStack, background: bool) -> Runner:
    """Read values with units through a device."""
    opened = TDC001.open(other.url, identify=False, background=background)
    return timed(stack.enter_context(opened).get_vel_params)


def asynchronous(other: Peer, stack: ExitStack) -> Runner:
    """Send requests through an asyncio session."""
    runner = stack.enter_context(asyncio.Runner())
    replies = (m.MotGetVelParams,)

    async def opened() -> AsyncFramedSession:
        return AsyncFramedSession(PROTOCOL, await open_async_link(other.url))

    line = runner.run(opened())
    stack.callback(lambda: runner.run(line.close()))

    async def batch() -> float:
        seconds = []
        for _ in range(NUMBER):
            start = time.perf_counter()
            await line.ask(m.MotReqVelParams(chan_ident=1), replies, DEVICE)
            seconds.append(time.perf_counter() - start)
        return statistics.median(seconds)

    return lambda: runner.run(batch())


def share_one_processor() -> None:
    """Stay on one core, together with the processes that are started from now on."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def main() -> bool:
    """Measure; return whether all bounds hold."""
    share_one_processor()
    with peer("answer") as other, ExitStack() as stack:
        contenders = {
            BARE: bare(other, stack),
            WITHOUT: session(other, stack, background=False),
            WITH: session(other, stack, background=True),
            ASYNCIO: asynchronous(other, stack),
            DEVICE_WITHOUT: device(other, stack, background=False),
            DEVICE_WITH: device(other, stack, background=True),
        }
        bounds = [Bound(WITHOUT, BARE, at_most=3), Bound(WITH, BARE, at_most=6)]
        return report(
            "Round trip on loopback TCP",
            interleave(contenders),
            bounds,
            lambda seconds: f"{seconds * 1e6:,.1f} us",
        )


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
