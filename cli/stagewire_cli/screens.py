"""Live tables on a terminal for ``stagewire monitor`` and ``stagewire virtual``.

Imported only on use, because importing Rich takes longer than running most commands.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING, Self

from rich.console import Group, RenderableType
from rich.live import Live
from rich.text import Text

from stagewire_cli.monitor_board import numbers_of, state_of
from stagewire_cli.output import console, printable, table

if TYPE_CHECKING:
    from stagewire_cli.monitor_board import Board
    from stagewire_virtual.serving.link import Link, ServedLink

_NOTES = 5
_WIDE = 130
"""The width of a terminal from which the table of virtual controllers shows URLs and counters."""


class _Screen:
    """A table that is redrawn on request, and leaves its last state on the terminal."""

    def __init__(self) -> None:
        self._console = console()
        self._live = Live(console=self._console, auto_refresh=False, transient=False)

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def _show(self, drawn: RenderableType) -> None:
        self._live.update(drawn, refresh=True)


class MonitorScreen(_Screen):
    """The states of the parts of a controller.

    :param title: the name of the controller, in one line.
    :param board: the rows to show.
    """

    def __init__(self, title: str, board: Board) -> None:
        super().__init__()
        self._title = title
        self._board = board

    def draw(self, now: float) -> None:
        """Draw the present state; ``now`` is in seconds since the monitor began."""
        numbers = {part: dict(numbers_of(row)) for part, row in self._board.latest.items()}
        names = list({name: None for one in numbers.values() for name in one})
        shown = table(
            "part", *names, "state", "age", "per second", right=(*names, "age", "per second")
        )
        for part, row in self._board.latest.items():
            values = [numbers[part].get(name, "") for name in names]
            age, rate = f"{now - row['time_s']:.1f} s", f"{self._board.rate(part, now):.1f}"
            shown.add_row(part or "-", *values, state_of(row) or "", age, rate)
        counted = (
            f"{now:.1f} s, {self._board.count:,} status messages, {self._board.dropped:,} dropped"
        )
        waiting = [] if self._board.latest else [Text("no status message yet")]
        title, end = Text(printable(self._title)), Text(f"{counted}; Ctrl-C ends")
        self._show(Group(title, shown, *waiting, end))


class VirtualScreen(_Screen):
    """The activity of virtual controllers.

    :param links: the links to show.
    """

    def __init__(self, links: Sequence[ServedLink]) -> None:
        super().__init__()
        self._links = links
        self._notes: deque[str] = deque(maxlen=_NOTES)

    def note(self, link: Link, text: str) -> None:
        """Add a line below the table, replacing the oldest."""
        self._notes.append(f"{link.label}: {printable(text)}")

    def draw(self) -> None:
        """Draw the present state."""
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
        self._show(Group(shown, *map(Text, self._notes)))


def _host(link: Link) -> str:
    lost = f", {link.dropped:,} frames lost" if link.dropped else ""
    return f"{'connected' if link.connected else 'none'}{lost}"
