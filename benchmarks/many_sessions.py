"""A large program: 256 controllers of all kinds in one asyncio process, for a minute.

Virtual controllers in another process send ten updates a second for each channel, each over its own TCP
connection. This process has a session with each, which sends keep-alives, and a subscription. Nothing may be
lost, and this process must not need more than one core.

    python benchmarks/many_sessions.py
    python benchmarks/many_sessions.py --controllers 32 --seconds 2 --quick    # counts only
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
import time
from dataclasses import dataclass

from measure import holds
from virtual_soak import PERIOD, channels_in_updates, kinds, serving

from stagewire.links import open_async_link
from stagewire.protocols import FramedMessage
from stagewire.sessions import AsyncFramedSession
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_virtual.instrument import Unit
from stagewire_virtual.thorlabs_apt.facts import class_of

MOST_PROCESSOR = 1.0  # of one core
PATIENCE = 30.0  # s to wait for missing updates
KEPT = 100  # most events that a subscription keeps: at least a second
GROUP = 16  # controllers with updates at the same instant


class Host:
    """The session with one controller, and the number of updates from each of its channels."""

    def __init__(self, unit: Unit, session: AsyncFramedSession) -> None:
        facts = unit.facts
        self.session = session
        self.address = 0x50 if facts["address"] == "generic_usb" else 0x21
        self.received = dict.fromkeys(channels_in_updates(unit), 0)
        starts = unit.message("HW_START_UPDATEMSGS")["exchange"]["starts"]
        self.updates = session.subscribe(
            tuple(class_of(unit, name) for name in starts if name in unit.messages),
            limit=KEPT,
        )
        self.alive: FramedMessage | None = None
        if facts["keep_alive"] != "none":
            self.alive = PROTOCOL.message_class(facts["keep_alive"])()

    async def start(self) -> None:
        """Request updates, and keep the controller alive from then on."""
        self.session.keep_alive(self.alive, (self.address,))
        await self.session.send(m.HwStartUpdateMsgs(round(1 / PERIOD)), self.address)

    async def listen(self) -> None:
        """Count the updates."""
        async for event in self.updates:
            self.received[0 if 0 in self.received else event.raw[6]] += 1


@dataclass(frozen=True)
class Run:
    """The counts of all sessions."""

    received: int
    missing: int
    dropped: int
    share: float


async def run(controllers: int, seconds: float) -> Run:
    """Serve controllers in another process, and open a session with each."""
    units = {unit.name: unit for unit in kinds()}
    async with serving(controllers) as process:
        hosts: list[Host] = []
        for name, url in json.loads(await process.stdout.readline()):
            session = AsyncFramedSession(PROTOCOL, await open_async_link(url))
            hosts.append(Host(units[name], session))
        listening = [asyncio.create_task(host.listen()) for host in hosts]
        groups = [hosts[at : at + GROUP] for at in range(0, controllers, GROUP)]
        for group in groups:
            await asyncio.gather(*(host.start() for host in group))
            await asyncio.sleep(PERIOD / len(groups))
        began, used = time.monotonic(), time.process_time()
        await asyncio.sleep(seconds)
        share = (time.process_time() - used) / (time.monotonic() - began)
        wanted = int(seconds / PERIOD)
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end and any(
            min(host.received.values()) < wanted for host in hosts
        ):
            await asyncio.sleep(PERIOD)
        received = sum(sum(host.received.values()) for host in hosts)
        missing = sum(max(0, wanted - came) for host in hosts for came in host.received.values())
        dropped = sum(host.updates.dropped for host in hosts)
        for host in hosts:
            await host.session.close()
        await asyncio.gather(*listening)
    return Run(received, missing, dropped, share)


def main(controllers: int, seconds: float, *, quick: bool) -> bool:
    """Measure; return whether all bounds hold."""
    found = asyncio.run(run(controllers, seconds))
    print(f"{controllers} sessions in one process of asyncio: {found.received} updates received")
    kept = [
        holds("updates missing", found.missing, 0),
        holds("updates dropped", found.dropped, 0),
    ]
    if not quick:
        kept.append(holds("share of one core", found.share, MOST_PROCESSOR))
    return all(kept)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--controllers", type=int, default=256)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--quick", action="store_true", help="counts only")
    given = parser.parse_args()
    sys.exit(0 if main(given.controllers, given.seconds, quick=given.quick) else 1)
