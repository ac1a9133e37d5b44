"""The root cause of bytes that are not the expected message: which message has the defect."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from stagewire_conformance.device.causes import (
    CHANNEL,
    DELIVERY,
    UNSOLICITED,
    Cause,
    addresses,
)
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.lines.dialogue import Incoming

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
