"""What a package looks like by the framing of its protocol: its messages, and files of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from stagewire_generator.model import Message, Protocol
from stagewire_generator.targets.c.header_parser_view import header_parser_view
from stagewire_generator.targets.c.header_view import header_message_view
from stagewire_generator.targets.c.packet_shape import packet_shape_view
from stagewire_generator.targets.c.packet_table_view import packet_table_view
from stagewire_generator.targets.c.packet_view import packet_message_view
from stagewire_generator.targets.c.slots_table_view import slots_table_view
from stagewire_generator.targets.c.slots_view import slots_message_view

__all__ = ["File", "Framing", "framing_of"]


@dataclass(frozen=True, slots=True)
class File:
    """A file of a package.

    :param path: below the folder of the package.
    :param template: by which it is made; it is given the view of the package as ``package``.
    :param view: what else it is given, as ``view``: makes it from the protocol.
    :param included: whether the umbrella includes it.
    """

    path: str
    template: str
    view: Callable[[Protocol], Any] = lambda _: None
    included: bool = False


@dataclass(frozen=True, slots=True)
class Framing:
    """What differs between packages by their framing.

    :param message: the template of the part of a chapter that is a message; it is given ``message``.
    :param message_view: makes the view for it.
    :param testee: the template of the package's part of the testee.
    :param files: what there is beside enumerations, flags and chapters. ``{package}`` in a path is the
        name of the package.
    """

    message: str
    message_view: Callable[[Protocol, Message], Any]
    testee: str
    files: tuple[File, ...]


def framing_of(protocol: Protocol) -> Framing:
    """Return what the framing of a protocol makes of its package."""
    kind: str = protocol.framing["kind"]
    return _FRAMINGS[kind]


_FRAMINGS = {
    "header": Framing(
        message="header_message.h.j2",
        message_view=header_message_view,
        testee="header_testee.c.j2",
        files=(
            File("wire.h", "header_wire.h.j2", included=True),
            File("parser.h", "header_parser.h.j2", included=True),
            File("{package}.c", "header_parser.c.j2", header_parser_view),
        ),
    ),
    "slots": Framing(
        message="slots_message.h.j2",
        message_view=slots_message_view,
        testee="slots_testee.c.j2",
        files=(
            File("wire.h", "slots_wire.h.j2", slots_table_view, included=True),
            File("parser.h", "slots_parser.h.j2", included=True),
            File("replies.h", "slots_replies.h.j2", included=True),
            File("{package}.c", "slots_parser.c.j2", slots_table_view),
        ),
    ),
    "packet": Framing(
        message="packet_message.h.j2",
        message_view=packet_message_view,
        testee="packet_testee.c.j2",
        files=(
            File("wire.h", "packet_wire.h.j2", packet_shape_view, included=True),
            File("parser.h", "packet_parser.h.j2", included=True),
            File("{package}.c", "packet_parser.c.j2", packet_table_view),
        ),
    ),
}
