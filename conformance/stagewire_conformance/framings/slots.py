"""The codec of command protocols without a header. A reply can only be read with its command."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, NoReturn

from stagewire.errors import BadValueError, MissingFieldError
from stagewire.framing import (
    BadCommandLength,
    CommandReceived,
    Event,
    ReplyReceived,
    TextReceived,
    UnknownCommand,
)
from stagewire.protocols import (
    FORMS,
    SLOTS,
    Command,
    CommandFrame,
    CommandProtocol,
    Layout,
    Reply,
    SetupCommand,
)
from stagewire_conformance.answers import RefusalError
from stagewire_conformance.framings.base import Codec, Json, Part, Reader, in_a_row
from stagewire_conformance.notation import from_hex

DIRECTIONS = ("command", "reply")


class CommandCodec(Codec):
    """Codec for commands with an axis, forms with and without the size slot, and replies."""

    protocol: CommandProtocol
    keys: ClassVar[Mapping[str, Mapping[str, type]]] = {
        "decode": {"direction": str, "command": str},
        # the axis is checked by the codec, like fields
        "encode": {
            "kind": str, "form": str, "direction": str, "axis": object, "fields": dict,
            "extra": str, "allow_dummy": bool, "refuse_prefix_bytes": bool,
        },
        "stream": {"end": str, "command": str},
    }  # fmt: skip
    events: ClassVar[Mapping[type[Event], str]] = {
        CommandReceived: "message",
        ReplyReceived: "message",
        UnknownCommand: "unknown",
        BadCommandLength: "bad_length",
        TextReceived: "text",  # only in recorded sessions; a testee splits one format
    }

    def decoded(self, raw: bytes, request: Mapping[str, Any]) -> CommandFrame | Reply:
        """Decode exactly one command, or the reply to ``command``."""
        if _direction(request) == "command":
            if "command" in request:
                _bad("command requires direction reply")
            return self.protocol.decode(raw)
        if "command" not in request:
            _bad("decoding a reply requires command")
        return self.protocol.decode_reply(raw, request["command"])

    def received(self, event: Event, request: Mapping[str, Any]) -> CommandFrame | Reply | None:
        """Return the command or the reply in an event."""
        if isinstance(event, CommandReceived):
            return event.frame
        return event.reply if isinstance(event, ReplyReceived) else None

    def encode(self, request: Mapping[str, Any]) -> bytes:
        """Encode a command or a reply."""
        name, form = request["message"], self._form(request)
        cls = self.protocol.message_class(name, form)
        kind = request.get("kind", cls.layout.kind)
        if kind != cls.layout.kind:
            raise BadValueError(f"{name} is a {cls.layout.kind}, not a {kind}")
        fields = self._from_json(cls.layout, request.get("fields", {}))
        message: Any = self.protocol.build(name, fields, form)
        if form == "reply":
            _refuse(request, "a reply", "axis", "extra", "allow_dummy", "refuse_prefix_bytes")
            raw: bytes = message.pack()
            return raw
        if issubclass(cls, SetupCommand):
            _refuse(request, "a setup command", "allow_dummy", "refuse_prefix_bytes")
        if issubclass(cls, Command) and "axis" not in request:
            raise MissingFieldError(f"{name} lacks axis")
        extra = from_hex(request.get("extra", ""))
        frame = CommandFrame(message, request.get("axis"), extra, FORMS[form])
        return frame.encode(
            allow_dummy=request.get("allow_dummy", False),
            refuse_prefix_bytes=request.get("refuse_prefix_bytes", False),
        )

    def reading(self, wanted: Mapping[str, Any]) -> Json:
        """Return the command of a reply. A command needs nothing."""
        if self._form(wanted) != "reply":
            return {}
        return {"direction": "reply", "command": wanted["message"]}

    def field_place(self, layout: Layout, offset: int, size: int) -> range:
        """Return the position of a field: after the slots of a command; a reply consists only of data."""
        return super().field_place(layout, offset + (layout.form != "reply") * SLOTS, size)

    def frame_parts(self, layout: Layout, raw: bytes) -> Iterator[Part]:
        """Yield the parts of a command. A reply has none."""
        if layout.kind == "setup":
            yield from in_a_row(("prefix", 1), ("command", 1))
        elif layout.form != "reply":
            yield "terminator", range(len(raw) - 1, len(raw))
            yield from in_a_row(("axis", 1), ("command", 1), ("size", 1))

    def reader(self, request: Mapping[str, Any]) -> Reader:
        """Return a framer of commands, or for the host's end a decoder of the expected reply."""
        if request.get("end", "none") != "host":
            if "command" in request:
                _bad("command requires end host")
            return self.protocol.framer()
        if "command" not in request:
            _bad("replies have no frame: a stream at the end host requires command")
        replies = self.protocol.replies()
        replies.sent(self._asked(request["command"]))
        return replies

    def _asked(self, name: str) -> CommandFrame:
        """Return a frame of the command. Its data and its axis do not matter here."""
        cls: Any = self.protocol.message_class(name, "request")
        if issubclass(cls, SetupCommand):
            return CommandFrame(cls())
        zeros = bytes(SLOTS + cls.layout.length + 1)
        return CommandFrame(cls.unpack(zeros), next(iter(self.protocol.axes.values())))

    def _form(self, request: Mapping[str, Any]) -> str:
        """Return the requested form; without ``form``, ``direction`` selects it."""
        form: str | None = request.get("form")
        if "direction" not in request and form is not None:
            return form
        direction = _direction(request)
        if form is None:
            return "reply" if direction == "reply" else "request"
        if (form == "reply") != (direction == "reply"):
            raise BadValueError(f"{request['message']}: form {form} is not a {direction}")
        return form


def _refuse(request: Mapping[str, Any], what: str, *keys: str) -> None:
    """Raise :class:`BadValueError` for keys that only a command has, unless they are null, false or empty."""
    for key in keys:
        value = request.get(key)
        if value is not None and value is not False and value != "":
            raise BadValueError(
                f"{request['message']}: {what} has no {key}; only a command has one"
            )


def _direction(request: Mapping[str, Any]) -> str:
    direction: str = request.get("direction", "command")
    if direction not in DIRECTIONS:
        _bad(f"direction must be one of {', '.join(DIRECTIONS)}, not {direction!r}")
    return direction


def _bad(detail: str) -> NoReturn:
    raise RefusalError("bad_request", detail)
