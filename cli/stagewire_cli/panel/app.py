"""The screen of the panel.

The stop does not depend on the screen: :func:`stopping` looks at each key on the thread that reads the
keyboard, before the event loop receives it. A slow drawing or an open dialogue therefore cannot delay it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import ClassVar, Final

from rich.text import Text
from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.driver import Driver
from textual.message import Message
from textual.screen import ModalScreen
from textual.widgets import Static

from stagewire_cli.panel.axis import Axis
from stagewire_cli.panel.card import AxisCard
from stagewire_cli.panel.dialogues import PositionEntry, Question
from stagewire_cli.panel.stops import Stops

STOP_KEYS: Final = frozenset({"space", "escape"})
QUIT_KEYS: Final = frozenset({"ctrl+c", "ctrl+q"})
_JOGS: Final = {"left": -1, "right": 1}
_REDRAW: Final = 0.1
"""Seconds between two looks at the axes."""
_HELP: Final = (
    ("← →", "jog"),
    ("- +", "step"),
    ("g", "go to"),
    ("h", "home"),
    ("e", "enable"),
    ("↑ ↓", "axis"),
    ("q", "quit"),
)
"""Key -> what it does; must fit 80 columns."""


def stopping(driver: type[Driver], stop: Callable[[], None]) -> type[Driver]:
    """Return a driver of the terminal that calls ``stop`` for the keys that stop, before anything else."""

    class StoppingDriver(driver):  # type: ignore[misc,valid-type]
        def send_message(self, message: Message) -> None:
            if isinstance(message, events.Key) and message.key in STOP_KEYS | QUIT_KEYS:
                stop()
            super().send_message(message)

    return StoppingDriver


class PanelApp(App[None]):
    """The panel.

    :param axes: the axes; their threads run.
    :param stops: the stop of all axes.
    :param left_out: names of parts that did not answer when their line was opened.
    """

    CSS_PATH = "panel.tcss"
    TITLE = "Stagewire panel"
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space,escape", "stop", priority=True, show=False),
        Binding("ctrl+c,ctrl+q", "quit", priority=True, show=False),
        Binding("q", "quit", show=False),
        Binding("up", "choose(-1)", show=False),
        Binding("down,tab", "choose(1)", show=False),
        Binding("plus,equals_sign", "step(1)", show=False),
        Binding("minus", "step(-1)", show=False),
        Binding("g", "go_to", show=False),
        Binding("h", "home", show=False),
        Binding("e", "enable", show=False),
    ]

    def __init__(self, axes: Sequence[Axis], stops: Stops, left_out: Sequence[str] = ()) -> None:
        super().__init__()
        self.driver_class = stopping(self.driver_class, stops.order)
        self._axes = axes
        self._cards = [AxisCard(axis) for axis in axes]
        self._stops = stops
        self._left_out = left_out
        self._at = 0
        self._leaving = False

    def compose(self) -> ComposeResult:
        """Draw a card for each axis, and the keys."""
        count = f"{len(self._axes)} {'axis' if len(self._axes) == 1 else 'axes'}"
        yield Static(f"{self.TITLE} · {count}", id="title", markup=False)
        with VerticalScroll(id="axes", can_focus=False):
            yield from self._cards
        if self._left_out:
            silent = ", ".join(self._left_out)
            yield Static(f"no answer when opened: {silent}", id="left-out", markup=False)
        yield StopBar(self._stops.order)
        keys = (part for key, does in _HELP for part in ((key, "bold"), f" {does}   "))
        yield Static(Text.assemble(*keys), id="keys", markup=False)

    def on_mount(self) -> None:
        """Choose the first axis, and begin to look at all of them."""
        self.action_choose(0)
        self.set_interval(_REDRAW, self._look)
        self._look()

    def _look(self) -> None:
        if self._leaving:
            self.exit()
        for card in self._cards:  # not by a query: at the end, the timer outlives the screens
            card.look()

    @property
    def axis(self) -> Axis:
        """The chosen axis."""
        return self._axes[self._at]

    def on_key(self, event: events.Key) -> None:
        """Jog; a key that waited in a queue is too old to move anything."""
        if isinstance(self.screen, PositionEntry) and event.character and event.is_printable:
            self.screen.keep(event.character)  # its line would have stopped the event
        direction = _JOGS.get(event.key)
        if direction is not None and not isinstance(self.screen, ModalScreen):
            waited = Message().time - event.time  # by the clock of the events
            self.axis.jog(direction, time.monotonic() - waited)
            self._look()

    def action_stop(self) -> None:
        """Stop all axes, and close an open dialogue."""
        self._stops.order()
        if isinstance(self.screen, ModalScreen):
            self.screen.dismiss(None)

    async def action_quit(self) -> None:
        """Stop all axes, and end."""
        self._stops.order()
        self.exit()

    def quit_soon(self) -> None:
        """End at the next look; can be called by a signal handler."""
        self._leaving = True

    def action_choose(self, by: int) -> None:
        """Choose the next or the previous axis."""
        self._at = (self._at + by) % len(self._axes)
        for index, card in enumerate(self._cards):
            card.chosen = index == self._at
            if card.chosen:
                card.scroll_visible(animate=False)

    def action_step(self, by: int) -> None:
        """Choose a larger or smaller step for the chosen axis."""
        self.axis.change_step(by)
        self._look()

    def action_go_to(self) -> None:
        """Ask for a position, and move there."""
        axis = self.axis
        text = f"at {axis.place()} · travel {axis.travel}"
        entry = PositionEntry(f"Go to position in {axis.unit}: {axis.name}", text)
        self.push_screen(entry, lambda typed: axis.go_to(typed) if typed else None)

    def action_home(self) -> None:
        """Home the chosen axis, after a question."""
        axis = self.axis
        if not axis.can_home:
            axis.refuse("home: this controller has no message for it")
            return
        text = "It moves with the direction, limit switch and speed stored in the controller."
        self._asked(f"Home {axis.name}?", text, axis.home)

    def action_enable(self) -> None:
        """Enable or disable the chosen axis, after a question."""
        axis = self.axis
        enabled = axis.view.enabled
        if enabled is None:
            axis.refuse("enable: this controller has no message for it")
        elif enabled:
            text = "The motor releases its load."
            self._asked(f"Disable {axis.name}?", text, lambda: axis.enable(False))
        else:
            text = "The motor is powered and holds its position."
            self._asked(f"Enable {axis.name}?", text, lambda: axis.enable(True))

    def _asked(self, title: str, text: str, act: Callable[[], None]) -> None:
        self.push_screen(Question(title, text), lambda yes: act() if yes else None)


class StopBar(Static):
    """The bar that names the stop key; a click on it also stops."""

    def __init__(self, stop: Callable[[], None]) -> None:
        super().__init__("SPACE stops all axes", id="stop", markup=False)
        self._stop = stop

    def on_mouse_down(self) -> None:
        """Stop."""
        self._stop()
