"""Matching of frames to exchanges: by message, by address, and by fields that request and reply share.

**Address.** Each bay of a rack is channel 1, so the frames of two bays differ only in their source. Some
controllers answer with addresses 0, or with the unswapped addresses of the request. The *effective source* of
a frame is its source if that is the address of a controller; otherwise its destination if the frame is
unswapped (its source is the host); otherwise it is unknown. An unknown source matches any controller; a
different known source never matches.

**Fields.** The reply must repeat the fields that select the object of a request, such as its channel or bay.
Reserved fields select nothing. Messages are identified by id and sub-message, so the short and the long form
are equivalent, and a reply with another sub-message answers nothing.
"""

from __future__ import annotations

from collections.abc import Iterable

from stagewire._framings.header.frame import Received, Undocumented
from stagewire._framings.header.message import DATA_FLAG, FramedMessage
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.header.table import message_key
from stagewire._sessions.framed_exchanges import Ask, FramedExchange, Halt, Motion

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import TypeAlias

    Classes: TypeAlias = tuple[type[FramedMessage], ...]


class Matching:
    """The facts of a protocol that matching needs."""

    def __init__(self, protocol: FramedProtocol) -> None:
        self._table = protocol.framing
        self._host = protocol.host
        self._devices = protocol.devices
        self._channel = protocol.channel
        self._ids: dict[Classes, frozenset[int]] = {}
        self._selecting: dict[tuple[type[FramedMessage], Classes], tuple[str, ...]] = {}

    def source_of(self, raw: bytes) -> int | None:
        """Return the effective source of a frame; None if it is unknown."""
        source = raw[5]
        if source in self._devices:
            return source
        dest = raw[4] & ~DATA_FLAG
        return dest if source == self._host and dest in self._devices else None

    def ids_of(self, classes: Classes) -> frozenset[int]:
        """Return the keys of message classes; see :func:`.message_key`."""
        ids = self._ids.get(classes)
        if ids is None:
            keys = (message_key(cls.layout.id, cls.layout.sub_message) for cls in classes)
            ids = self._ids[classes] = frozenset(keys)
        return ids

    def selected(self, message: FramedMessage, replies: Classes) -> tuple[tuple[str, object], ...]:
        """Return the fields of a request that its replies repeat, with their values."""
        request = type(message)
        names = self._selecting.get((request, replies))
        if names is None:
            names = self._selecting[request, replies] = tuple(_selecting(request, replies))
        return tuple([(name, getattr(message, name)) for name in names])

    def channel_of(self, message: FramedMessage) -> int | None:
        """Return the channel that a message concerns; None if it names none."""
        return None if self._channel is None else getattr(message, self._channel, None)

    def pass_over(
        self, exchange: FramedExchange, event: Received | Undocumented, began: int
    ) -> None:
        """Note in an exchange, unless it has ended, why a frame of an awaited message did not match.

        :param began: number of bytes received before the frame.
        """
        if not exchange.done:
            why, advice = self._why_not(exchange, event, began)
            exchange.pass_over((self._table.key_of(event.raw), why, advice), event.raw)

    def _why_not(
        self, exchange: FramedExchange, event: Received | Undocumented, began: int
    ) -> tuple[str, str]:
        source = self.source_of(event.raw)
        if began < exchange.after:
            return "which began before this was sent", ""
        if source is not None and source != exchange.dest:
            return f"from {source:#04x}", "check whether the address or bay is right"
        wanted: tuple[tuple[str, object], ...] = ()
        if isinstance(exchange, Ask):
            wanted = exchange.selected
        elif isinstance(exchange, Motion | Halt) and self._channel and exchange.channel is not None:
            wanted = ((self._channel, exchange.channel),)
        message = event.frame.message
        for name, value in wanted:
            came = getattr(message, name, value)
            if came != value:
                return (
                    f"with {name} {came} instead of {value}",
                    f"check whether {name} is right",
                )
        if isinstance(exchange, Ask):
            advice = "from now on, requests on this line are sent one at a time"
        else:
            advice = (
                "this controller does not report which motion has ended, so run one motion at a time on this "
                "line, or read the status of each channel"
            )
        return "without an address while several exchanges wait for one", advice


def _selecting(request: type[FramedMessage], replies: Iterable[type[FramedMessage]]) -> list[str]:
    repeated = {name for reply in replies for name in _fields(reply)}
    return [name for name in request.layout.fields if name in repeated - {*request.layout.optional}]


def _fields(reply: type[FramedMessage]) -> Iterable[str]:
    """Return the fields that a reply has in any context."""
    shared: tuple[str, ...] = getattr(reply, "shared", ())  # if the context selects the layout
    return (*reply.layout.fields, *shared)
