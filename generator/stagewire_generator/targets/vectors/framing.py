"""What a framing has to bring, so that the cases of a protocol can be made."""

from __future__ import annotations

import abc
from collections.abc import Iterator

from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.subject import Subject


class Framing(abc.ABC):
    """How the messages of one protocol are framed, and what can be wrong with a frame."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol

    @abc.abstractmethod
    def subject(self, message: Message, layout: Layout) -> Subject:
        """Return a layout as the subject of cases."""

    @abc.abstractmethod
    def frame(self, of: Subject, held: Json, extra: bytes = b"") -> bytes:
        """Return the bytes of a frame that holds values, and bytes beyond the layout."""

    @abc.abstractmethod
    def of_layout(self, of: Subject) -> Iterator[Case]:
        """Yield the cases of a layout that its framing makes."""

    @abc.abstractmethod
    def of_message(self, message: Message) -> Iterator[Case]:
        """Yield the cases of a message that are those of none of its layouts."""

    @abc.abstractmethod
    def of_protocol(self) -> Iterator[Case]:
        """Yield the cases of no message alone: addresses, unknown messages, streams, bad requests."""
