"""What the testee has to know of a protocol beside its layouts."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Protocol
from stagewire_generator.targets.c.source import string

__all__ = ["TesteeView", "testee_view"]


@dataclass(frozen=True, slots=True)
class TesteeView:
    """The testee of a protocol; names are literals.

    :param name: of the protocol.
    :param nameless: messages that the document names without an id.
    :param axis: that of some command; empty where messages go to no axis.
    """

    name: str
    nameless: tuple[str, ...]
    axis: str


def testee_view(protocol: Protocol) -> TesteeView:
    """Make the view of the testee of a protocol."""
    axes = protocol.framing.get("axes")
    values = [value.value for e in protocol.enumerations if e.name == axes for value in e.values]
    return TesteeView(
        name=string(protocol.name),
        nameless=tuple(string(m.name) for m in protocol.messages if m.id is None),
        axis=f"0x{values[0]:02X}" if values else "",
    )
