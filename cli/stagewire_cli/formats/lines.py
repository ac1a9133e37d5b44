"""Formats of lines: JSON for programs, text for people.

Each JSON line contains one object in the form of the testee's answers; events of a stream have their offset.
Text is a table for a frame, and a line for each event of a stream.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TextIO

from stagewire.errors import CodecError
from stagewire.framing import TextReceived
from stagewire.protocols import Frame
from stagewire_cli.formats.task import Task
from stagewire_cli.formats.writer import (
    AS_JSON,
    AS_WORDS,
    ENGINEERING,
    PENDING,
    FieldsText,
    TextWriter,
    compact,
)
from stagewire_cli.output import console
from stagewire_cli.rendering import event_line, explain, frame_line, frame_table, frame_title
from stagewire_cli.values import context_option
from stagewire_conformance.answers import Decoded, frame_answer, refusal
from stagewire_conformance.framings import EVENT_NAMES
from stagewire_conformance.notation import spaced


class JsonLinesWriter(TextWriter):
    """Writes JSON lines."""

    def __init__(self, task: Task, out: TextIO) -> None:
        super().__init__(task, out)
        self._count = 0
        self._fields = FieldsText(AS_JSON, task)

    def frame(self, offset: int, raw: bytes, name: str = "") -> bool:
        """Write one frame that must be valid, numbered as in the input."""
        self._count += 1
        return super().frame(offset, raw, name)

    def accepted(self, offset: int, raw: bytes, name: str, decoded: Decoded) -> None:
        """Write the testee's answer."""
        self._print({"id": self._count, "ok": True} | self._answer(decoded))

    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Write the testee's refusal."""
        self._print({"id": self._count} | refusal(error))

    def message(self, offset: int, kind: str, decoded: Decoded) -> None:
        """Write a message of a stream."""
        fields = None
        if isinstance(decoded, Frame) and self.task.stage_values is None:
            fields = self._fields.of(decoded.message)
        if not isinstance(decoded, Frame) or fields is None:
            self._print(self._place(offset) | {"event": kind} | self._answer(decoded))
            return
        layout = decoded.message.layout
        place = compact(self._place(offset)) if self.task.stamp else f'{{"offset":{offset}}}'
        extra = f',"extra":"{decoded.extra.hex()}"' if decoded.extra else ""
        self.out.write(
            f'{place[:-1]},"event":"{kind}","message":"{layout.message}",'
            f'"form":"{layout.form}","dest":{decoded.dest},"source":{decoded.source},'
            f'"fields":{{{fields}}}{extra}}}\n'
        )

    def no_message(self, offset: int, kind: str, raw: bytes) -> None:
        """Write bytes of a stream that are not a message."""
        if kind == PENDING:
            self._print(self._place(offset) | {"pending": raw.hex()})
        else:
            self._print(self._place(offset) | {"event": kind, "hex": raw.hex()})

    def _answer(self, decoded: Decoded) -> dict[str, object]:
        """Return a decoded message, with its values in the units of the stage."""
        answer = self.task.answer(decoded)
        units = self.task.in_units(answer)
        return answer | ({ENGINEERING: units} if units else {})

    def _place(self, offset: int) -> dict[str, object]:
        """Return the position of an event: its offset in a stream, or its line, time and direction."""
        names = (column.name for column in self.task.places)
        return dict(zip(names, (offset, *self.task.stamp), strict=True))

    def _print(self, answer: Mapping[str, object]) -> None:
        self.out.write(f"{compact(answer)}\n")


_TEXT = EVENT_NAMES[TextReceived]
_MARKS = {"to_controller": ">", "to_host": "<"}
"""The marks of directions in captures."""


class TableWriter(TextWriter):
    """Writes text that cannot control a terminal."""

    def __init__(self, task: Task, out: TextIO) -> None:
        super().__init__(task, out)
        self._console = console(file=out)
        self._fields = FieldsText(AS_WORDS, task)

    def accepted(self, offset: int, raw: bytes, name: str, decoded: Decoded) -> None:
        """Write the table of a frame."""
        answer = frame_answer(decoded)
        self._name(name, raw)
        self._say(frame_title(self.task.protocol, answer))
        if answer["fields"] or answer.get("extra") or answer.get("data"):
            self._console.print(frame_table(self.task.protocol, answer, self.task.stage_values))
        if answer["form"] == "data:undecided":
            options = [
                " or ".join(context_option(key, value) for value in values)
                for key, values in self.task.codec.contexts.items()
            ]
            self._say(f"the bytes do not determine the layout; use {', '.join(options)}")
        if name:
            self._say("")

    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Write the wrong bytes and the error."""
        self._name(name, raw)
        for line in explain(raw, error, self.task.hints(raw, error)):
            self._say(line)

    def message(self, offset: int, kind: str, decoded: Decoded) -> None:
        """Write a message in one line."""
        fields = None
        if isinstance(decoded, Frame) and self.task.stage_values is None:
            fields = self._fields.of(decoded.message)
        if isinstance(decoded, Frame) and fields is not None:
            line = event_line(decoded, fields)
        else:
            answer = frame_answer(decoded)
            line = frame_line(self.task.protocol, answer, self.task.in_units(answer))
        self.out.write(f"{self._place(offset)}  {line}\n")

    def no_message(self, offset: int, kind: str, raw: bytes) -> None:
        """Write bytes in one line, or text with its control characters spelled out."""
        what = "incomplete at the end" if kind == PENDING else kind
        shown = repr(raw.decode("latin-1")) if kind == _TEXT else spaced(raw)
        self._say(f"{self._place(offset)}  {what}: {shown}")

    def _place(self, offset: int) -> str:
        """Return the position of an event: its offset in a stream, or its time and direction."""
        if stamp := self.task.stamp:
            time, direction = stamp
            return f"{time:>12.6f} {_MARKS[direction]}"
        return f"{offset:>9}"

    def _name(self, name: str, raw: bytes) -> None:
        if name:
            self._say(f"{name}: {spaced(raw)}")

    def _say(self, text: str) -> None:
        self.out.write(f"{text}\n")
