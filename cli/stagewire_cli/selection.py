"""What the options of ``stagewire decode`` ask for: which protocol, which way, which message."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from stagewire.capture import Heading
from stagewire.errors import BadValueError, CodecError
from stagewire.protocols import (
    CommandProtocol,
    FramedProtocol,
    Message,
    PacketProtocol,
    Protocol,
    UndecidedMessage,
)
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.task import CommandTask, FramedTask, PacketTask, Task
from stagewire_cli.protocols import choose, choose_by_message
from stagewire_conformance.codec import codec_of


class Direction(enum.Enum):
    """What ``--direction`` takes."""

    COMMAND = "command"
    REPLY = "reply"


@dataclass(frozen=True)
class Selection:
    """The options that say what is to be decoded, as they were given.

    :param recorded: the heading of the capture that is decoded, if it is one; it says more than options do.
    """

    protocol: str | None = None
    status: str | None = None
    direction: Direction | None = None
    command: str | None = None
    message: str | None = None
    recorded: Heading | None = None

    def task(self) -> Task:
        """Return what is to be decoded. Raises :class:`CalledWronglyError`."""
        if self.recorded:
            task = self._of_capture(self.recorded)._task()
            task.records()
            return task
        return self._task()

    def _of_capture(self, recorded: Heading) -> Selection:
        """Return the options that a capture makes of these; raise for one that contradicts it."""
        for option, value in (("--direction", self.direction), ("--command", self.command)):
            if value is not None:
                raise CalledWronglyError(
                    f"{option} is for bytes alone; a capture says which way they went"
                )
        if self.protocol not in (None, recorded.protocol):
            raise CalledWronglyError(
                f"--protocol {self.protocol} contradicts the capture, which is one of {recorded.protocol}"
            )
        status = self.status or _status(recorded)
        return replace(self, protocol=recorded.protocol, status=status)

    def _task(self) -> Task:
        protocol = self._protocol()
        for cls, task in _TASKS.items():
            if isinstance(protocol, cls):
                return task(self, protocol)
        raise CalledWronglyError(
            f"{protocol.name}: its bytes cannot be decoded by this command, which does not know protocols "
            f"of the class {type(protocol).__name__}"
        )

    def _protocol(self) -> Protocol:
        """Return the protocol that the options are for; by themselves bytes are taken for frames."""
        named = {"--command": self.command, "--message": (self.message or "").partition(":")[0]}
        for option, name in named.items():
            if name:
                try:
                    return choose_by_message(self.protocol, name)
                except CalledWronglyError as error:
                    raise CalledWronglyError(f"{option}: {error}") from None
        kind = FramedProtocol if self.direction is None else CommandProtocol
        return choose(self.protocol, lambda protocol: isinstance(protocol, kind))

    def _of_frames(self, protocol: FramedProtocol) -> FramedTask:
        self._no_commands(f"frames of {protocol.name} say themselves which way they go")
        context = None if self.status is None else {"status": self.status}
        self._check(protocol, context)
        if self.message is None:
            return FramedTask(protocol, context)
        only = _wanted(protocol, self.message, context or {})
        return FramedTask(protocol, _agreed(only, context), only)

    def _of_commands(self, protocol: CommandProtocol) -> CommandTask:
        if self.status is not None:
            self._check(protocol, {"status": self.status})
        command = self.command
        if self.direction is Direction.REPLY and command is None:
            raise CalledWronglyError(
                "a reply does not say what it answers; name its command by --command"
            )
        if self.direction is Direction.COMMAND and command is not None:
            raise CalledWronglyError("--command is for replies; it contradicts --direction command")
        if command is not None:
            command = _class(protocol, "--command", command, None).layout.message
        if self.message is None:
            return CommandTask(protocol, command)
        name, colon, form = self.message.partition(":")
        only = _class(protocol, "--message", name, form if colon else None)
        if command is not None:
            return CommandTask(protocol, command, _answer(protocol, command, only, form))
        if form == "reply" and not self.recorded:
            raise CalledWronglyError(
                f"--message: no command is {self.message}; replies are decoded by --command {name}"
            )
        return CommandTask(protocol, command, only, form or None)

    def _of_packets(self, protocol: PacketProtocol) -> PacketTask:
        self._no_commands(f"packets of {protocol.name} look alike both ways")
        if self.status is not None:
            self._check(protocol, {"status": self.status})
        if self.message is None:
            return PacketTask(protocol)
        name, colon, form = self.message.partition(":")
        return PacketTask(protocol, _class(protocol, "--message", name, form if colon else None))

    def _no_commands(self, why: str) -> None:
        """Raise for the options that only protocols of commands have."""
        for option, value in (("--direction", self.direction), ("--command", self.command)):
            if value is not None:
                raise CalledWronglyError(
                    f"{option} is for protocols of commands and replies; {why}"
                )

    def _check(self, protocol: Protocol, context: Mapping[str, str] | None) -> None:
        try:
            codec_of(protocol).check_context(context)
        except BadValueError as error:
            raise CalledWronglyError(f"--status: {error}") from None


_TASKS: dict[type[Protocol], Callable[[Selection, Any], Task]] = {
    CommandProtocol: Selection._of_commands,
    FramedProtocol: Selection._of_frames,
    PacketProtocol: Selection._of_packets,
}


def _status(recorded: Heading) -> str | None:
    """Return the status block that the unit of a capture sends, as far as one has to be told."""
    protocol = choose(recorded.protocol, lambda _: True)
    known = codec_of(protocol).contexts.get("status", ())
    units = protocol.registry()["units"]
    found = (unit.get("status") for unit in units if unit["name"] == recorded.unit)
    return next((status for status in found if status in known), None)


def _class(protocol: Protocol, option: str, name: str, form: str | None) -> Any:
    """Return the class of a message by a name in any case."""
    spelled = {cls.layout.message.lower(): cls.layout.message for cls in protocol.messages}
    try:
        return protocol.message_class(spelled.get(name.lower(), name), form)
    except CodecError as error:
        raise CalledWronglyError(f"{option}: {error}") from None


def _answer(protocol: CommandProtocol, command: str, only: type[Message], form: str) -> Any:
    """Return the class of the replies to a command; raise unless they are what is wanted."""
    answer = _class(protocol, "--command", command, None).reply
    if answer is None:
        raise CalledWronglyError(f"--message: {command} has no reply")
    if only.layout.message != command or form not in ("", "reply"):
        wanted = ":".join(part for part in (only.layout.message, form) if part)
        raise CalledWronglyError(
            f"--message: replies to {command} are {command}:reply and never {wanted}"
        )
    return answer


def _wanted(protocol: FramedProtocol, text: str, context: Mapping[str, str]) -> type[Message]:
    name, colon, form = text.partition(":")
    if not colon:
        for cls in protocol.messages:
            layout = cls.layout
            named = layout.message.lower() == name.lower()
            if named and layout.when and layout.when.items() <= context.items():
                return cls
    found: type[Message] = _class(protocol, "--message", name, form if colon else None)
    return found


def _agreed(only: type[Message], context: dict[str, str] | None) -> dict[str, str] | None:
    """Return the context that gives frames the wanted layout; raise where another was asked for."""
    layout = only.layout
    if context and issubclass(only, UndecidedMessage):
        raise CalledWronglyError(f"--message: {layout.form} is how frames come without --status")
    if not layout.when:
        return context
    if context and not layout.when.items() <= context.items():
        said = ", ".join(f"--{key} {value}" for key, value in context.items())
        raise CalledWronglyError(f"--message: the form {layout.form} contradicts {said}")
    return {**layout.when, **(context or {})}
