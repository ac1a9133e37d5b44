"""What a package looks like by the framing of its protocol: its classes, and the protocol object."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from stagewire_generator.model import Message, Protocol
from stagewire_generator.targets.python.class_view import ClassView
from stagewire_generator.targets.python.command_view import command_views
from stagewire_generator.targets.python.message_view import message_views
from stagewire_generator.targets.python.packet_shape import check_class, shape
from stagewire_generator.targets.python.packet_view import packet_views
from stagewire_generator.targets.python.source import (
    SUPPORT,
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
    :param imports: makes the statements that the module of the protocol object needs.
    :param protocol: makes the statement that makes the protocol object.
    """

    class_views: Callable[[Protocol, Message], list[ClassView]]
    message_base: str
    imports: Callable[[Protocol], tuple[str, ...]]
    protocol: Callable[[Protocol], str]


def framing_of(protocol: Protocol) -> Framing:
    """Return what the framing of a protocol makes of its package."""
    kind: str = protocol.framing["kind"]
    return _FRAMINGS[kind]


def _framed_protocol(protocol: Protocol) -> str:
    framing = protocol.framing
    devices = [f"0x{d:02X}" for d in framing["devices"]]
    lines = [
        *_named(protocol),
        f"host=0x{framing['host']:02X}",
        _frozenset("devices", devices),
        _nameless(protocol),
    ]
    if "channel" in framing:
        lines.append(f"channel={literal(framing['channel'])}")
    faults = _faults(protocol)
    if faults:
        lines.append(bracketed("faults={", faults, "}", 4, WIDTH - 1))
    return call("PROTOCOL = FramedProtocol", lines, "", 0, 0)


def _faults(protocol: Protocol) -> list[str]:
    """Return the messages that report a fault, each with the places of what they say."""
    places = {m.id: m.exchange.get("reports_fault", {}) for m in protocol.messages}
    return [
        f"0x{id:04X}: FaultPlaces({', '.join(f'{k}={v}' for k, v in at.items() if k != 'source')})"
        for id, at in places.items()
        if id is not None and at
    ]


def _framed_imports(protocol: Protocol) -> tuple[str, ...]:
    faults = ["FaultPlaces"] if _faults(protocol) else []
    return (imported(SUPPORT, [*faults, "FramedMessage", "FramedProtocol", "require as _require"]),)


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


def _packet_protocol(protocol: Protocol) -> str:
    lines = [*_named(protocol), shape(protocol.framing), _nameless(protocol)]
    return call("PROTOCOL = PacketProtocol", lines, "", 0, 0)


def _named(protocol: Protocol) -> list[str]:
    names = (protocol.name, protocol.title, protocol.package)
    return [*(literal(name) for name in names), "MESSAGES"]


def _nameless(protocol: Protocol) -> str:
    why = literal("the document gives it no id")
    reasons = [f"{literal(m.name)}: {why}" for m in protocol.messages if m.id is None]
    return bracketed("nameless={", reasons, "}", 4, WIDTH - 1)


def _packet_imports(protocol: Protocol) -> tuple[str, ...]:
    names = ["PacketMessage", "PacketProtocol", "Shape", *check_class(protocol.framing)]
    return (imported(SUPPORT, [*names, "require as _require"]),)


def _frozenset(name: str, items: list[str]) -> str:
    line = f"{name}=frozenset({{{', '.join(items)}}})"
    if 4 + width(line) + 1 <= WIDTH:
        return line
    return call(f"{name}=frozenset", [bracketed("{", items, "}", 8, 0)], "", 4, 0)


_FRAMINGS = {
    "header": Framing(
        class_views=message_views,
        message_base="FramedMessage",
        imports=_framed_imports,
        protocol=_framed_protocol,
    ),
    "slots": Framing(
        class_views=command_views,
        message_base="Message",
        imports=lambda _: (
            imported(SUPPORT, ["CommandProtocol", "Message", "require as _require"]),
        ),
        protocol=_command_protocol,
    ),
    "packet": Framing(
        class_views=packet_views,
        message_base="PacketMessage",
        imports=_packet_imports,
        protocol=_packet_protocol,
    ),
}
