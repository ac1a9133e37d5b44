"""First contact with a controller with framed messages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

from stagewire.protocols import FramedMessage, Message
from stagewire_conformance.device.errors import NothingAnswersError

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target

_WAIT: Final = 1.0
"""Seconds to wait for each of the two requests."""


class Contact(Protocol):
    """A line to a controller."""

    declared: Declaration

    @property
    def url(self) -> str:
        """The URL of the line."""
        ...

    def send(self, message: FramedMessage, dest: int) -> None:
        """Send a message."""
        ...

    def ask(self, request: FramedMessage, dest: int, wait: float = 1.0) -> Incoming | None:
        """Send a request and return its reply, or None."""
        ...

    def drain(self) -> list[Incoming]:
        """Return everything received until the line is quiet."""
        ...


def first_contact(line: Contact) -> dict[str, int | str]:
    """Request the identity up to twice. Before the second time, send a request of another kind to each place.

    Returns the fields of the answer; empty if the controller answers other requests but does not identify
    itself. Raises :class:`.NothingAnswersError` if nothing of the protocol arrives.
    """
    request = _request(line)
    at = line.declared.places[0].address
    for first in (True, False):
        if not first:
            _ask_anything(line, request)
        reply = line.ask(request, at, wait=_WAIT)
        if reply is not None:
            return _fields(reply.message)
    came = line.drain()
    if any(heard.message is not None for heard in came):
        return {}
    raise NothingAnswersError(_nothing(line, sum(len(heard.raw) for heard in came)))


def identity_at(line: Contact, place: Target) -> dict[str, int | str]:
    """Return the identity that a module of a rack reports; empty without an answer."""
    reply = line.ask(_request(line), place.address, wait=_WAIT)
    return {} if reply is None else _fields(reply.message)


def _request(line: Contact) -> FramedMessage:
    identity = line.declared.facts.identity
    request = None if identity is None else identity.req
    assert request is not None
    assert issubclass(request, FramedMessage)
    return request()


def _fields(message: Message) -> dict[str, int | str]:
    """Return the fields of a message without reserved ones; bytes in hex."""
    return {
        name: value.hex(" ") if isinstance(value, bytes) else value
        for name, value in message.values().items()
        if name not in message.layout.optional
    }


def _ask_anything(line: Contact, identity: FramedMessage) -> None:
    """Send a harmless request to each place, in case the controller answers anything but its identity.

    :param identity: the request for the identity. A bay may answer it without a motherboard.
    """
    declared = line.declared
    for place in declared.places:
        if place.bay is not None:
            line.send(identity, place.address)
        for name in sorted(place.messages - {identity.layout.message}):
            entry = declared.registry.messages[name]
            if entry["effect"] == "none" and entry["exchange"].get("answered_by"):
                channel = place.channels[0] if place.channels else None
                line.send(declared.request(name, channel), place.address)
                break


def _nothing(line: Contact, garbage: int) -> str:
    name = line.declared.unit.name
    if garbage:
        return (
            f"no {name} answers at {line.url}: {garbage} bytes arrived that are not a message. Check "
            "the baud rate and the kind of controller"
        )
    places = ", ".join(place.name for place in line.declared.places)
    return (
        f"no answer at {line.url} (tried twice at {places}). Check that the {name} is switched on, that "
        "this is its port, and that no other program uses the port"
    )
