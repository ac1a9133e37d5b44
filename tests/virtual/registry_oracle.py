"""The answers that units must give, derived from the registry's JSON independently of virtual controllers.

Frames are packed and unpacked by the fields in the JSON, without generated classes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from issues import OF_ISSUE_3
from stagewire.protocols import load_protocol

Json = Mapping[str, Any]
HOST = 0x01
APT: Json = load_protocol("thorlabs_apt").registry()
MESSAGES: dict[str, Json] = {message["name"]: message for message in APT["messages"]}
UNITS: dict[str, Json] = {unit["name"]: unit for unit in APT["units"] if unit["name"] in OF_ISSUE_3}
"""The units of Issue 3, which this oracle follows in every detail."""
BY_ID = {message["id"]: message for message in APT["messages"]}
CHANNEL = "chan_ident"
CHOICES = ("lowest", "highest", "between")


@dataclass(frozen=True)
class Place:
    """An address of a unit, with its kind and its channels."""

    address: int
    kind: str  # alone, motherboard, bay
    channels: tuple[int, ...]

    def __str__(self) -> str:
        return f"{self.kind} {self.address:#04x}"


def places(unit: Json) -> Iterator[Place]:
    """Yield the addresses of a unit; a module is in bay 0 of a rack without other modules."""
    fixed = APT["addresses"]
    channels = tuple(range(1, unit["channels"] + 1))
    if unit["address"] == "generic_usb":
        also = APT["families"][unit["family"]].get("also_at", {}).get("addresses", [])
        for address in (fixed["generic_usb"]["value"], *also):
            yield Place(address, "alone", channels)
        return
    yield Place(fixed["motherboard"]["value"], "motherboard", ())
    for bay in range(unit.get("bays", 1)):
        yield Place(fixed["bays"]["first"] + bay, "bay", channels)


def takes(unit: Json, place: Place, message: Json) -> bool:
    """Return whether a unit accepts a message at one of its addresses.

    A motherboard reports its hardware information and the used bays. It has inputs and outputs, as the bays
    do (the examples of pages 25 and 26 have both). Everything else goes to the bays. The motherboard of a
    module is that of its rack, which has all messages of racks (pages 23 to 26).
    """
    name = message["name"]
    if message["direction"] == "to_host":
        return False
    if place.kind == "motherboard":
        of_racks = name.startswith("RACK_") or name == "HW_REQ_INFO"
        return of_racks and (unit["address"] == "bay" or name in unit["messages"])
    return name in unit["messages"] and (place.kind == "alone" or name != "RACK_REQ_BAYUSED")


def answers(unit: Json, message: Json) -> list[str]:
    """Return the messages that answer a message, and those of its announcements that the unit has."""
    exchange = message["exchange"]
    announced = [name for name in exchange.get("announces", ()) if name in unit["messages"]]
    return [*exchange.get("answered_by", ()), *announced]


def forms(message: Json) -> Iterator[Json]:
    """Yield the layouts of a message that do not depend on the status block."""
    yield from (layout for layout in message["layouts"] if not layout["when"])


def fields(layout: Json) -> Iterator[Json]:
    """Yield the header parameters and payload fields that have a value."""
    for field in (layout["param1"], layout["param2"], *layout["fields"]):
        if field is not None and field["role"] != "reserved":
            yield field


def values(layout: Json, choice: str, channel: int, unit: str = "") -> dict[str, int | bytes]:
    """Return one value for each field, valid for a unit: ``lowest``, ``highest`` or in ``between``."""
    found = {field["name"]: _value(field, choice, unit) for field in fields(layout)}
    return {**found, CHANNEL: channel} if CHANNEL in found else found


def limits(field: Json, unit: str) -> tuple[int | None, int | None]:
    """Return the range of a field on a unit."""
    ranges = field.get("ranges_by_unit", {})
    found = ranges.get(unit, ranges.get("others", field))
    return found["minimum"], found["maximum"]


def _value(field: Json, choice: str, unit: str) -> int | bytes:
    if field["kind"] != "integer":
        return {"lowest": b"", "highest": b"Z" * field["size"], "between": b"AB 12"}[choice]
    if field.get("enum"):
        listed = sorted(field["enum"].values())
        return int(listed[{"lowest": 0, "highest": -1, "between": len(listed) // 2}[choice]])
    bits = 8 * field["size"]
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if field["signed"] else (0, (1 << bits) - 1)
    minimum, maximum = limits(field, unit)
    low = low if minimum is None else max(low, minimum)
    high = high if maximum is None else min(high, maximum)
    return {"lowest": low, "highest": high, "between": low + (high - low) // 3}[choice]


def pack(message: Json, layout: Json, given: Mapping[str, int | bytes], address: int) -> bytes:
    """Return the bytes of a message from the host."""
    id = message["id"].to_bytes(2, "little")
    length = layout["length"]
    if not length:
        header = [layout["param1"], layout["param2"]]
        return (
            id
            + bytes(int(given.get(p["name"], 0)) if p else 0 for p in header)
            + bytes((address, HOST))
        )
    payload = bytearray(length)
    for field in fields(layout):
        value = given[field["name"]]
        start, size = field["offset"], field["size"]
        if isinstance(value, bytes):
            payload[start : start + size] = value.ljust(size, b"\0")
        else:
            payload[start : start + size] = value.to_bytes(size, "little", signed=field["signed"])
    return id + length.to_bytes(2, "little") + bytes((address | 0x80, HOST)) + payload


@dataclass(frozen=True)
class Reply:
    """A frame from the controller, unpacked according to the registry."""

    name: str
    dest: int
    source: int
    values: Mapping[str, int | bytes]
    form: str


def cut(data: bytes, status: str = "") -> list[Reply]:
    """Return the frames in the bytes of a controller; raise for a frame that is not in the registry."""
    found = []
    while data:
        message = BY_ID[int.from_bytes(data[:2], "little")]
        long = data[4] & 0x80
        size = 6 + (int.from_bytes(data[2:4], "little") if long else 0)
        frame, data = data[:size], data[size:]
        assert len(frame) == size, f"{message['name']}: {frame.hex(' ')} is incomplete"
        layout = next(
            layout
            for layout in message["layouts"]
            if layout["length"] == size - 6
            and (layout["when"] or {}).get("status") in (None, status)
        )
        found.append(
            Reply(
                message["name"],
                frame[4] & 0x7F,
                frame[5],
                {field["name"]: _read(field, frame, bool(long)) for field in fields(layout)},
                layout["form"],
            )
        )
    return found


def _read(field: Json, frame: bytes, long: bool) -> int | bytes:
    start = field["offset"] + (6 if long else 0)
    raw = frame[start : start + field["size"]]
    if field["kind"] != "integer":
        return raw.rstrip(b"\0")
    return int.from_bytes(raw, "little", signed=field["signed"])
