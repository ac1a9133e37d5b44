"""Dialogues of the panel: a yes-or-no question, and a line to type a position. Any stop key closes them."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Static


class Question(ModalScreen[bool]):
    """A question that y or Enter answers with yes, and n with no.

    :param title: the question.
    :param text: what will happen.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("y,enter", "dismiss(True)", show=False),
        Binding("n,q", "dismiss(False)", show=False),
    ]

    def __init__(self, title: str, text: str) -> None:
        super().__init__()
        self._title = title
        self._text = text

    def compose(self) -> ComposeResult:
        """Draw the question."""
        with Vertical(classes="dialogue"):
            yield Static(self._title, classes="question", markup=False)
            yield Static(self._text, markup=False)
            yield Static("y or Enter: yes    n: no    Space: stop all, no", classes="answers")


class PositionEntry(ModalScreen[str]):
    """A line to type a position; Enter returns it.

    :param title: the axis.
    :param text: where it is, and its travel.
    """

    def __init__(self, title: str, text: str) -> None:
        super().__init__()
        self._title = title
        self._text = text
        self._early = ""

    def compose(self) -> ComposeResult:
        """Draw the line."""
        with Vertical(classes="dialogue"):
            yield Static(self._title, classes="question", markup=False)
            yield Static(self._text, markup=False)
            entry = PositionInput(placeholder="position", restrict=r"[-+0-9.eEa-z]*")
            entry.cursor_blink = False
            yield entry
            yield Static("Enter: go    Space or Esc: stop all, cancel", classes="answers")

    def keep(self, text: str) -> None:
        """Keep what is typed before the line takes keys; a number must not lose its first digits."""
        self._early += text
        self.call_after_refresh(self._insert)

    def _insert(self) -> None:
        early, self._early = self._early, ""
        entry = self.query_one(PositionInput)
        entry.value = early + entry.value
        entry.cursor_position = len(entry.value)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Return what was typed."""
        self.dismiss(event.value)


class PositionInput(Input):
    """An input that leaves the space bar to the stop."""

    def check_consume_key(self, key: str, character: str | None) -> bool:
        """Return whether a key is text."""
        return key != "space" and super().check_consume_key(key, character)
