"""Rows of one message, with a typed column for each field; gathered message by message.

Frames go through the columns of the library, which read the fields of many frames at once.
"""

from __future__ import annotations

import abc
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final

from stagewire.columns import Frames, Kind, Place, Sorter, shape_of
from stagewire.framing import Event
from stagewire_cli.formats.sinks import Column
from stagewire_conformance.answers import Decoded, message_of
from stagewire_conformance.registry import Json, registry_of

if TYPE_CHECKING:
    from stagewire_cli.formats.task import FramedTask, Stamp, Task


_STRINGS: Final = {Kind.TEXT: "string", Kind.BYTES: "binary"}
_KINDS: Final = {kind.name.lower(): type for kind, type in _STRINGS.items()}


class TypedRows(abc.ABC):
    """Rows that wait for being written; ``len`` says how many they are."""

    columns: Sequence[Column]

    @abc.abstractmethod
    def __len__(self) -> int: ...

    @abc.abstractmethod
    def take(self, offset: int, events: Iterable[Event]) -> None:
        """Add what is wanted of events that follow one another, the first of which is at ``offset``."""

    @abc.abstractmethod
    def append(self, offset: int, raw: bytes, decoded: Decoded) -> None:
        """Add a message that is wanted."""

    @abc.abstractmethod
    def values(self) -> list[Sequence[Any]]:
        """Return the rows, column by column."""

    @abc.abstractmethod
    def clear(self) -> None:
        """Forget the rows, which were written."""


class FrameRows(TypedRows):
    """Frames: offset, addresses, fields, and bytes beyond the layout.

    Raises :class:`~stagewire.errors.UnsupportedError` for a message without a documented layout.
    """

    def __init__(self, task: FramedTask) -> None:
        only = task.only
        assert only is not None
        self._task = task
        fields = [Column(place.name, _type_of_place(place)) for place in shape_of(only).places]
        self.columns = _columns(task, fields)
        self._sorter = Sorter(task.protocol, task.request.get("context"), only=[only])
        self._frames = self._sorter.frames.setdefault(only, Frames(only))
        self._stamps: list[Stamp] = []  # of captures; then every frame has one

    def __len__(self) -> int:
        return len(self._frames)

    def take(self, offset: int, events: Iterable[Event]) -> None:
        """Add the frames of the message."""
        self._sorter.take(offset, events)
        if stamp := self._task.stamp:
            self._stamps += [stamp] * (len(self._frames) - len(self._stamps))

    def append(self, offset: int, raw: bytes, decoded: Decoded) -> None:
        """Add a frame."""
        self._frames.append(offset, raw)

    def values(self) -> list[Sequence[Any]]:
        """Return the rows, column by column."""
        frames = self._frames
        extra: list[bytes | None] = [None] * len(frames)
        for number, following in frames.extra.items():
            extra[number] = following
        stamps = zip(*self._stamps, strict=True)
        return [frames.offsets, *stamps, *frames.columns().values(), extra]

    def clear(self) -> None:
        """Forget the frames."""
        self._frames.clear()
        self._stamps.clear()


class MessageRows(TypedRows):
    """Commands, replies or packets: offset, axis or address, fields, and bytes beyond the layout."""

    def __init__(self, task: Task) -> None:
        assert task.only is not None
        self._task = task
        layout = task.only.layout
        known = registry_of(task.protocol).fields(layout.message, layout.form)
        fields = [Column(name, _type_of_field(known[name])) for name in layout.fields]
        self.columns = _columns(task, fields)
        self._rows: list[tuple[Any, ...]] = []

    def __len__(self) -> int:
        return len(self._rows)

    def take(self, offset: int, events: Iterable[Event]) -> None:
        """Add the messages that are wanted."""
        for event in events:
            decoded = self._task.found(event)
            if decoded is not None and self._task.wants(decoded):
                self.append(offset, event.raw, decoded)
            offset += len(event.raw)

    def append(self, offset: int, raw: bytes, decoded: Decoded) -> None:
        """Add a message."""
        fields = message_of(decoded).values().values()
        extra = getattr(decoded, "extra", None) or None  # a reply has none
        task = self._task
        self._rows.append((offset, *task.stamp, *task.addressed(decoded), *fields, extra))

    def values(self) -> list[Sequence[Any]]:
        """Return the rows, column by column."""
        return list(zip(*self._rows, strict=True))

    def clear(self) -> None:
        """Forget the rows."""
        self._rows.clear()


def _columns(task: Task, fields: Iterable[Column]) -> list[Column]:
    return [*task.places, *task.addresses, *fields, Column("extra", "binary")]


def _type_of_place(place: Place) -> str:
    return _STRINGS.get(place.kind) or integer_type(place.kind is Kind.SIGNED, place.size)


def _type_of_field(field: Json) -> str:
    return _KINDS.get(field["kind"]) or integer_type(field["signed"], field["size"])


def integer_type(signed: bool, size: int) -> str:
    """Return the narrowest machine integer that holds ``size`` bytes."""
    return f"{'' if signed else 'u'}int{8 << (size - 1).bit_length()}"
