"""What the parser of frames with a header knows of a whole protocol: its table and its addresses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from stagewire_generator.model import Message, Protocol
from stagewire_generator.targets.c.entry_view import EntryView
from stagewire_generator.targets.c.names import names_of
from stagewire_generator.targets.c.source import string

__all__ = ["HeaderParserView", "header_parser_view"]

_DIRECTIONS = {"to_host": "TO_HOST", "to_controller": "TO_CONTROLLER", "both": "TO_BOTH"}


@dataclass(frozen=True, slots=True)
class HeaderParserView:
    """The table, and what tells a device from other addresses.

    :param entries: by id, then by length; an id with packets of several lengths has a row for each.
    :param has_several: whether there is such an id.
    :param devices: conditions on ``address``, one of which holds of a device.
    """

    entries: tuple[EntryView, ...]
    has_several: bool
    devices: tuple[str, ...]


def header_parser_view(protocol: Protocol) -> HeaderParserView:
    """Make the view of the parser and of its table."""
    prefix = names_of(protocol).macro_prefix
    messages = [message for message in protocol.messages if message.id is not None]
    return HeaderParserView(
        entries=tuple(entry for message in messages for entry in _entries(prefix, message)),
        has_several=any(len(_lengths(message)) > 1 for message in messages),
        devices=tuple(_conditions(protocol.framing["devices"])),
    )


def _entries(prefix: str, message: Message) -> Iterator[EntryView]:
    """Yield the rows of a message, which are next to each other: no other has its id."""
    forms = list(_forms(message))
    for length in _lengths(message):
        words = " | ".join(f"{prefix}_ENTRY_{form}" for form in forms)
        code = f"{{0x{message.id:04X}U, {length}U, {words}}}"
        yield EntryView(code, string(message.name))
        if "SHORTER" not in forms:
            forms.append("SHORTER")


def _forms(message: Message) -> Iterator[str]:
    """Yield the flags of the first row of a message."""
    if not message.documented:  # framed without looking at its direction
        yield "UNDOCUMENTED"
        return
    yield _DIRECTIONS[message.direction]
    headers = [layout for layout in message.layouts if layout.form == "header"]
    if headers:
        yield "HEADER"
    if any(layout.only_zero for layout in headers):
        yield "ONLY_ZERO"


def _lengths(message: Message) -> list[int]:
    """Return the lengths of the packets of a message, sorted; 0 alone where it has none."""
    return sorted({layout.length for layout in message.layouts if layout.form != "header"}) or [0]


def _conditions(addresses: Iterable[int]) -> Iterator[str]:
    """Yield a condition for each run of addresses without a gap."""
    runs: list[list[int]] = []
    for address in sorted(addresses):
        if runs and address == runs[-1][-1] + 1:
            runs[-1].append(address)
        else:
            runs.append([address])
    for run in runs:
        first, last = f"0x{run[0]:02X}U", f"0x{run[-1]:02X}U"
        if first == last:
            yield f"address == {first}"
        elif run[0] == 0:  # no unsigned number is less
            yield f"address <= {last}"
        else:
            yield f"(address >= {first} && address <= {last})"
