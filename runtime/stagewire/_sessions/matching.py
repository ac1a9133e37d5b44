"""Whose answer a frame is: by message, by address, and by what request and reply both say.

**Address.** Each bay of a rack is channel 1, so that the frames of two bays differ by their source alone.
Some controllers answer with addresses 0, or with those of the request, unswapped. So the *effective source*
of a frame is its source if that is the address of a controller; else its destination if the frame is
unswapped (its source is the host); else it is unknown. An unknown source may be any, another documented one
never is.

**Fields.** What a request names (its channel, its bay) the reply has to repeat. Fields that a request has but
does not use, the reserved ones, select nothing. Messages are told by their id: whether a controller sends the
short or the long form makes no difference.
"""

from __future__ import annotations

from collections.abc import Iterable

from stagewire._framings.header.frame import Received, Undocumented
from stagewire._framings.header.message import DATA_FLAG, FramedMessage
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._sessions.framed_exchanges import Ask, FramedExchange, Halt, Motion

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import TypeAlias

    Classes: TypeAlias = tuple[type[FramedMessage], ...]


class Matching:
    """What matching has to know of a protocol."""

    def __init__(self, protocol: FramedProtocol) -> None:
        self._host = protocol.host
        self._devices = protocol.devices
        self._channel = protocol.channel
        self._ids: dict[Classes, frozenset[int]] = {}
        self._selecting: dict[tuple[type[FramedMessage], Classes], tuple[str, ...]] = {}

    def source_of(self, raw: bytes) -> int | None:
        """Return the effective source of a frame; None: it is unknown."""
        source = raw[5]
        if source in self._devices:
            return source
        dest = raw[4] & ~DATA_FLAG
        return dest if source == self._host and dest in self._devices else None

    def ids_of(self, classes: Classes) -> frozenset[int]:
        """Return the ids of messages."""
        ids = self._ids.get(classes)
        if ids is None:
            ids = self._ids[classes] = frozenset(cls.layout.id for cls in classes)
        return ids

    def selected(self, message: FramedMessage, replies: Classes) -> tuple[tuple[str, object], ...]:
        """Return the fields of a request that its replies repeat, with their values."""
        request = type(message)
        names = self._selecting.get((request, replies))
        if names is None:
            names = self._selecting[request, replies] = tuple(_selecting(request, replies))
        return tuple([(name, getattr(message, name)) for name in names])

    def channel_of(self, message: FramedMessage) -> int | None:
        """Return the channel that a message is about; None: it names none."""
        return None if self._channel is None else getattr(message, self._channel, None)

    def pass_over(
        self, exchange: FramedExchange, event: Received | Undocumented, began: int
    ) -> None:
        """Note in an exchange, unless it has ended, why a frame was not taken for what it awaits.

        :param began: how many bytes had come before the frame.
        """
        if not exchange.done:
            why, advice = self._why_not(exchange, event, began)
            exchange.pass_over((event.id, why, advice), event.raw)

    def _why_not(
        self, exchange: FramedExchange, event: Received | Undocumented, began: int
    ) -> tuple[str, str]:
        source = self.source_of(event.raw)
        if began < exchange.after:
            return "which began before this was sent", ""
        if source is not None and source != exchange.dest:
            return f"from {source:#04x}", "see whether the address or bay is the right one"
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
                    f"see whether {name} is the right one",
                )
        if isinstance(exchange, Ask):
            advice = "from now on one request at a time is sent on this line"
        else:
            advice = (
                "this controller does not say what has ended, so run one motion at a time on this line, or "
                "read the status of each channel"
            )
        return "without an address, while several wait for one", advice


def _selecting(request: type[FramedMessage], replies: Iterable[type[FramedMessage]]) -> list[str]:
    repeated = {name for reply in replies for name in _fields(reply)}
    return [name for name in request.layout.fields if name in repeated - {*request.layout.optional}]


def _fields(reply: type[FramedMessage]) -> Iterable[str]:
    """Return the fields that a reply certainly has."""
    shared: tuple[str, ...] = getattr(reply, "shared", ())  # of a layout that only context decides
    return (*reply.layout.fields, *shared)
