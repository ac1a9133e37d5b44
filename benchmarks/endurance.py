"""A simulated day of ten axes: 8.64 million status updates through sessions, without a loss.

Virtual controllers in memory send ten updates a second for each axis. Each controller has its own line and
session. All share a stepped clock, so that every update arrives on its own. Like real controllers, they fall
silent after 50 updates without a keep-alive. The line loses every tenth keep-alive at random, and once an
hour all of them for four seconds. Once a minute each address receives a request, which must be answered
nevertheless.

The program counts the updates that a subscriber receives. Two processes share the axes. Their memory at the
end is compared with that after the first hour.

    python benchmarks/endurance.py
    python benchmarks/endurance.py --hours 0.05 --quick    # counts only
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

from measure import holds, memory

import stagewire_virtual as virtual
from stagewire.framing import Received
from stagewire.sessions import FramedCore
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m

HOST = 0x01
HEADER = 6
RATE = 10  # updates a second for each axis
STEP = 1 / RATE
MINUTE, HOUR = 60, 3600
HOURS = 24.0
TIMEOUT = 1.0
CHANCE = 0.1  # chance that a keep-alive is lost
OUTAGE = 4.0  # s; without keep-alives a controller falls silent after five
MOST_SECONDS = 300.0
MOST_GROWTH = 1.0  # MiB
SHARES = (("BBD103", "TDC001", "TDC001"), ("BBD103", "TDC001", "TDC001"))
ADDRESSES = {"BBD103": (0x21, 0x22, 0x23), "TDC001": (0x50,)}
ALIVE = m.MotAckDcStatusUpdate()
SIGNS = {ALIVE.pack(address, HOST) for addresses in ADDRESSES.values() for address in addresses}


class Line:
    """A controller and the session of its host, on the same clock."""

    def __init__(self, unit: str, seed: int) -> None:
        self.controller = getattr(virtual, unit)(seed=seed)
        self.addresses = ADDRESSES[unit]
        self.core = FramedCore(PROTOCOL)
        self.updates = self.core.subscribe(m.MotGetDcStatusUpdate, limit=2 * RATE)
        self.now = 0.0
        self.chance = random.Random(seed)
        self.received = dict.fromkeys(self.addresses, 0)
        self.asked = self.answered = self.lost = 0
        self.core.keep_alive(ALIVE, self.addresses)
        for address in self.addresses:
            self.core.send(m.HwStartUpdateMsgs(RATE), address, TIMEOUT, self.now)
        self.pass_on()

    def live_until(self, end: float) -> None:
        """Advance the clock, stopping at each instant at which the session or the controller is due."""
        while self.now < end:
            due = self.core.due
            due = self.core.silent_at if due is None else min(due, self.core.silent_at)
            until = min(end, self.now + STEP, max(due, self.now))
            if until > self.now:
                self.controller.advance(until - self.now)
                self.now = until
            self.core.receive(self.controller.read(), self.now)
            self.core.tick(self.now)
            self.pass_on()
            while (event := self.updates.take()) is not None:
                assert isinstance(event, Received)
                self.received[event.frame.source] += 1

    def pass_on(self) -> None:
        """Pass the output of the session to the controller, except the keep-alives that the line loses."""
        said = self.core.output(self.now)  # headers only
        for at in range(0, len(said), HEADER):
            frame = said[at : at + HEADER]
            if frame in SIGNS and self.loses():
                self.lost += 1
            else:
                self.controller.write(frame)

    def loses(self) -> bool:
        """Return whether a keep-alive sent now is lost."""
        return self.chance.random() < CHANCE or self.now % HOUR > HOUR - OUTAGE

    def ask(self) -> None:
        """Request the velocities from each address, and check that the replies arrive."""
        request, replies = m.MotReqVelParams(chan_ident=1), (m.MotGetVelParams,)
        for address in self.addresses:
            exchange = self.core.ask(request, replies, address, TIMEOUT, self.now)
            self.live_until(self.now + STEP)
            self.asked += 1
            self.answered += exchange.done and exchange.value().source == address


@dataclass(frozen=True)
class Day:
    """The counts of the lines of one process."""

    received: int
    missing: int
    dropped: int
    lost: int
    asked: int
    unanswered: int
    growth: float


def live(hours: float, quick: bool, share: int) -> Day:
    """Simulate a day with a share of the axes; measure memory unless the run is quick."""
    lines = [Line(unit, 10 * share + seed) for seed, unit in enumerate(SHARES[share])]
    minutes = round(hours * HOUR / MINUTE)
    warm = 0.0
    for minute in range(minutes):
        for line in lines:
            line.ask()
            line.live_until(MINUTE * (minute + 1) + STEP / 2)
        if minute <= HOUR / MINUTE and not quick:
            warm = memory()
    received = [came for line in lines for came in line.received.values()]
    return Day(
        received=sum(received),
        missing=sum(MINUTE * minutes * RATE - came for came in received),
        dropped=sum(line.updates.dropped for line in lines),
        lost=sum(line.lost for line in lines),
        asked=sum(line.asked for line in lines),
        unanswered=sum(line.asked - line.answered for line in lines),
        growth=0.0 if quick else memory() - warm,
    )


def main(hours: float, *, quick: bool) -> bool:
    """Simulate; return whether all bounds hold."""
    start = time.perf_counter()
    with ProcessPoolExecutor(len(SHARES)) as pool:
        days = list(pool.map(partial(live, hours, quick), range(len(SHARES))))
    seconds = time.perf_counter() - start
    received, asked = sum(day.received for day in days), sum(day.asked for day in days)
    axes = sum(len(ADDRESSES[unit]) for share in SHARES for unit in share)
    print(
        f"{axes} axes for {hours:g} h: {received:,} updates received, {asked:,} requests, "
        f"{sum(day.lost for day in days):,} keep-alives lost on the line, in {seconds:.1f} s"
    )
    kept = [
        holds("updates missing", sum(abs(day.missing) for day in days), 0),
        holds("updates dropped", sum(day.dropped for day in days), 0),
        holds("requests without a reply", sum(day.unanswered for day in days), 0),
    ]
    if not quick:
        kept.append(holds("seconds", seconds, MOST_SECONDS, "s"))
        kept.append(holds("growth of memory", max(day.growth for day in days), MOST_GROWTH, "MiB"))
    return all(kept)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--hours", type=float, default=HOURS)
    parser.add_argument("--quick", action="store_true", help="counts only")
    given = parser.parse_args()
    sys.exit(0 if main(given.hours, quick=given.quick) else 1)
