"""Rules for specs with commands in slots."""

from __future__ import annotations

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.framing import Rules
from stagewire_generator.model import Message, Protocol
from stagewire_generator.strict_yaml import Document


def check_slots(protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
    """Check prefix, terminator and axes, and the byte and the size of every command."""
    framing = protocol.framing
    place = head.place("framing")
    if framing["prefix"] == framing["terminator"]:
        what = f"{framing['prefix']:#04x} is both the prefix and the terminator"
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
    """Check that axes differ from the prefix and the terminator."""
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
    """Check that the size differs from the terminator; the resolver compares it with the data."""
    if (message.size or 0) == protocol.framing["terminator"]:  # the other form has size 0
        what = f"{message.name}: the size {message.size or 0} is the terminator"
        diagnostics.add(
            message.place,
            "SW038",
            what,
            "correct the size: a receiver would read it as an omitted slot",
        )


RULES = Rules(
    check=check_slots,
    kinds=("command", "setup"),
    keys=("maximum_length", "prefix", "terminator"),
    enumerations=("axes",),
    id_size=1,
    polls=True,
    encode=(("axes", "--axis"),),
    decode="--direction command",
)
