"""The answers of a testee: messages as JSON objects, and refusals."""

from __future__ import annotations

import typing
from functools import singledispatch
from typing import Any, TypeAlias

from stagewire.errors import CodecError
from stagewire.protocols import (
    CommandFrame,
    Frame,
    Message,
    Packet,
    Reply,
    UndecidedMessage,
    UndocumentedMessage,
)

Json = dict[str, Any]


class Carrier(typing.Protocol):
    """An object with a message, such as a frame, a command or a packet."""

    @property
    def message(self) -> Message:
        """The message."""
        ...


Decoded: TypeAlias = Carrier | Reply
"""The result of decoding, with any framing."""

ADDRESSES = ("dest", "source", "axis", "address")
"""The keys of an answer with the addressee of a message. They depend on the protocol."""

_MAXIMUM_DETAIL = 500


class RefusalError(Exception):
    """A refused request, with a refusal code of the testee protocol and a sentence."""

    def __init__(self, code: str, detail: str) -> None:
        self.code = code
        self.detail = detail
        super().__init__(detail)


def refusal(error: RefusalError | CodecError) -> Json:
    """Return the refusal part of an answer."""
    detail = error.detail if isinstance(error, RefusalError) else str(error)
    if len(detail) > _MAXIMUM_DETAIL:
        detail = f"{detail[:_MAXIMUM_DETAIL]}…"
    return {"ok": False, "error": error.code, "detail": detail}


def message_of(decoded: Decoded) -> Message:
    """Return the message. A reply is itself the message."""
    return decoded if isinstance(decoded, Reply) else decoded.message


@singledispatch
def frame_answer(frame: object) -> Json:
    """Return a decoded frame, command, reply or packet as a JSON object.

    Integers become integers, byte strings hex, text text; bytes beyond the layout are ``extra``. Types of
    other framings are registered in the modules of their codecs.
    """
    raise TypeError(f"{frame!r} is not a decoded message")


@frame_answer.register
def _(frame: Frame) -> Json:
    """Return message, form, addresses and fields of a frame with a header."""
    message = frame.message
    answer: Json = {
        "message": message.layout.message,
        "form": message.layout.form,
        "dest": frame.dest,
        "source": frame.source,
        "fields": fields_answer(message),
    }
    if isinstance(message, UndecidedMessage):
        # The whole payload, which is enough to encode the message again.
        answer["data"] = (message.data + frame.extra).hex()
    elif isinstance(message, UndocumentedMessage):
        answer["data"] = None if message.data is None else message.data.hex()
    elif frame.extra:
        answer["extra"] = frame.extra.hex()
    return answer


@frame_answer.register
def _(frame: CommandFrame) -> Json:
    """Return command, kind, form, axis and fields. A setup command has no axis."""
    message = frame.message
    answer: Json = {
        "message": message.layout.message,
        "kind": message.layout.kind,
        "form": frame.form,
    }
    if frame.axis is not None:
        answer["axis"] = frame.axis
    answer["fields"] = fields_answer(message)
    if frame.extra:
        answer["extra"] = frame.extra.hex()
    return answer


@frame_answer.register
def _(packet: Packet) -> Json:
    """Return message, form, address and fields of a packet. Some protocols have no address."""
    layout = packet.message.layout
    answer: Json = {"message": layout.message, "form": layout.form}
    if packet.address is not None:
        answer["address"] = packet.address
    answer["fields"] = fields_answer(packet.message)
    if packet.extra:
        answer["extra"] = packet.extra.hex()
    return answer


@frame_answer.register
def _(reply: Reply) -> Json:
    """Return the fields of a reply. It does not contain its axis."""
    layout = reply.layout
    return {
        "message": layout.message,
        "kind": layout.kind,
        "form": layout.form,
        "fields": fields_answer(reply),
    }


def fields_answer(message: Message) -> Json:
    """Return the fields of a message.

    A header parameter without a name is included if it is not zero, or if the message would otherwise encode
    differently.
    """
    if isinstance(message, UndecidedMessage):
        return {name: _plain(getattr(message, name)) for name in message.shared}
    if isinstance(message, UndocumentedMessage):
        parameters = {"param1": message.param1, "param2": message.param2}
        return {name: value for name, value in parameters.items() if value}
    layout = message.layout
    return {
        name: _plain(value)
        for name, value in message.values().items()
        if name not in layout.unnamed or value or layout.constants.get(name)
    }


def _plain(value: Any) -> int | str | list[int]:
    if isinstance(value, bytes):
        return value.hex()
    if isinstance(value, tuple):
        return [int(number) for number in value]
    return value if isinstance(value, str) else int(value)
