"""What a package looks like by the framing of its protocol: its classes, and the protocol object."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from stagewire_generator.model import Message, Protocol
from stagewire_generator.targets.python.class_view import ClassView
from stagewire_generator.targets.python.command_view import command_views
from stagewire_generator.targets.python.message_view import message_views
from stagewire_generator.targets.python.source import (
    WIDTH,
    bracketed,
    call,
    imported,
    literal,
    width,
)

__all__ = ["Framing", "framing_of"]


@dataclass(frozen=True, slots=True)
class Framing:
    """What differs between packages by their framing.

    :param class_views: makes the views of the classes that a message becomes.
    :param message_base: the class that all of them have in common.
    :param imports: the statements that the module of the protocol object needs.
    :param protocol: makes the statement that makes the protocol object.
    """

    class_views: Callable[[Protocol, Message], list[ClassView]]
    message_base: str
    imports: tuple[str, ...]
    protocol: Callable[[Protocol], str]


def framing_of(protocol: Protocol) -> Framing:
    """Return what the framing of a protocol makes of its package."""
    kind: str = protocol.framing["kind"]
    return _FRAMINGS[kind]


def _framed_protocol(protocol: Protocol) -> str:
    framing = protocol.framing
    nameless = {m.name: "the document gives it no id" for m in protocol.messages if m.id is None}
    devices = [f"0x{d:02X}" for d in framing["devices"]]
    reasons = [f"{literal(n)}: {literal(w)}" for n, w in nameless.items()]
    lines = [
        *_named(protocol),
        f"host=0x{framing['host']:02X}",
        _frozenset("devices", devices),
        bracketed("nameless={", reasons, "}", 4, WIDTH - 1),
    ]
    return call("PROTOCOL = FramedProtocol", lines, "", 0, 0)


def _command_protocol(protocol: Protocol) -> str:
    framing = protocol.framing
    axes = next(e for e in protocol.enumerations if e.name == framing["axes"])
    pairs = [f"{literal(axis.name)}: 0x{axis.value:02X}" for axis in axes.values]
    lines = [
        *_named(protocol),
        f"prefix=0x{framing['prefix']:02X}",
        f"terminator=0x{framing['terminator']:02X}",
        bracketed("axes={", pairs, "}", 4, WIDTH - 1),
    ]
    return call("PROTOCOL = CommandProtocol", lines, "", 0, 0)


def _named(protocol: Protocol) -> list[str]:
    names = (protocol.name, protocol.title, protocol.package)
    return [*(literal(name) for name in names), "MESSAGES"]


def _frozenset(name: str, items: list[str]) -> str:
    line = f"{name}=frozenset({{{', '.join(items)}}})"
    if 4 + width(line) + 1 <= WIDTH:
        return line
    return call(f"{name}=frozenset", [bracketed("{", items, "}", 8, 0)], "", 4, 0)


_FRAMINGS = {
    "header": Framing(
        class_views=message_views,
        message_base="FramedMessage",
        imports=(
            imported("stagewire.framed", ["FramedProtocol"]),
            imported("stagewire.framed_message", ["FramedMessage"]),
        ),
        protocol=_framed_protocol,
    ),
    "slots": Framing(
        class_views=command_views,
        message_base="Message",
        imports=(
            imported("stagewire.commands.protocol", ["CommandProtocol"]),
            imported("stagewire.message", ["Message"]),
        ),
        protocol=_command_protocol,
    ),
}
