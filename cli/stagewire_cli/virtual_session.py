"""One run of ``stagewire virtual``, until a signal or a timeout ends it."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from stagewire.protocols import Direction
from stagewire_cli.output import printable
from stagewire_cli.signals import signals
from stagewire_cli.virtual_log import STANDARD_OUTPUT, Log, begin, logs
from stagewire_cli.virtual_units import LinkMaker
from stagewire_virtual.clock import RealClock
from stagewire_virtual.replay import Replay
from stagewire_virtual.serving.link import Link, Observer, ServedLink
from stagewire_virtual.serving.server import Server

if TYPE_CHECKING:
    from stagewire_cli.screens import VirtualScreen

_REFRESH = 0.2  # seconds between two drawings of the live table


def run_session(
    makers: Sequence[LinkMaker], log: str | None, seconds: float | None, source: Path | None = None
) -> bool:
    """Serve until a signal, until a time is over, or until the host of a replay has left.

    :param makers: the makers of the units, which share a clock.
    :param log: the file to record to; ``-`` is standard output; None records nothing.
    :param seconds: the longest time, or None.
    :param source: the bench or capture that is read, which no log may replace.

    Return False if a replayed session differed from its recording. Raises
    :class:`~stagewire_virtual.errors.ServingError` for an endpoint that cannot be opened,
    :class:`CalledWronglyError` for a log that cannot be opened, and :class:`OSError` if writing output fails.
    """
    clock = RealClock()
    session = _Session()
    links = [make(clock, session) for make in makers]
    with ExitStack() as stack:
        if log is not None:
            session.logs = stack.enter_context(logs(log, links, source))
        quiet = log == STANDARD_OUTPUT
        asyncio.run(session.serve(Server(clock), links, seconds, quiet=quiet))
    if session.failure is not None:
        raise session.failure
    return _report_replays(links)


class _Session(Observer):
    """Serves links, and logs and shows their traffic."""

    def __init__(self) -> None:
        self.logs: dict[Link, Log] = {}
        self.failure: OSError | None = None
        self._screen: VirtualScreen | None = None
        self._over = asyncio.Event()
        self._visited: set[Link] = set()

    async def serve(
        self, server: Server, links: Sequence[ServedLink], seconds: float | None, *, quiet: bool
    ) -> None:
        """Serve the links until the end; ``quiet`` leaves standard output to the log."""
        async with server:
            with signals(self._over.set), ExitStack() as stack:
                for link in links:
                    await server.open(link)
                begin(self.logs.values())
                for link in links:
                    typer.echo(f"{link.label} at {link.url}", err=quiet)
                ends: list[asyncio.Task[object]] = [asyncio.create_task(self._over.wait())]
                if sys.stdout.isatty() and not quiet:
                    from stagewire_cli.screens import VirtualScreen

                    self._screen = stack.enter_context(VirtualScreen(links))
                    ends.append(asyncio.create_task(_draw(server, self._screen)))
                done, waiting = await asyncio.wait(
                    ends, timeout=seconds, return_when=asyncio.FIRST_COMPLETED
                )
                for task in waiting:
                    task.cancel()
                for task in done:
                    task.result()  # raises the error of a failed drawing

    def received(self, link: Link, when: int, data: bytes) -> None:
        """Record bytes from a host."""
        self._record(link, lambda log: log.passed(when, Direction.TO_CONTROLLER, data))

    def sent(self, link: Link, when: int, data: bytes) -> None:
        """Record bytes to a host."""
        self._record(link, lambda log: log.passed(when, Direction.TO_HOST, data))

    def noted(self, link: Link, when: int, text: str) -> None:
        """Show a note for people, and end a replay when its host has left."""
        self._record(link, lambda log: log.note(when, text))
        if self._screen is not None:
            self._screen.note(link, text)
        elif not self.logs:
            typer.echo(f"{link.label}: {printable(text)}", err=True)
        if link.connected:
            self._visited.add(link)
        elif link in self._visited and isinstance(link.instrument, Replay):
            self._over.set()

    def _record(self, link: Link, write: Callable[[Log], None]) -> None:
        log = self.logs.get(link)
        if log is None or self.failure is not None:
            return
        try:
            write(log)
        except OSError as error:  # for example a full disk or a closed pipe
            error.filename = error.filename or log.name
            self.failure = error
            self._over.set()


async def _draw(server: Server, screen: VirtualScreen) -> None:
    """Redraw the live table periodically, each time after all timers that are due."""
    while True:
        server.run(screen.draw)
        await asyncio.sleep(_REFRESH)


def _report_replays(links: Sequence[Link]) -> bool:
    """Print the summaries of replays; return whether all matched their recordings."""
    right = True
    for replay in (link.instrument for link in links):
        if isinstance(replay, Replay):
            typer.echo(replay.summary, err=True)
            right = right and replay.ok
    return right
