"""For people: a table for a frame, a line for each event of a stream."""

from __future__ import annotations

from typing import TextIO

from stagewire.errors import CodecError
from stagewire.framing import TextReceived
from stagewire.protocols import Frame
from stagewire_cli.explain import explain
from stagewire_cli.formats.fields import AS_WORDS, FieldsText
from stagewire_cli.formats.task import Task
from stagewire_cli.formats.writer import PENDING, TextWriter
from stagewire_cli.rendering import event_line, frame_line, frame_table, frame_title
from stagewire_cli.terminal import console
from stagewire_conformance.answers import Decoded, frame_answer
from stagewire_conformance.codec import EVENT_NAMES
from stagewire_conformance.hexes import spaced

__all__ = ["TableWriter"]


_TEXT = EVENT_NAMES[TextReceived]
_MARKS = {"to_controller": ">", "to_host": "<"}
"""Which way bytes of a capture went, as captures spell it."""


class TableWriter(TextWriter):
    """Writes text; nothing in it can steer a terminal."""

    def __init__(self, task: Task, out: TextIO) -> None:
        super().__init__(task, out)
        self._console = console(file=out)
        self._fields = FieldsText(AS_WORDS)

    def accepted(self, offset: int, raw: bytes, name: str, decoded: Decoded) -> None:
        """Write the table of a frame."""
        answer = frame_answer(decoded)
        self._name(name, raw)
        self._say(frame_title(self.task.protocol, answer))
        if answer["fields"] or answer.get("extra") or answer.get("data"):
            self._console.print(frame_table(self.task.protocol, answer))
        if answer["form"] == "data:undecided":
            known = self.task.codec.contexts.items()
            options = [f"--{key} {' or '.join(values)}" for key, values in known]
            self._say(f"the bytes do not say which layout this is; {', '.join(options)} does")
        if name:
            self._say("")

    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Write which bytes are wrong, and why."""
        self._name(name, raw)
        for line in explain(raw, error, self.task.hints(raw, error)):
            self._say(line)

    def message(self, offset: int, kind: str, decoded: Decoded) -> None:
        """Write a message in one line."""
        if isinstance(decoded, Frame) and (fields := self._fields.of(decoded.message)) is not None:
            line = event_line(decoded, fields)
        else:
            line = frame_line(self.task.protocol, frame_answer(decoded))
        self.out.write(f"{self._place(offset)}  {line}\n")

    def no_message(self, offset: int, kind: str, raw: bytes) -> None:
        """Write bytes in one line, or text with its control characters spelled out."""
        what = "incomplete at the end" if kind == PENDING else kind
        shown = repr(raw.decode("latin-1")) if kind == _TEXT else spaced(raw)
        self._say(f"{self._place(offset)}  {what}: {shown}")

    def _place(self, offset: int) -> str:
        """Return where an event stands: its offset in a stream, or its time and direction."""
        if stamp := self.task.stamp:
            time, direction = stamp
            return f"{time:>12.6f} {_MARKS[direction]}"
        return f"{offset:>9}"

    def _name(self, name: str, raw: bytes) -> None:
        if name:
            self._say(f"{name}: {spaced(raw)}")

    def _say(self, text: str) -> None:
        self.out.write(f"{text}\n")
