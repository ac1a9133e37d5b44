"""The live table of ``stagewire monitor``."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.live import Live
from rich.text import Text

from stagewire_cli.monitor_readings import Board
from stagewire_cli.terminal import console, printable, table

__all__ = ["Screen"]


class Screen:
    """A table that is drawn anew when it is told to; leaves its last state on the terminal.

    :param title: what is monitored, in one line.
    :param board: what it shows.
    """

    def __init__(self, title: str, board: Board) -> None:
        self._title = title
        self._board = board
        self._live = Live(console=console(), auto_refresh=False, transient=False)

    def __enter__(self) -> Screen:
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def draw(self, now: float) -> None:
        """Draw what is so at this instant, in seconds since the monitor began."""
        self._live.update(self._drawn(now), refresh=True)

    def _drawn(self, now: float) -> RenderableType:
        names = list({name: None for one in self._board.latest.values() for name in one.values})
        shown = table(
            "part", *names, "state", "age", "per second", right=(*names, "age", "per second")
        )
        for part, reading in self._board.latest.items():
            values = [str(reading.values[name]) if name in reading.values else "" for name in names]
            age, rate = f"{now - reading.time:.1f} s", f"{self._board.rate(part, now):.1f}"
            shown.add_row(part or "-", *values, reading.state, age, rate)
        counted = (
            f"{now:.1f} s, {self._board.count:,} status messages, {self._board.dropped:,} dropped"
        )
        waiting = [] if self._board.latest else [Text("no status message yet")]
        return Group(Text(printable(self._title)), shown, *waiting, Text(f"{counted}; Ctrl-C ends"))
