"""How long a stop takes to the other end, while 10,000 messages a second come in and 100 commands wait.

The other end is a process of its own: it sends status updates, answers no request, so that all that are made
go on waiting, and notes when each stop has come. A stop begins when it is called; in asyncio when the program
meant to call it, so that an event loop that is late counts. It ends when the other end has it, by the
clock that both processes share.

    python benchmarks/stop_latency.py
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import random
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress

from peer import DEVICE, STOP, UPDATES_A_SECOND, Peer, peer

from stagewire.errors import SessionClosedError
from stagewire.links import open_async_link, open_link
from stagewire.session.asynchronous import AsyncFramedSession
from stagewire.session.options import Ends
from stagewire.session.synchronous import FramedSession
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m

STOPS = 1000
WAITING = 100
LONG = 600.0  # seconds; nothing that waits gives up
LONGEST_PAUSE = 0.010
AT_MOST = 5.0  # ms, of 99 in 100
FEWEST = 0.98 * UPDATES_A_SECOND  # or they were not taken as fast as they were to come
ENDS = Ends(stopped=(m.MotMoveStoppedHeader,))
REPLIES = (m.MotGetVelParams,)


def threads(other: Peer, stops: int) -> list[float]:
    """Stop with a session for threads; return when each was called."""
    session = FramedSession(PROTOCOL, open_link(other.url))
    session.subscribe(m.MotGetDcStatusUpdate, limit=100)

    def wait() -> None:
        with suppress(SessionClosedError):
            session.ask(m.MotReqVelParams(chan_ident=1), REPLIES, DEVICE, LONG)

    waiting = [threading.Thread(target=wait) for _ in range(WAITING)]
    for thread in waiting:
        thread.start()
    chance = random.Random(1)
    began = []
    for _ in range(stops):
        time.sleep(chance.uniform(0, LONGEST_PAUSE))
        began.append(time.monotonic())
        session.halt(STOP, ENDS, DEVICE)
    assert all(thread.is_alive() for thread in waiting)
    session.close()
    for thread in waiting:
        thread.join()
    return began


async def tasks(other: Peer, stops: int) -> list[float]:
    """Stop with a session of asyncio; return when each was meant to be called."""
    loop = asyncio.get_running_loop()
    session = AsyncFramedSession(PROTOCOL, await open_async_link(other.url))
    session.subscribe(m.MotGetDcStatusUpdate, limit=100)
    waiting = [
        loop.create_task(session.ask(m.MotReqVelParams(chan_ident=1), REPLIES, DEVICE, LONG))
        for _ in range(WAITING)
    ]
    chance = random.Random(1)
    began = []
    for _ in range(stops):
        meant = time.monotonic() + chance.uniform(0, LONGEST_PAUSE)
        await asyncio.sleep(meant - time.monotonic())
        began.append(meant)
        await session.halt(STOP, ENDS, DEVICE)
    assert not any(task.done() for task in waiting)
    await session.close()
    ends = await asyncio.gather(*waiting, return_exceptions=True)
    assert {type(end) for end in ends} == {SessionClosedError}
    return began


def judge(title: str, began: Sequence[float], said: dict[str, object]) -> bool:
    """Print what a run came to; return whether the bounds are kept."""
    came, rate = said["stops"], said["rate"]
    assert isinstance(came, list)
    assert isinstance(rate, float)
    late = sorted((end - start) * 1e3 for start, end in zip(began, came, strict=True))
    p99 = late[len(late) * 99 // 100]
    kept = p99 <= AT_MOST and rate >= FEWEST
    print(
        f"{title:<10}{len(late)} stops among {rate:,.0f} updates a second, {WAITING} commands waiting: "
        f"median {late[len(late) // 2]:.2f} ms, p99 {p99:.2f} ms (<= {AT_MOST:g} ms), most {late[-1]:.2f} ms"
        f"{'' if kept else '     NOT KEPT'}",
        flush=True,
    )
    return kept


def main(stops: int) -> bool:
    """Measure; return whether the bounds are kept."""
    logging.getLogger("stagewire").setLevel(logging.ERROR)  # that updates are dropped is meant
    with peer("flood") as other:
        kept = judge("threads", threads(other, stops), other.said())
        kept &= judge("asyncio", asyncio.run(tasks(other, stops)), other.said())
    return kept


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--stops", type=int, default=STOPS)
    sys.exit(0 if main(parser.parse_args().stops) else 1)
