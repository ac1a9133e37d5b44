"""The root cause of bytes that are not the expected message: which message has the defect."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from stagewire.protocols import HEADER_SIZE
from stagewire_conformance.device.causes import (
    CHANNEL,
    DELIVERY,
    UNSOLICITED,
    Cause,
    addresses,
)
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.lines.dialogue import Incoming

_BYTES = "bytes"
_STRAY = "stray bytes"


def subject_of(declared: Declaration, heard: Incoming) -> str:
    """Return the name of the message that received bytes belong to; empty if that is unknown.

    Bytes that begin like a message are a damaged one. Other bytes belong to the message that they follow.
    """
    if heard.name:
        return heard.name
    id = int.from_bytes(heard.raw[:2], "little")
    for name, entry in declared.registry.messages.items():
        if entry["id"] == id and len(heard.raw) > 2 and entry["direction"] != "to_controller":
            return name
    return heard.after


def wrong_length(declared: Declaration, heard: Incoming) -> Cause | None:
    """Return the cause that all packets with the fields of this one have its length; None if it is right.

    Messages with the same fields are made by the same code. So they have one defect.
    """
    if heard.kind != "bad_length":
        return None
    entry = declared.registry.messages.get(subject_of(declared, heard), {"layouts": ()})
    fields = {field["name"]: None for layout in entry["layouts"] for field in layout["fields"]}
    length = len(heard.raw) - HEADER_SIZE
    return Cause(f"packets of {', '.join(fields)}", f"{length} bytes") if fields else None


def bytes_of(raw: bytes) -> Cause:
    """Return the cause that these bytes arrive, which are not a message."""
    return Cause(_BYTES, raw.hex(" "))


def known_bytes(causes: Iterable[Cause], raw: bytes) -> Iterator[Cause]:
    """Yield the reported cause of the same bytes, or of bytes that begin with the same header."""
    came = raw.hex(" ")
    for cause in causes:
        header = cause.subject == _BYTES and len(raw) >= HEADER_SIZE
        if cause == bytes_of(raw) or (header and cause.aspect.startswith(came)):
            yield cause


def cause_of_stray(declared: Declaration, heard: Incoming) -> Cause:
    """Return the cause that bytes arrived which nothing requested."""
    if heard.kind in ("message", "undocumented"):
        return Cause(heard.name, UNSOLICITED)
    return Cause(subject_of(declared, heard) or _STRAY, DELIVERY)


def cause_of_silence(
    declared: Declaration, heard: Iterable[Incoming], names: Sequence[str], dest: int
) -> Cause:
    """Return the likely cause that a request was not answered.

    :param heard: what arrived instead.
    :param names: the messages that answer it.
    :param dest: the address of the target.
    """
    place = declared.place_at(dest)
    for each in heard:
        if each.name in names and each.source != dest:
            return addresses(place.name if place else f"{dest:#04x}", each.dest, each.source)
        if each.name in names and each.channel is not None:
            return Cause(each.name, CHANNEL)
    return Cause(names[0], DELIVERY)
