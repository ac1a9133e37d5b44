"""What the parser of commands and the reader of replies know of a whole protocol."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Message, Protocol
from stagewire_generator.targets.c.entry_view import EntryView
from stagewire_generator.targets.c.names import names_of
from stagewire_generator.targets.c.source import string

__all__ = ["SlotsTableView", "slots_table_view"]


@dataclass(frozen=True, slots=True)
class SlotsTableView:
    """All commands.

    :param entries: commands by their bytes, then setup commands.
    :param setup: bytes of the setup commands.
    :param longest_reply: its bytes; 1 where no command has a reply, since no array is empty in C.
    """

    entries: tuple[EntryView, ...]
    setup: tuple[str, ...]
    longest_reply: int


def slots_table_view(protocol: Protocol) -> SlotsTableView:
    """Make the view of the table."""
    commands = [message for message in protocol.messages if message.kind == "command"]
    setup = [message for message in protocol.messages if message.kind == "setup"]
    return SlotsTableView(
        entries=tuple(_entry(protocol, message) for message in (*commands, *setup)),
        setup=tuple(_byte(message) for message in setup),
        longest_reply=max([1, *(_length(message, "reply") for message in commands)]),
    )


def _entry(protocol: Protocol, message: Message) -> EntryView:
    kind = f"{names_of(protocol).macro_prefix}_KIND_{message.kind.upper()}"
    lengths = [f"{_length(message, 'reply')}U", _byte(message), kind]
    lengths += [f"{message.size or 0}U", f"{_length(message, 'request')}U"]
    return EntryView(code=f"{{{', '.join(lengths)}}}", name=string(message.name))


def _byte(message: Message) -> str:
    return f"0x{message.id:02X}U"


def _length(message: Message, form: str) -> int:
    """Return the bytes of a request or a reply, 0 if there is none."""
    return sum(layout.length for layout in message.layouts if layout.form == form)
