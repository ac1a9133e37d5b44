"""Shared by the frames of all framings, and the events that every framer returns.

Frames are immutable, hashable and picklable, and compare by value.

Setting attributes of a frozen object is slow, so a frame is filled as a *draft*: an object of a class with
the same base and slots but without the lock, whose class is then changed. The two methods of the lock share
one C slot: a draft needs object's own version of both, or setting stays slow.
"""

from __future__ import annotations

from collections.abc import Iterable

from stagewire.errors import BadValueError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Any


class Frozen:
    """Base of frames; subclasses define the parts that are compared."""

    __slots__ = ()

    def _key(self) -> tuple[Any, ...]:
        """Return the parts by which frames are compared and hashed."""
        raise NotImplementedError

    def __setattr__(self, name: str, value: Any, /) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable; make a new one to change {name}")

    def __delattr__(self, name: str, /) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable; {name} cannot be deleted")

    def __eq__(self, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return isinstance(other, Frozen) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())


class Event:
    """One piece of a received stream: ``raw`` holds its bytes, unchanged. Do not modify it.

    A session also sets ``received``: the time of the session in seconds when it read the bytes. Events of a
    framer do not have it, and events are compared without it.
    """

    __slots__ = ("raw", "received")
    __match_args__ = ("raw",)

    raw: bytes
    received: float

    def __init__(self, raw: bytes) -> None:
        self.raw = raw

    def __eq__(self, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return self.raw == other.raw

    def __hash__(self) -> int:
        return hash((self.__class__, self.raw))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.raw.hex(' ')!r})"


def fed(data: bytes | bytearray | memoryview) -> bytes:
    """Return the bytes fed to a framer as ``bytes``.

    Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) if ``data`` is not bytes.
    """
    if isinstance(data, bytes):
        return data
    if isinstance(data, (bytearray, memoryview)):
        return bytes(data)
    raise BadValueError(f"a framer takes bytes, not {type(data).__name__}")


class Garbage(Event):
    """Bytes that do not belong to any frame."""

    __slots__ = ()


def join_garbage(events: Iterable[Event]) -> list[Event]:
    """Return the events with adjacent garbage joined, for comparing streams."""
    joined: list[Event] = []
    run: list[bytes] = []  # joined once at the end; joining piece by piece would be quadratic
    for event in events:
        if isinstance(event, Garbage):
            run.append(event.raw)
            continue
        if run:
            joined.append(Garbage(b"".join(run)))
            run.clear()
        joined.append(event)
    if run:
        joined.append(Garbage(b"".join(run)))
    return joined
