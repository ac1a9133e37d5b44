"""One section of a document of commands: what is printed under a heading, and the command it means."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.model import EnumValue, Field, Json, Message, Protocol
from stagewire_generator.strict_yaml import KeyPath

__all__ = ["Section", "axes_of", "commands_of"]


@dataclass(frozen=True, slots=True)
class Section:
    """What is printed of a command, the command, and where differences are noted.

    :param path: where ``entry`` stands in the file of the witness.
    """

    comparison: Comparison
    command: Message
    entry: Json
    path: KeyPath

    def length(self, form: str) -> int:
        """Return the bytes of the request or of the reply."""
        return next((x.length for x in self.command.layouts if x.form == form), 0)

    @property
    def fields(self) -> list[Field]:
        """The fields of the request and of the reply."""
        return [field for layout in self.command.layouts for field in layout.fields]

    def rows(self, key: str) -> list[tuple[Json, KeyPath]]:
        """Return the rows of a list of the section, each with its path."""
        rows = self.entry.get(key, [])
        return [(row, (*self.path, key, index)) for index, row in enumerate(rows)]


def commands_of(protocol: Protocol, kind: str = "command") -> list[Message]:
    """Return the commands of a kind: ``command``, or ``setup``."""
    return [message for message in protocol.messages if message.kind == kind]


def axes_of(protocol: Protocol) -> tuple[EnumValue, ...]:
    """Return the axis identifiers; none where the enumeration is missing, which is told elsewhere."""
    name = protocol.framing["axes"]
    return next((table.values for table in protocol.enumerations if table.name == name), ())
