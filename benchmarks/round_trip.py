"""What a session costs over the line itself: a request of 6 bytes and its reply of 20, on loopback TCP.

The bare socket sends and receives the same bytes and does nothing with them; the other end is one process for
all. Sessions make the message, pack it, send it, wait, and return the frame of the reply, decoded; devices
give its values, and have no bound. Time is that on the wall, since it is spent waiting, and of a thousand
round trips the median. Contenders are interleaved, and the ratio within a round counts.

Both processes share one processor, where the system can be told so. On two, a bare round trip takes 14 or
60 us as the scheduler pleases, since to wake a processor that sleeps costs more than the rest; on one it is
always the faster, against which the ratio is the greatest.

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
    """Return a runner of a call, with the median of many."""

    def run() -> float:
        seconds = []
        for _ in range(NUMBER):
            start = time.perf_counter()
            call()
            seconds.append(time.perf_counter() - start)
        return statistics.median(seconds)

    return run


def bare(other: Peer, stack: ExitStack) -> Runner:
    """Send and receive the same bytes through a socket, and no more."""
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
    """Ask by a session for threads."""
    line = stack.enter_context(FramedSession(PROTOCOL, open_link(other.url), background=background))
    replies = (m.MotGetVelParams,)
    return timed(lambda: line.ask(m.MotReqVelParams(chan_ident=1), replies, DEVICE))


def device(other: Peer, stack: ExitStack, background: bool) -> Runner:
    """Ask by a device, which gives values that have units."""
    opened = TDC001.open(other.url, identify=False, background=background)
    return timed(stack.enter_context(opened).get_vel_params)


def asynchronous(other: Peer, stack: ExitStack) -> Runner:
    """Ask by a session of asyncio."""
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
    """Stay on one processor, with the processes that are started from now on."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def main() -> bool:
    """Measure; return whether the bounds are kept."""
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
