"""What every format can do: take frames that have to be right, or the events of a stream."""

from __future__ import annotations

import abc
from collections.abc import Iterable
from typing import TextIO

from stagewire.errors import CodecError
from stagewire.framing import Event
from stagewire_cli.formats.task import Task
from stagewire_conformance.answers import Decoded
from stagewire_conformance.codec import EVENT_NAMES

__all__ = ["PENDING", "EventWriter", "TextWriter", "Writer"]

PENDING = "pending"
"""The kind of the bytes that are left at the end of a stream, beside the kinds of events."""


class Writer(abc.ABC):
    """Writes what was decoded; a format says how.

    Offsets count the bytes of the whole input, as bytes: of the stream, or of all frames of a list.
    """

    def __init__(self, task: Task) -> None:
        self.task = task

    def frame(self, offset: int, raw: bytes, name: str = "") -> bool:
        """Write one frame that has to be right; return whether it is.

        ``name`` says which of several it is. A frame of a message that is not wanted is left out.
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
        """Write a frame that is right."""

    @abc.abstractmethod
    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Write a frame that is wrong, and why."""

    @abc.abstractmethod
    def events(self, offset: int, events: Iterable[Event]) -> None:
        """Write events of a stream that follow one another, the first of which stands at ``offset``."""

    @abc.abstractmethod
    def pending(self, offset: int, raw: bytes) -> None:
        """Write what is left at the end of a stream, where there is a place for it."""

    @abc.abstractmethod
    def flush(self) -> None:
        """Hand on what has been written so far: more may take a while to come."""

    @abc.abstractmethod
    def close(self) -> None:
        """Write what is still to be written."""

    @abc.abstractmethod
    def abandon(self) -> None:
        """Let go without writing more: something has failed, at any point of the work."""


class EventWriter(Writer):
    """Writes events one by one."""

    def events(self, offset: int, events: Iterable[Event]) -> None:
        """Write every event; where one message is wanted, its frames alone."""
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
        """Write what is left, unless one message is wanted."""
        if self.task.only is None:
            self.no_message(offset, PENDING, raw)

    @abc.abstractmethod
    def message(self, offset: int, kind: str, decoded: Decoded) -> None:
        """Write a message of a stream."""

    @abc.abstractmethod
    def no_message(self, offset: int, kind: str, raw: bytes) -> None:
        """Write bytes of a stream that are no message."""


class TextWriter(EventWriter):
    """Writes lines of text."""

    def __init__(self, task: Task, out: TextIO) -> None:
        super().__init__(task)
        self.out = out

    def flush(self) -> None:
        """Hand on what has been written so far."""
        self.out.flush()

    def close(self) -> None:
        """Hand on the last lines."""
        self.out.flush()

    def abandon(self) -> None:
        """Nothing: no line is held."""
