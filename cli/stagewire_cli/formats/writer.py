"""The interface of all formats, which accept frames that must be valid, or the events of a stream.

Also has a fast conversion of fields to text, because captures have millions of frames and few layouts.
"""

from __future__ import annotations

import abc
import json
from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any, TextIO

from stagewire.columns import Kind, shape_of
from stagewire.errors import CodecError
from stagewire.framing import Event
from stagewire.protocols import FramedMessage, Message, UndecidedMessage, UndocumentedMessage
from stagewire_cli.formats.task import Task
from stagewire_conformance.answers import Decoded
from stagewire_conformance.framings import EVENT_NAMES

PENDING = "pending"
"""The kind of the bytes that are left at the end of a stream; events have kinds of their own."""


class Writer(abc.ABC):
    """Writes decoded messages in a format.

    Offsets count the bytes of the whole input: of the stream, or of all frames of a list.
    """

    def __init__(self, task: Task) -> None:
        self.task = task

    def frame(self, offset: int, raw: bytes, name: str = "") -> bool:
        """Write one frame that must be valid; return whether it is.

        ``name`` identifies one of several frames. Frames of messages that are not selected are skipped.
        """
        try:
            decoded = self.task.decode(raw)
        except CodecError as error:
            self.refused(offset, raw, name, error)
            return False
        if self.task.wants(decoded):
            self.accepted(offset, raw, name, decoded)
        return True

    @abc.abstractmethod
    def accepted(self, offset: int, raw: bytes, name: str, decoded: Decoded) -> None:
        """Write a valid frame."""

    @abc.abstractmethod
    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Write an invalid frame with its error."""

    @abc.abstractmethod
    def events(self, offset: int, events: Iterable[Event]) -> None:
        """Write consecutive events of a stream; the first begins at ``offset``."""

    @abc.abstractmethod
    def pending(self, offset: int, raw: bytes) -> None:
        """Write the incomplete bytes at the end of a stream, if the format can."""

    @abc.abstractmethod
    def flush(self) -> None:
        """Flush the output so far, because further input may take a while."""

    @abc.abstractmethod
    def close(self) -> None:
        """Write the rest."""

    @abc.abstractmethod
    def abandon(self) -> None:
        """Stop without writing more, after a failure at any point."""


class EventWriter(Writer):
    """Writes events one by one."""

    def events(self, offset: int, events: Iterable[Event]) -> None:
        """Write every event, or only the frames of the selected message."""
        found, wants, only = self.task.found, self.task.wants, self.task.only
        for event in events:
            raw = event.raw
            decoded = found(event)
            if decoded is not None:
                if only is None or wants(decoded):
                    self.message(offset, EVENT_NAMES[event.__class__], decoded)
            elif only is None:
                self.no_message(offset, EVENT_NAMES[event.__class__], raw)
            offset += len(raw)

    def pending(self, offset: int, raw: bytes) -> None:
        """Write the incomplete bytes, unless a message is selected."""
        if self.task.only is None:
            self.no_message(offset, PENDING, raw)

    @abc.abstractmethod
    def message(self, offset: int, kind: str, decoded: Decoded) -> None:
        """Write a message of a stream."""

    @abc.abstractmethod
    def no_message(self, offset: int, kind: str, raw: bytes) -> None:
        """Write bytes of a stream that are not a message."""


class TextWriter(EventWriter):
    """Writes lines of text."""

    def __init__(self, task: Task, out: TextIO) -> None:
        super().__init__(task)
        self.out = out

    def flush(self) -> None:
        """Flush the output so far."""
        self.out.flush()

    def close(self) -> None:
        """Flush the last lines."""
        self.out.flush()

    def abandon(self) -> None:
        """Do nothing, because no lines are buffered."""


ENGINEERING = "engineering"
"""The key of values in the units of a stage."""

AS_JSON = ('"%s":%%d', ",")
AS_WORDS = ("%s=%%d", " ")

_Values = Callable[[Any], Any]


class FieldsText:
    """Fast text for the fields of messages whose fields are all integers, and always shown.

    Each such class gets one template, which produces the same text as ``frame_answer``. All other messages
    must use ``frame_answer``.

    :param style: the format of one field, and the separator of two.
    """

    def __init__(self, style: tuple[str, str], task: Task) -> None:
        self._item, self._joint = style
        self._task = task
        self._known: dict[type[Message], tuple[str, _Values] | None] = {}

    def of(self, message: Message) -> str | None:
        """Return the text; None for a message without a template."""
        cls = message.__class__
        try:
            known = self._known[cls]
        except KeyError:
            known = self._known[cls] = self._template(cls)
        if known is None:
            return None
        template, values = known
        text: str = template % values(message)
        return text

    def _template(self, cls: type[Message]) -> tuple[str, _Values] | None:
        if not issubclass(cls, FramedMessage) or cls.layout.unnamed:
            return None
        if issubclass(cls, (UndecidedMessage, UndocumentedMessage)):
            return None
        fields = shape_of(cls).fields
        if any(field.kind not in (Kind.UNSIGNED, Kind.SIGNED) for field in fields):
            return None
        if self._task.reals(cls):
            return None
        names = [field.name for field in fields]
        template = self._joint.join(self._item % name for name in names)
        return template, attrgetter(*names) if names else lambda _: ()


def compact(value: object) -> str:
    """Return JSON without spaces."""
    return json.dumps(value, separators=(",", ":"))
