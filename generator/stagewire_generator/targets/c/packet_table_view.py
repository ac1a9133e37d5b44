"""What the parser of packets knows of a whole protocol: its table."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Protocol
from stagewire_generator.targets.c.entry_view import EntryView
from stagewire_generator.targets.c.source import string

__all__ = ["PacketTableView", "packet_table_view"]


@dataclass(frozen=True, slots=True)
class PacketTableView:
    """The table.

    :param entries: by id, then by length; an id with payloads of several lengths has a row for each.
    :param start: how many bytes begin every packet.
    """

    entries: tuple[EntryView, ...]
    start: int


def packet_table_view(protocol: Protocol) -> PacketTableView:
    """Make the view of the table."""
    rows = sorted(
        (message.id, length, message.name)
        for message in protocol.messages
        if message.id is not None
        for length in {layout.length for layout in message.layouts}
    )
    digits = protocol.id_digits
    return PacketTableView(
        entries=tuple(
            EntryView(f"{{0x{id:0{digits}X}U, {length}U}}", string(name))
            for id, length, name in rows
        ),
        start=len(protocol.framing["start"]),
    )
