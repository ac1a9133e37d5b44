"""The live table of ``stagewire virtual``: what each controller does at this instant.

On a terminal that is not wide it leaves out where they listen and what was counted.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.live import Live
from rich.text import Text

from stagewire_cli.terminal import console, printable, table
from stagewire_virtual.serving.link import Link, ServedLink

__all__ = ["Screen"]

_NOTES = 5
_WIDE = 130
"""Columns of a terminal that show everything unfolded; where controllers listen stands above it, too."""


class Screen:
    """A table that is drawn anew when it is told to; leaves its last state on the terminal.

    :param links: what it shows.
    """

    def __init__(self, links: Sequence[ServedLink]) -> None:
        self._links = links
        self._notes: deque[str] = deque(maxlen=_NOTES)
        self._console = console()
        self._live = Live(console=self._console, auto_refresh=False, transient=False)

    def __enter__(self) -> Screen:
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def note(self, link: Link, text: str) -> None:
        """Show a line below the table, in place of the oldest."""
        self._notes.append(f"{link.label}: {printable(text)}")

    def draw(self) -> None:
        """Draw what is so at this instant."""
        self._live.update(self._drawn(), refresh=True)

    def _drawn(self) -> RenderableType:
        wide = self._console.width >= _WIDE
        traffic = ("link", "bytes in", "frames out") if wide else ()
        shown = table(
            "unit", "host", *traffic, "part", "position", "state",
            right=("bytes in", "frames out", "position"),
        )  # fmt: skip
        for link in self._links:
            unit = [link.label, _host(link)]
            if wide:
                unit += [link.url, f"{link.received:,}", f"{link.sent:,}"]
            for row in link.instrument.rows():
                shown.add_row(*unit, row.part, row.position, row.state)
                unit = [""] * len(unit)
        return Group(shown, *map(Text, self._notes))


def _host(link: Link) -> str:
    lost = f", {link.dropped:,} frames lost" if link.dropped else ""
    return f"{'connected' if link.connected else 'none'}{lost}"
