"""First contact: whether there is a controller at all, and what it says that it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire.protocols import FramedMessage, Message
from stagewire_conformance.device.errors import NothingAnswersError

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.apt_line import AptLine
    from stagewire_conformance.device.places import Place

__all__ = ["first_contact", "identity_at"]

_WAIT: Final = 1.0
"""Seconds for each of the two questions."""


def first_contact(line: AptLine) -> dict[str, int | str]:
    """Ask a controller twice what it is, the second time with a question to each place beside it.

    Returns the fields of its answer; none where it says other things of the protocol, but not what it is.
    Raises :class:`.NothingAnswersError` where nothing comes that is of the protocol.
    """
    request = _request(line)
    at = line.declared.places[0].address
    for first in (True, False):
        if not first:
            _ask_anything(line, request.layout.message)
        reply = line.ask(request, at, wait=_WAIT)
        if reply is not None:
            return _fields(reply.message)
    came = line.drain()
    if any(heard.message is not None for heard in came):
        return {}
    raise NothingAnswersError(_nothing(line, sum(len(heard.raw) for heard in came)))


def identity_at(line: AptLine, place: Place) -> dict[str, int | str]:
    """Return what a module of a rack says that it is; nothing where it does not answer."""
    reply = line.ask(_request(line), place.address, wait=_WAIT)
    return {} if reply is None else _fields(reply.message)


def _request(line: AptLine) -> FramedMessage:
    identity = line.declared.facts.identity
    request = None if identity is None else identity.req
    assert request is not None
    assert issubclass(request, FramedMessage)
    return request()


def _fields(message: Message) -> dict[str, int | str]:
    """Return what a message says, without what is reserved; bytes in hex."""
    return {
        name: value.hex(" ") if isinstance(value, bytes) else value
        for name, value in message.values().items()
        if name not in message.layout.optional
    }


def _ask_anything(line: AptLine, but: str) -> None:
    """Ask each place one thing, should it be that a controller answers everything but what it is."""
    declared = line.declared
    for place in declared.places:
        for name in sorted(place.messages - {but}):
            entry = declared.registry.messages[name]
            if entry["effect"] == "none" and entry["exchange"].get("answered_by"):
                channel = place.channels[0] if place.channels else None
                line.send(declared.request(name, channel), place.address)
                break


def _nothing(line: AptLine, garbage: int) -> str:
    name = line.declared.unit.name
    if garbage:
        return (
            f"no {name} answers at {line.url}: {garbage} bytes came that are no message (another baud rate, "
            "or another kind of controller?)"
        )
    places = ", ".join(place.name for place in line.declared.places)
    return (
        f"nothing answers at {line.url} (asked twice at {places}). Is the {name} switched on, is this its "
        "port, and does no other program use it?"
    )
