"""What the tests in C have to know of a framing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.c.packet_parts import PacketParts
from stagewire_generator.targets.vectors.subject import Subject

__all__ = ["Framing", "framing_of"]


@dataclass(frozen=True, slots=True)
class Framing:
    """What differs between protocols by their framing.

    :param calls: the template with what stands between a layout and its functions.
    :param cut: the template with what cuts a stream into events.
    :param trip: the template of the round trip of one layout.
    :param trip_needs: the template of what these have in common.
    :param data_at: where in the bytes of a layout its data begins.
    :param form: the form of the layout that an object of the testee protocol is about.
    :param envelope: members of the envelope beside addresses and extra bytes.
    :param meant: the layouts, side by side, that bytes could be meant for; all where nothing is.
    :param damaged: the refusal of what was damaged on the way, where a decoder can tell.
    """

    calls: str
    cut: str
    trip: str
    trip_needs: str
    data_at: Callable[[Protocol, Subject], int]
    form: Callable[[Json], str]
    envelope: Callable[[Subject, Json], list[str]]
    meant: Callable[[Protocol, tuple[Subject, ...], bytes, Json], Sequence[Subject]]
    damaged: str = ""


def framing_of(protocol: Protocol) -> Framing:
    """Return what the framing of a protocol makes of its tests."""
    kind: str = protocol.framing["kind"]
    return _FRAMINGS[kind]


def _form(said: Json) -> str:
    return str(said.get("form", ""))


def _form_of_slots(said: Json) -> str:
    """Return the form without what it says of the size slot."""
    direction = said.get("direction", "command")
    return _form(said).partition(":")[0] or {"reply": "reply"}.get(direction, "request")


def _envelope_of_slots(of: Subject, said: Json) -> list[str]:
    """Return whether the size slot is there, where that is not as printed."""
    slots = {"with_size": "STAGEWIRE_SLOT_GIVEN", "without_size": "STAGEWIRE_SLOT_LEFT_OUT"}
    slot = slots.get(_form(said).partition(":")[2])
    return [f".size_slot = {slot}"] if slot else []


@lru_cache(maxsize=2)
def _by_id(protocol: Protocol, every: tuple[Subject, ...]) -> dict[int, list[Subject]]:
    """Return the layouts of all messages that have an id, by it."""
    found: dict[int, list[Subject]] = {m.id: [] for m in protocol.messages if m.id is not None}
    for of in every:
        found[of.message.id or 0].append(of)
    return found


def _meant_by_header(
    protocol: Protocol, every: tuple[Subject, ...], raw: bytes, said: Json
) -> Sequence[Subject]:
    """Return the layouts with the id of the bytes; none where it is that of a message without any."""
    found = _by_id(protocol, every).get(int.from_bytes(raw[:2], "little"))
    return every if len(raw) < 2 or found is None else found


def _meant_by_slots(
    protocol: Protocol, every: tuple[Subject, ...], raw: bytes, said: Json
) -> Sequence[Subject]:
    """Return the reply to the command that is told, or else the command with the byte."""
    if said.get("direction") == "reply":
        asked = said.get("command", "")
        return [of for of in every if of.message.name == asked and of.layout.form == "reply"]
    kind = "setup" if raw[:1] == bytes((protocol.framing["prefix"],)) else "command"
    key = kind, *raw[1:2]
    requests = [of for of in every if of.layout.form == "request"]
    return [of for of in requests if (of.message.kind, of.message.id) == key] or every


def _meant_by_packet(
    protocol: Protocol, every: tuple[Subject, ...], raw: bytes, said: Json
) -> Sequence[Subject]:
    """Return the layouts of the message with the id of the bytes."""
    at, size = PacketParts(protocol.framing).offset("id"), protocol.framing["id"]["size"]
    id = int.from_bytes(raw[at : at + size], "little")
    known = [of for of in every if of.message.id == id and len(raw) >= at + size]
    return known or every


_FRAMINGS = {
    "header": Framing(
        calls="header_calls.c.j2",
        cut="header_cut.c.j2",
        trip="header_trip.c.j2",
        trip_needs="header_trip_needs.c.j2",
        data_at=lambda protocol, of: 6,
        form=_form,
        envelope=lambda of, said: [],
        meant=_meant_by_header,
    ),
    "slots": Framing(
        calls="slots_calls.c.j2",
        cut="slots_cut.c.j2",
        trip="slots_trip.c.j2",
        trip_needs="slots_trip_needs.c.j2",
        data_at=lambda protocol, of: 0 if of.layout.form == "reply" else 3,
        form=_form_of_slots,
        envelope=_envelope_of_slots,
        meant=_meant_by_slots,
    ),
    "packet": Framing(
        calls="packet_calls.c.j2",
        cut="slots_cut.c.j2",
        trip="packet_trip.c.j2",
        trip_needs="packet_trip_needs.c.j2",
        data_at=lambda protocol, of: PacketParts(protocol.framing).payload_at,
        form=_form,
        envelope=lambda of, said: [],
        meant=_meant_by_packet,
        damaged="bad_value",
    ),
}
