"""Whether messages and commands fit the framing of their protocol."""

from __future__ import annotations

from collections.abc import Callable

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.lint.packets import check_packets
from stagewire_generator.model import Message, Protocol
from stagewire_generator.strict_yaml import Document

_KINDS = {"header": ("message",), "slots": ("command", "setup"), "packet": ("message",)}
_SHOWN = {"message": "a message", "command": "a command", "setup": "a setup command"}


def check_framing(protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
    """Check the kind of every message, and what commands and packets ask of their framing.

    :param head: the file of the protocol, for the places of what is wrong in it.
    """
    framing = protocol.framing
    kinds = _KINDS[framing["kind"]]
    for message in protocol.messages:
        if message.kind not in kinds:
            what = f"{message.name} is {_SHOWN[message.kind]}, and the framing has kind {framing['kind']}"
            diagnostics.add(message.place, "SW038", what)
    if check := _RULES.get(framing["kind"]):
        check(protocol, head, diagnostics)


def _header(protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
    """Check the addresses: they leave the bit free that announces a packet, and tell host from device."""
    framing = protocol.framing
    host, flag = framing["host"], framing["data_flag"]
    channel = framing.get("channel")
    fields = {field.name for m in protocol.messages for x in m.layouts for field in x.all_fields}
    if channel is not None and channel not in fields:
        what = f"no message has a field {channel}, which is to name the channel"
        diagnostics.add(head.place("framing", "channel"), "SW021", what)
    free = "an address leaves the bit free that announces a packet; see the document"
    if host & flag:
        what = f"the host's address {host:#04x} holds the data flag"
        diagnostics.add(head.place("framing", "host"), "SW038", what, free)
    for index, device in enumerate(framing["devices"]):
        place = head.place("framing", "devices", index)
        if device & flag:
            diagnostics.add(place, "SW038", f"the address {device:#04x} holds the data flag", free)
        if device == host:
            what = f"{device:#04x} is the address of the host and of a device"
            diagnostics.add(place, "SW038", what, "one of the two is wrong; see the document")


def _slots(protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
    """Check the bytes that mark commands, and the byte and the size of every command."""
    framing = protocol.framing
    place = head.place("framing")
    if framing["prefix"] == framing["terminator"]:
        what = f"{framing['prefix']:#04x} is the prefix and the terminator"
        diagnostics.add(place, "SW038", what, "one of the two is wrong; see the document")
    _axes(protocol, place, diagnostics)
    for message in protocol.messages:
        if message.id == framing["terminator"]:
            what = f"{message.name}: its byte {message.id:#04x} is the terminator"
            hint = "one of the two is wrong; see the document"
            diagnostics.add(message.place, "SW038", what, hint)
        if message.kind == "command":
            _size(protocol, message, diagnostics)


def _axes(protocol: Protocol, place: Place, diagnostics: Diagnostics) -> None:
    """Check the axes: the first byte of a command is told from a prefix and a terminator."""
    framing = protocol.framing
    name = framing["axes"]
    axes = next((e for e in protocol.enumerations if e.name == name), None)
    if axes is None:
        diagnostics.add(place, "SW021", f"no enumeration is named {name}")
        return
    for axis in axes.values:
        if not 0 <= axis.value <= 0xFF or axis.value in (framing["prefix"], framing["terminator"]):
            what = f"{name}.{axis.name}: {axis.value:#x} cannot begin a command"
            diagnostics.add(axes.place, "SW038", what, "one of the two is wrong; see the document")


def _size(protocol: Protocol, message: Message, diagnostics: Diagnostics) -> None:
    """Check that the size is told from the terminator; the resolver holds it against the data."""
    if (message.size or 0) == protocol.framing["terminator"]:  # 0 is what the other form has
        what = f"{message.name}: the size {message.size or 0} is the terminator"
        diagnostics.add(message.place, "SW038", what, "it would be read as a slot that is left out")


# Kinds of framing that have rules of their own
_RULES: dict[str, Callable[[Protocol, Document, Diagnostics], None]] = {
    "header": _header,
    "slots": _slots,
    "packet": check_packets,
}
