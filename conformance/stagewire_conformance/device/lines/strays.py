"""The root cause of bytes that are not the expected message: which message has the defect."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from stagewire.protocols import DATA_FLAG, HEADER_SIZE
from stagewire_conformance.device.causes import (
    ADDRESSES,
    CHANNEL,
    DELIVERY,
    UNSOLICITED,
    Cause,
)
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.lines.dialogue import Incoming
from stagewire_conformance.registry import Json

_BYTES = "bytes"
_STRAY = "stray bytes"


def subject_of(declared: Declaration, heard: Incoming) -> str:
    """Return the name of the message that received bytes belong to; empty if that is unknown.

    Bytes that begin like a message are a damaged one. Other bytes belong to the message that they follow.
    """
    if heard.name:
        return heard.name
    if len(heard.raw) > 2 and (entry := entry_of(declared, heard.raw)) is not None:
        return str(entry["name"])
    return heard.after


def entry_of(declared: Declaration, raw: bytes) -> Json | None:
    """Return the entry of the message from a controller that bytes begin like; None if there is none.

    Messages that share an id differ in their sub-message. Without one in the bytes, it is the first of them.
    """
    id = int.from_bytes(raw[:2], "little")
    alike = [
        entry
        for entry in declared.registry.messages.values()
        if entry["id"] == id and entry["direction"] != "to_controller"
    ]
    begun = [entry for entry in alike if _begins_with(entry, raw)]
    return next(iter((*begun, *alike)), None)


def _begins_with(entry: Json, raw: bytes) -> bool:
    """Return whether bytes have the sub-message of a message, if it has one."""
    if "sub_message" not in entry:
        return True
    number: int = entry["sub_message"]
    return raw[HEADER_SIZE : HEADER_SIZE + 2] == number.to_bytes(2, "little")


def wrong_length(declared: Declaration, heard: Incoming) -> Cause | None:
    """Return the cause that all packets with the fields of this one have its length; None if it is right.

    Messages with the same fields are made by the same code. So they have one defect. The same is true if the
    flag of the packet is missing.
    """
    raw = heard.raw
    if heard.kind == "garbage" and len(raw) > HEADER_SIZE and not raw[4] & DATA_FLAG:
        return Cause("packets", "without a flag") if subject_of(declared, heard) else None
    if heard.kind != "bad_length":
        return None
    entry = entry_of(declared, heard.raw) or {"layouts": ()}
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


def addresses(declared: Declaration, place: int, dest: int | None, source: int | None) -> Cause:
    """Return the cause that messages have other addresses than those of a target and of the host.

    It is the same for all bays that use the same ones, or those of another bay.

    :param place: the address of the target.
    """
    roles = {declared.framed.host: "the host", place: "the target", None: "unknown"}

    def role(address: int | None) -> str:
        other = None if address is None else declared.place_at(address)
        is_bay = other is not None and other.bay is not None
        return roles.get(address) or ("another bay" if is_bay else f"{address:#04x}")

    return Cause(ADDRESSES, f"from {role(source)} to {role(dest)}")


def wrong_addresses(
    declared: Declaration, heard: Incoming, names: Sequence[str], place: int
) -> Cause | None:
    """Return the cause that bytes are not a message because of their addresses; None if they are right.

    :param names: the messages that may have arrived.
    :param place: the address of the target that sent them.
    """
    raw, protocol = heard.raw, declared.framed
    if heard.kind == "message" or len(raw) < HEADER_SIZE:
        return None
    ids = [declared.registry.messages[name]["id"] for name in names]
    if int.from_bytes(raw[:2], "little") not in ids:
        return None
    dest, source = raw[4] & ~DATA_FLAG, raw[5]
    if dest == protocol.host and source in protocol.devices:
        return None
    return addresses(declared, place, dest, source)


def cause_of_silence(
    declared: Declaration, heard: Iterable[Incoming], names: Sequence[str], dest: int
) -> Cause:
    """Return the likely cause that a request was not answered.

    :param heard: what arrived instead.
    :param names: the messages that answer it.
    :param dest: the address of the target.
    """
    for each in heard:
        if each.name in names and each.source != dest:
            return addresses(declared, dest, each.dest, each.source)
        if (wrong := wrong_addresses(declared, each, names, dest)) is not None:
            return wrong
        if each.name in names and each.channel is not None:
            return Cause(each.name, CHANNEL)
    return Cause(names[0], DELIVERY)
