"""Commands without a header, and their replies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stagewire.framing import End, HostListener, ReplyListener
from stagewire.protocols import CommandFrame, CommandProtocol, Direction, Message
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.sinks import Column
from stagewire_cli.formats.task import MessageRows, Task
from stagewire_cli.framings.framing import DirectionOption, Framing, Json, Options, message_class
from stagewire_cli.values import parse_axis
from stagewire_conformance.answers import Decoded
from stagewire_conformance.framings.base import Reader


class CommandTask(Task):
    """Commands, or the replies to one of them.

    :param command: the command whose replies are decoded; None to decode commands.
    :param form: the selected form of a command; None for all.
    """

    protocol: CommandProtocol
    addresses = (Column("axis", "uint8"),)

    def __init__(
        self,
        protocol: CommandProtocol,
        command: str | None = None,
        only: type[Message] | None = None,
        form: str | None = None,
    ) -> None:
        replies = {} if command is None else {"direction": "reply", "command": command}
        super().__init__(protocol, replies, only)
        self.form = form

    def reader(self, end: End | None) -> Reader:
        """Return a framer for commands; replies have no frames, so their stream cannot be cut."""
        if "command" in self.request or end is End.HOST:
            raise CalledWronglyError(
                "a stream of replies cannot be decoded, because they have no frames; give them one by one, "
                "in hex or as JSON captures, with --direction reply and --command"
            )
        return super().reader(end)

    def readers(self) -> Mapping[Direction, Reader]:
        """Return a reader for commands and text, and one that uses these to decode replies."""
        replies = ReplyListener()
        return {
            Direction.TO_CONTROLLER: HostListener(self.protocol, replies),
            Direction.TO_HOST: replies,
        }

    def wants(self, decoded: Decoded) -> bool:
        """Return whether a message is selected; a command with and without its size has the same class."""
        if isinstance(decoded, CommandFrame) and self.form not in (None, decoded.form):
            return False
        return super().wants(decoded)

    def typed_rows(self) -> MessageRows:
        """Return rows with the columns of the registry."""
        return MessageRows(self)


class SlotsFraming(Framing):
    """The framing of a protocol of commands without a header."""

    protocol: CommandProtocol

    def task(self, options: Options) -> CommandTask:
        """Return the decoding task for the options."""
        protocol = self.protocol
        options.check_context(protocol)
        command = options.command
        if options.direction is DirectionOption.REPLY and command is None:
            raise CalledWronglyError("a reply does not name its command; give it with --command")
        if options.direction is DirectionOption.COMMAND and command is not None:
            raise CalledWronglyError(
                "--command selects replies and contradicts --direction command"
            )
        if command is not None:
            command = message_class(protocol, "--command", command, None).layout.message
        if options.message is None:
            return CommandTask(protocol, command)
        name, colon, form = options.message.partition(":")
        only = message_class(protocol, "--message", name, form if colon else None)
        if command is not None:
            return CommandTask(protocol, command, _answer(protocol, command, only, form))
        if form == "reply" and not options.recorded:
            raise CalledWronglyError(
                f"--message: {options.message} is not a command; decode replies with --command {name}"
            )
        return CommandTask(protocol, command, only, form or None)

    def envelope(self, name: str, given: Json) -> Json:
        """Return the axis and the options of a command; an axis may be given by name."""
        protocol = self.protocol
        self._refuse_others(given, "axis", "allow_dummy", "refuse_prefix_bytes")
        if "axis" in given:
            given["axis"] = parse_axis("--axis", given["axis"], protocol.axes)
        return given


def _answer(protocol: CommandProtocol, command: str, only: type[Message], form: str) -> Any:
    """Return the class of the replies to a command; raise if the options select another message."""
    answer = message_class(protocol, "--command", command, None).reply
    if answer is None:
        raise CalledWronglyError(f"--message: {command} has no reply")
    if only.layout.message != command or form not in ("", "reply"):
        wanted = ":".join(part for part in (only.layout.message, form) if part)
        raise CalledWronglyError(
            f"--message: replies to {command} are {command}:reply, not {wanted}"
        )
    return answer
