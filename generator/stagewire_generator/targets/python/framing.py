"""Parts of a Python package that depend on the framing: its classes and the protocol object."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from stagewire_generator.framing import part
from stagewire_generator.model import Message, Protocol
from stagewire_generator.targets.python.brackets import Nested, Source, mapping
from stagewire_generator.targets.python.class_view import ClassView
from stagewire_generator.targets.python.source import literal


class Framing(NamedTuple):
    """Parts of packages that depend on the framing.

    :param class_views: makes the views of the classes of a message.
    :param message_base: the common base of these classes.
    :param imports: returns the names that the module of the protocol object imports from the runtime.
    :param protocol: makes the call that creates the protocol object.
    """

    class_views: Callable[[Protocol, Message], list[ClassView]]
    message_base: str
    imports: Callable[[Protocol], tuple[str, ...]]
    protocol: Callable[[Protocol], Nested]


def framing_of(protocol: Protocol) -> Framing:
    """Return the :class:`Framing` of a protocol."""
    framing: Framing = part(protocol.framing["kind"], "python")
    return framing


def named(protocol: Protocol) -> list[Source]:
    """Return the first arguments of a protocol object: name, title, package, messages."""
    names = (protocol.name, protocol.title, protocol.package)
    return [*(literal(name) for name in names), "MESSAGES"]


def nameless(protocol: Protocol) -> Nested:
    """Return the argument with the reasons why messages have no id."""
    why = literal("the document gives it no id")
    reasons = [f"{literal(m.name)}: {why}" for m in protocol.messages if m.id is None]
    return mapping("nameless=", reasons)
