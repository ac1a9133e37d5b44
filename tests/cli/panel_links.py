"""Links to virtual controllers in real time, for tests of the panel: recorded, silent or lost."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from textual.drivers import headless_driver
from textual.pilot import Pilot

from stagewire import End
from stagewire.errors import TransportLostError
from stagewire.links import Link, LinkSettings
from stagewire_apt import PROTOCOL
from stagewire_cli.panel.app import PanelApp, stopping
from stagewire_cli.panel.axis import Axis
from stagewire_cli.panel.session import Line, opened_axes
from stagewire_virtual import linking
from wrapped_links import WrappedLink

LONG = 20.0
"""Seconds to wait for what happens at once on an idle machine."""


class PanelLink(WrappedLink):
    """A link that records what is sent, and that can fall silent or get lost."""

    def __init__(self, link: Link) -> None:
        super().__init__(link)
        self.written: list[bytes] = []
        self.changed = threading.Condition()
        self.is_silent = False
        self.is_lost = False

    def read(self, timeout: float) -> bytes:
        data = super().read(timeout)
        if self.is_lost:
            raise TransportLostError(f"{self.url}: the port was unplugged")
        return b"" if self.is_silent else data

    def write(self, data: bytes) -> None:
        if self.is_lost:
            raise TransportLostError(f"{self.url}: the port was unplugged")
        with self.changed:
            self.written.append(bytes(data))
            self.changed.notify_all()
        super().write(data)

    def lose(self) -> None:
        self.is_lost = True
        self.wake()

    @property
    def raw(self) -> bytes:
        return b"".join(self.written)

    def sent(self) -> list[str]:
        """The names of the sent messages of APT."""
        events = PROTOCOL.framer(End.NONE).feed(self.raw)
        return [event.frame.message.layout.message for event in events]

    def moves(self) -> list[str]:
        return [name for name in self.sent() if name.startswith("MOT_MOVE_") and "STOP" not in name]

    def stops(self) -> int:
        return self.sent().count("MOT_MOVE_STOP")

    def wait(self, condition: Callable[[], bool]) -> bool:
        """Wait in this thread until a condition on what was sent holds."""
        with self.changed:
            return self.changed.wait_for(condition, LONG)


class Shown:
    """A panel that a test presses the keys of."""

    def __init__(self, pilot: Pilot[Any], axes: list[Axis], links: list[PanelLink]) -> None:
        self.pilot = pilot
        self.app = pilot.app
        self.axes = axes
        self.links = links
        self.press = pilot.press

    async def until(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + LONG
        while not condition():
            assert time.monotonic() < deadline, [axis.view for axis in self.axes]
            await self.pilot.pause(0.01)

    async def rest(self) -> None:
        """Wait until no axis is moving or doing anything."""
        await self.until(
            lambda: all(not axis.view.action and axis.view.moving is False for axis in self.axes)
        )

    async def text(self) -> str:
        """The text on the screen in one line, without the bars of the cards."""
        await self.pilot.pause(0.3)
        lines = self.app.screen._compositor.render_strips()
        return " ".join(" ".join(strip.text.strip("█ ") for strip in lines).split())


@asynccontextmanager
async def shown(
    monkeypatch: pytest.MonkeyPatch, *urls: str, size: tuple[int, int] = (80, 24), **options: Any
) -> AsyncIterator[Shown]:
    """Show the panel of virtual controllers."""
    links: list[PanelLink] = []
    opens = linking.open_link

    def open_link(url: str, settings: LinkSettings) -> PanelLink:
        links.append(PanelLink(opens(url, settings)))
        return links[-1]

    with monkeypatch.context() as patch:
        patch.setattr(linking, "open_link", open_link)
        lines = Line.each(urls, **options)
        with opened_axes(lines) as (axes, stops, left_out):
            driver = stopping(headless_driver.HeadlessDriver, stops.order)
            patch.setattr(headless_driver, "HeadlessDriver", driver)
            async with PanelApp(axes, stops, left_out).run_test(size=size) as pilot:
                yield Shown(pilot, axes, links[-len(urls) :])


def shows(test: Callable[[pytest.MonkeyPatch], Any]) -> Callable[[pytest.MonkeyPatch], None]:
    """Run a test that is a coroutine."""

    def run(monkeypatch: pytest.MonkeyPatch) -> None:
        asyncio.run(test(monkeypatch))

    run.__name__ = test.__name__
    return run
