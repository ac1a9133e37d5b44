"""One JSON object per line, in the shape of the testee's answers; events of a stream with their offset."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TextIO

from stagewire.errors import CodecError
from stagewire.protocols import Frame
from stagewire_cli.formats.fields import AS_JSON, FieldsText, compact
from stagewire_cli.formats.task import Task
from stagewire_cli.formats.writer import PENDING, TextWriter
from stagewire_conformance.answers import Decoded, frame_answer, refusal

__all__ = ["JsonLinesWriter"]


class JsonLinesWriter(TextWriter):
    """Writes JSON lines."""

    def __init__(self, task: Task, out: TextIO) -> None:
        super().__init__(task, out)
        self._count = 0
        self._fields = FieldsText(AS_JSON)

    def frame(self, offset: int, raw: bytes, name: str = "") -> bool:
        """Write one frame that has to be right, numbered as in the input."""
        self._count += 1
        return super().frame(offset, raw, name)

    def accepted(self, offset: int, raw: bytes, name: str, decoded: Decoded) -> None:
        """Write what the testee answers."""
        self._print({"id": self._count, "ok": True} | frame_answer(decoded))

    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Write how the testee refuses."""
        self._print({"id": self._count} | refusal(error))

    def message(self, offset: int, kind: str, decoded: Decoded) -> None:
        """Write a message of a stream."""
        if not isinstance(decoded, Frame) or (fields := self._fields.of(decoded.message)) is None:
            self._print(self._place(offset) | {"event": kind} | frame_answer(decoded))
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
        """Write bytes of a stream that are no message."""
        if kind == PENDING:
            self._print(self._place(offset) | {"pending": raw.hex()})
        else:
            self._print(self._place(offset) | {"event": kind, "hex": raw.hex()})

    def _place(self, offset: int) -> dict[str, object]:
        """Return where an event stands: its offset in a stream, or its line, time and direction."""
        names = (column.name for column in self.task.places)
        return dict(zip(names, (offset, *self.task.stamp), strict=True))

    def _print(self, answer: Mapping[str, object]) -> None:
        self.out.write(f"{compact(answer)}\n")
