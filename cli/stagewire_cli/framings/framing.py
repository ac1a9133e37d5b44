"""Interface of a framing for ``stagewire decode`` and ``encode``, and the options of ``decode``."""

from __future__ import annotations

import abc
import enum
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stagewire.capture import Heading
from stagewire.errors import BadValueError, CodecError
from stagewire.protocols import Protocol
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.task import Task
from stagewire_conformance.framings import codec_of

if TYPE_CHECKING:
    from rich.console import Console

Json = dict[str, Any]

SEVERAL = "to decode several {} at once, give a file, standard input, or --end"
"""A hint for bytes after the first message."""


class DirectionOption(enum.Enum):
    """Values of ``--direction``."""

    COMMAND = "command"
    REPLY = "reply"


@dataclass(frozen=True)
class Options:
    """The options that select the protocol, direction and message, as given.

    :param contexts: values of ``--context``, NAME=VALUE.
    :param recorded: the heading of the input if it is a capture, which adds to the options.
    """

    protocol: str | None = None
    status: str | None = None
    direction: DirectionOption | None = None
    command: str | None = None
    message: str | None = None
    recorded: Heading | None = None
    contexts: tuple[str, ...] = ()

    @property
    def context(self) -> dict[str, str] | None:
        """The context that selects layouts, with the status; None if there is none."""
        found = {} if self.status is None else {"status": self.status}
        for text in self.contexts:
            name, equals, value = text.partition("=")
            if not (name and equals and value):
                raise CalledWronglyError(f"--context: {text!r} must be NAME=VALUE")
            if found.setdefault(name, value) != value:
                raise CalledWronglyError(f"--context: {text} contradicts {name}={found[name]}")
        return found or None

    def refuse_commands(self, why: str) -> None:
        """Raise for options that apply only to protocols of commands."""
        for option, value in (("--direction", self.direction), ("--command", self.command)):
            if value is not None:
                raise CalledWronglyError(
                    f"{option} applies only to protocols of commands and replies; {why}"
                )

    def check_context(self, protocol: Protocol) -> None:
        """Raise for a context that the codec of a protocol does not support."""
        try:
            codec_of(protocol).check_context(self.context)
        except BadValueError as error:
            option = "--context" if self.contexts else "--status"
            raise CalledWronglyError(f"{option}: {error}") from None


class Framing(abc.ABC):
    """The framing of a protocol for the command.

    :param protocol: the protocol.
    """

    def __init__(self, protocol: Any) -> None:
        self.protocol = protocol

    @abc.abstractmethod
    def task(self, options: Options) -> Task:
        """Return the decoding task for the options. Raises :class:`CalledWronglyError` for invalid ones."""

    @abc.abstractmethod
    def envelope(self, name: str, given: Json) -> Json:
        """Return the parts of a message in addition to its fields, such as its addresses.

        :param name: the name of the message.
        :param given: the options given to ``stagewire encode``.
        """

    def show(self, out: Console, id: int) -> None:  # noqa: B027 - optional for framings
        """Print the framing of a message with this id, if the registry's entry does not show it."""

    def _refuse_others(self, given: Json, *allowed: str) -> None:
        for key in given:
            if key not in allowed:
                option = f"--{key.replace('_', '-')}"
                raise CalledWronglyError(
                    f"{option} does not apply to messages of {self.protocol.name}"
                )


def message_class(protocol: Protocol, option: str, name: str, form: str | None) -> Any:
    """Return the class of a message by a name in any case."""
    spelled = {cls.layout.message.lower(): cls.layout.message for cls in protocol.messages}
    try:
        return protocol.message_class(spelled.get(name.lower(), name), form)
    except CodecError as error:
        raise CalledWronglyError(f"{option}: {error}") from None
