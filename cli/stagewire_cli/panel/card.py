"""The card of one axis on the screen of the panel."""

from __future__ import annotations

from typing import Final

from rich.cells import cell_len
from rich.text import Text
from textual.reactive import reactive
from textual.widgets import Static

from stagewire_cli.output import printable
from stagewire_cli.panel.axis import Axis, View

_MARGIN: Final = 2
_BAD: Final = "bold white on red"


class AxisCard(Static):
    """Name, position, travel, state and last outcome of an axis.

    :param axis: the axis.
    """

    chosen: reactive[bool] = reactive(False)
    """Whether the keys move this axis."""

    def __init__(self, axis: Axis) -> None:
        super().__init__(classes="axis", markup=False)
        self.axis = axis
        self._drawn: tuple[View, str] | None = None

    def watch_chosen(self, chosen: bool) -> None:
        """Draw the marker."""
        self.set_class(chosen, "chosen")
        self.refresh()

    def look(self) -> None:
        """Draw the card again if the axis has changed."""
        now = (self.axis.view, self.axis.step)
        if now != self._drawn:
            self._drawn = now
            self.set_class(self.axis.view.failed or bool(self.axis.view.silent), "failed")
            self.set_class(is_moving(self.axis.view), "moving")
            self.refresh(layout=True)

    def render(self) -> Text:
        """Return the text of the card."""
        return card_text(self.axis, max(self.content_size.width, 20), chosen=self.chosen)


def is_moving(view: View) -> bool:
    """Return whether an axis moves, as far as is known."""
    return not view.silent and bool(view.moving)


def card_text(axis: Axis, width: int, *, chosen: bool) -> Text:
    """Return the card of an axis in lines of a width; the last line may be longer and wraps."""
    view = axis.view
    name = f"{'▶' if chosen else ' '} {printable(axis.name)}"
    lines = [_sides(Text(name, "bold"), _position(axis), width)]
    lines.append(_sides(Text("  ").append(_travel(axis, width)), _state(view), width))
    words = [*_words(view), Text(f"step {axis.step}", "dim")]
    lines.append(Text("  ").append_text(Text(" · ").join(words)))
    note = printable(view.silent if view.silent and not view.lost else view.note or view.silent)
    if note:
        bad = view.failed or view.silent
        lines.append(Text("  ").append("! " if bad else "", "bold").append(note))
    return Text("\n").join(lines)


def _position(axis: Axis) -> Text:
    position = axis.view.position
    if position is None:
        return Text("–")
    shown = f"{position.number:,.4f}" if position.unit else f"{position.number:,.0f}"
    return Text(f"{shown} {axis.unit}", "dim" if axis.view.silent else "bold")


def _state(view: View) -> Text:
    if view.lost:
        return Text("✗ line lost", _BAD)
    if view.silent:
        return Text("? no answer", _BAD)
    if view.action or view.moving:
        return Text(f"● {view.action or 'moving'}", "bold yellow")
    return Text("○ at rest", "green") if view.moving is False else Text("")


def _words(view: View) -> list[Text]:
    """Return what is known of an axis, in words; what hinders motions is bold."""
    words = []
    if view.homed is not None:
        words.append(Text("homed", "dim") if view.homed else Text("not homed", "bold"))
    if view.enabled is not None:
        words.append(Text("enabled", "dim") if view.enabled else Text("disabled", "bold"))
    return words + [Text(alert.replace("_", " "), "bold yellow") for alert in view.alerts]


def _travel(axis: Axis, width: int) -> Text:
    """Return the travel as a bar with the position in it, or in words if its ends are unknown."""
    position = axis.view.position
    if axis.ends is None or position is None:
        return Text(f"travel {axis.travel}")
    low, high = axis.ends
    first, last = f"{low:.6g} ", f" {high:.6g} {axis.unit}"
    cells = max(min(width - 34, 50) - len(first) - len(last), 8)
    share = (position.number - low) / (high - low)
    at = min(max(round(share * (cells - 1)), 0), cells - 1)
    mark = "◆" if 0 <= share <= 1 else "◇"
    bar = Text(first).append("─" * at, "dim").append(mark, "bold")
    return bar.append("─" * (cells - 1 - at), "dim").append(last)


def _sides(left: Text, right: Text, width: int) -> Text:
    """Return two texts at both ends of a line; the left one is cut if they do not fit."""
    room = max(width - cell_len(right.plain) - _MARGIN, 1)
    left.truncate(room, overflow="ellipsis", pad=True)
    return left.append(" " * _MARGIN).append(right)
