"""The class of protocols with commands: decoding, the framer and the decoder of replies.

If bytes are not exactly one command, the error names the first slot that is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from stagewire._codec.message import Message
from stagewire._codec.protocol import Protocol, as_bytes
from stagewire._framings.slots.command import (
    MAXIMUM_COMMAND,
    SLOTS,
    Command,
    Marks,
    Reply,
    SetupCommand,
)
from stagewire._framings.slots.frame import CommandFrame, CommandReceived, make_command_frame
from stagewire._framings.slots.framer import CommandFramer, Request, Rule
from stagewire._framings.slots.replies import ReplyDecoder, decode_reply
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    DecodeError,
    TrailingBytesError,
    TruncatedError,
    UnknownMessageError,
)


def refusal(title: str, rule: Rule, raw: bytes) -> DecodeError | UnknownMessageError:
    """Return the error for bytes that are not exactly one command or setup command.

    :param title: name of the protocol, for people.
    """
    marks = rule.marks
    end = marks.terminator
    if not raw:
        return _missing(raw, "a command begins with its axis or the prefix of a setup command")
    if raw[0] == end:
        return BadLengthError(f"byte 0: {end:#04x} ends a command that has no axis", range(1))
    if len(raw) == 1:
        return _missing(raw, "byte 1 is the byte of the command")
    byte = raw[1]
    if raw[0] == marks.prefix:
        if byte in marks.setup:
            return _trailing(raw, marks.setup[byte], 2)
        text = f"byte 1: no setup command of {title} has the byte {byte:#04x}"
        return UnknownMessageError(text, range(1, 2))
    if byte == end:
        return BadLengthError(f"byte 1: {end:#04x} aborts a command that has no byte", range(1, 2))
    if byte not in rule.requests:
        text = f"byte 1: no command of {title} has the byte {byte:#04x}"
        return UnknownMessageError(text, range(1, 2))
    return _behind_the_byte(rule, raw)


def _behind_the_byte(rule: Rule, raw: bytes) -> DecodeError:
    """Return the error for a command with a wrong size, wrong data or a wrong end."""
    end = rule.marks.terminator
    request = rule.requests[raw[1]]
    name, length = request.name, request.length
    ways = f"{request.size}" if length else f"{request.size}, or {end:#04x} to leave it out"
    if len(raw) < SLOTS:
        return _missing(raw, f"{name}: byte 2 is its size, {ways}")
    if raw[2] == end and not length:
        return _trailing(raw, name, SLOTS)
    if raw[2] != request.size:
        came = f"{end:#04x}, which leaves it out" if raw[2] == end else f"{raw[2]}"
        return BadLengthError(f"{name}: byte 2 is its size, {ways}; not {came}", range(2, 3))
    found = raw.find(end, SLOTS + length, MAXIMUM_COMMAND)
    if found >= 0:
        return _trailing(raw, name, found + 1)
    if len(raw) >= MAXIMUM_COMMAND:
        text = f"{name}: {end:#04x} must follow within {MAXIMUM_COMMAND} bytes"
        return BadLengthError(text, range(MAXIMUM_COMMAND - 1, MAXIMUM_COMMAND))
    due = f"expected {length} bytes of data and {end:#04x}" if length else f"expected {end:#04x}"
    return _missing(raw, f"{name}: {due}")


def _missing(raw: bytes, text: str) -> TruncatedError:
    size = len(raw)
    return TruncatedError(f"{text}; the bytes end before byte {size}", range(size, size + 1))


def _trailing(raw: bytes, name: str, end: int) -> TrailingBytesError:
    more = len(raw) - end
    text = f"{name} ends before byte {end}; found {more} more byte{'s' if more > 1 else ''}"
    return TrailingBytesError(text, range(end, len(raw)))


TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import TypeVar

    _Kind = TypeVar("_Kind", Command, SetupCommand)


Unpack = Callable[[bytes], Command]


class CommandProtocol(Protocol):
    """A protocol of commands without a header and replies without a frame.

    A command class belongs to the one protocol that lists it. The protocol sets its marks.

    :param name: name in the registry.
    :param title: name for people.
    :param package: the generated package; it holds ``registry.json`` and ``vectors.json``.
    :param messages: all classes of commands, setup commands and replies.
    :param prefix: the byte that begins a setup command.
    :param terminator: the byte that ends a command.
    :param axes: the documented identifiers of axes by name; others are also accepted.

    Raises :class:`ValueError` for commands that a stream cannot hold or cannot distinguish.
    """

    def __init__(
        self,
        name: str,
        title: str,
        package: str,
        messages: Iterable[type[Message]],
        prefix: int,
        terminator: int,
        axes: Mapping[str, int],
    ) -> None:
        super().__init__(name, title, package, messages, nameless={})
        self.axes = dict(axes)
        self._commands: dict[int, type[Command]] = {}
        self._setup: dict[int, type[SetupCommand]] = {}
        for cls in self.messages:
            if issubclass(cls, Command):
                _add(self._commands, cls)
                other = _other_form(cls)
                if other is not None:
                    self._by_name[cls.layout.message][other] = cls
            elif issubclass(cls, SetupCommand):
                _add(self._setup, cls)
        setup = {byte: cls.layout.message for byte, cls in self._setup.items()}
        self.marks = Marks(prefix, terminator, setup)
        self.rule = Rule(self.marks, {byte: _request(cls) for byte, cls in self._commands.items()})
        classes: tuple[type[Command | SetupCommand], ...]
        classes = (*self._commands.values(), *self._setup.values())
        for command in classes:
            taken: Marks | None = vars(command).get("marks")
            if taken is not None and taken.pair != self.marks.pair:
                raise ValueError(f"{command.__name__} belongs to a protocol with other marks")
            command.marks = self.marks
        # Command byte and size slot -> unpack, bytes without ignored ones, whether it has the slot.
        self._usual: dict[bytes, tuple[Unpack, int, bool]] = {
            slots: (self._commands[slots[0]].unpack, size, slots[1] != terminator)
            for slots, size in self.rule.usual.items()
        }

    # Decoding

    def decode(self, raw: bytes) -> CommandFrame:
        """Decode the bytes of exactly one command or setup command.

        Raises :class:`~stagewire.errors.TruncatedError`, :class:`~stagewire.errors.TrailingBytesError`,
        :class:`~stagewire.errors.BadLengthError` or :class:`~stagewire.errors.UnknownMessageError`,
        and :class:`~stagewire.errors.BadValueError` if ``raw`` is not bytes, such as hex text.
        """
        if raw.__class__ is not bytes:
            raw = as_bytes(raw)
        usual = self._usual.get(raw[1:3])
        if usual is not None:
            unpack, size, sized = usual
            marks = self.marks
            axis, end = raw[0], marks.terminator
            if len(raw) == size and raw[-1] == end and axis != end and axis != marks.prefix:
                return make_command_frame(unpack(raw), axis, b"", sized)
        return self._decode(raw)

    def _decode(self, raw: bytes) -> CommandFrame:
        kind, end = self.rule.begins(raw, 0)
        if kind is not CommandReceived or end != len(raw):
            raise refusal(self.title, self.rule, raw)
        if raw[0] == self.marks.prefix:
            return make_command_frame(self._setup[raw[1]].unpack(raw), None, b"", False)
        cls = self._commands[raw[1]]
        extra = raw[SLOTS + cls.layout.length : -1]
        return make_command_frame(cls.unpack(raw), raw[0], extra, len(raw) > SLOTS)

    def decode_reply(
        self, raw: bytes, command: str | type[Message] | Message | CommandFrame
    ) -> Reply:
        """Decode all the bytes of the reply to ``command``, a name, a class or an object.

        Raises :class:`~stagewire.errors.TruncatedError` or
        :class:`~stagewire.errors.TrailingBytesError` for another number of bytes,
        :class:`~stagewire.errors.BadLengthError` for a command that has no reply,
        :class:`~stagewire.errors.UnknownMessageError` for an unknown name, and
        :class:`~stagewire.errors.BadValueError` if ``raw`` is not bytes or ``command`` is not a command.
        """
        if isinstance(command, str):
            cls = self.message_class(command)
        elif isinstance(command, type):
            cls = command
        else:
            cls = type(command.message if isinstance(command, CommandFrame) else command)
        if not issubclass(cls, (Command, SetupCommand)):
            raise BadValueError(f"decode_reply takes the command of the reply, not {command!r}")
        return decode_reply(as_bytes(raw), cls)

    # Streams

    def framer(self) -> CommandFramer:
        """Return a new framer for the bytes from a host."""
        return CommandFramer(self.rule, self.decode)

    def replies(self) -> ReplyDecoder:
        """Return a new decoder for the bytes from a controller."""
        return ReplyDecoder()

    def _certain(self, forms: Iterable[str]) -> list[str]:
        return ["request"]


def _add(known: dict[int, type[_Kind]], cls: type[_Kind]) -> None:
    layout = cls.layout
    if layout.id in known:
        other = known[layout.id].layout.message
        raise ValueError(f"{layout.message} and {other} have the same byte {layout.id:#04x}")
    known[layout.id] = cls


def _request(cls: type[Command]) -> Request:
    layout = cls.layout
    return Request(layout.message, layout.length, layout.size or 0)


def _other_form(cls: type[Command]) -> str | None:
    """Return the form that the document does not print; None if there is no other."""
    if cls.layout.length:
        return None
    return "request:with_size" if cls.layout.size is None else "request:without_size"
