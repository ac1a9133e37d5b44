"""The shape of packets: which bytes stand where, as the expressions and statements of ``wire.h``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.c.names import names_of
from stagewire_generator.targets.c.packet_check import CheckView, check_view
from stagewire_generator.targets.c.packet_parts import PacketParts
from stagewire_generator.targets.c.source import call

__all__ = ["AddressView", "PacketShapeView", "packet_shape_view"]

_TYPES = {1: "uint8_t", 2: "uint16_t", 3: "uint32_t", 4: "uint32_t"}


@dataclass(frozen=True, slots=True)
class AddressView:
    """The address.

    :param type: the least type that holds it.
    :param read: the expression that takes it from a packet.
    :param put: the statement that writes it into one whose payload has ``payload`` bytes.
    :param is_behind: whether it follows the payload.
    """

    type: str
    highest: str
    read: str
    put: str
    is_behind: bool


@dataclass(frozen=True, slots=True)
class PacketShapeView:
    """How packets look.

    :param doc: what they consist of, a line of a comment each.
    :param start: the bytes that begin each.
    :param known: bytes from which on the length is known.
    :param overhead: bytes of a packet without payload.
    :param payload_at: where the payload begins.
    :param payload: the expression of its length, from the one that a packet says; beyond the maximum for
        what none can say.
    :param put_length: the statement that says the length of a payload.
    :param begin: the beginning of the function that writes what stands before a payload, up to the body.
    :param before: the statements that write it.
    :param behind: those that write what stands behind it; the check is the last, since it covers the rest.
    :param damaged: conditions that are true of a packet that is as long as it says, and damaged.
    """

    doc: tuple[str, ...]
    start: tuple[str, ...]
    known: int
    overhead: int
    payload_at: int
    payload: str
    id: str
    put_length: str
    begin: str
    before: tuple[str, ...]
    behind: tuple[str, ...]
    damaged: tuple[str, ...]
    address: AddressView | None
    check: CheckView | None


def packet_shape_view(protocol: Protocol) -> PacketShapeView:
    """Make the view of the shape of the packets of a protocol."""
    shape = PacketParts(protocol.framing)
    names = names_of(protocol)
    address = _address(names.prefix, shape, protocol.framing)
    parameters = ["uint32_t head", "uint8_t *out"]
    if address:
        parameters.append(f"{address.type} address")
    length = _read(names.prefix, shape.size("length"), "packet", shape.offset("length"))
    head = f"static inline uint8_t *{names.prefix}_begin_packet"
    return PacketShapeView(
        doc=tuple(_described(shape, protocol.framing)),
        start=tuple(_byte(byte) for byte in protocol.framing["start"]),
        known=shape.offset("length") + shape.size("length"),
        overhead=shape.overhead,
        payload_at=shape.payload_at,
        payload=f"{length} - UINT32_C({shape.counted})" if shape.counted else length,
        id=_read(names.prefix, shape.size("id"), "packet", shape.offset("id")),
        put_length=_put(
            names.prefix,
            shape.size("length"),
            f"out[{shape.offset('length')}]",
            f"payload + {shape.counted}U" if shape.counted else "payload",
        ),
        begin=call(head, parameters),
        before=tuple(_before(names.prefix, shape, protocol.framing, address)),
        behind=tuple(_behind(names.prefix, shape, protocol.framing)),
        damaged=tuple(_damaged(names.prefix, shape, protocol.framing)),
        address=address,
        check=check_view(shape, protocol.framing),
    )


def _address(prefix: str, shape: PacketParts, framing: Json) -> AddressView | None:
    if "address" not in framing:
        return None
    size = shape.size("address")
    is_behind = shape.is_behind("address")
    index = shape.offset("address")
    read = _read(prefix, size, "packet", index)
    place = f"packet[{index}]"
    if is_behind:
        read = _read(prefix, size, "packet", index, f" + {prefix}_payload_of(packet)")
        place = f"packet[{index}U + payload]"
    return AddressView(
        type=_TYPES[size],
        highest=f"0x{(1 << 8 * size) - 1:X}U"
        if size <= 2
        else f"UINT32_C(0x{(1 << 8 * size) - 1:X})",
        read=read,
        put=_put(prefix, size, place, "address", fits=size == 1),
        is_behind=is_behind,
    )


def _described(shape: PacketParts, framing: Json) -> Iterator[str]:
    """Yield a line for each part: how long it is, and what it holds."""
    for part in shape.order:
        if part == "payload":
            yield f"payload: at most {framing['maximum_length']} bytes"
            continue
        size = shape.size(part)
        text = f"{part}: {size} byte{'s' * (size > 1)}"
        if part in ("start", "end"):
            text += f", {' '.join(f'{byte:02X}' for byte in framing[part])}"
        elif part == "length":
            text += f", the number of those in {', '.join(framing['length']['counts'])}"
        elif part == "check":
            text += f", of {', '.join(framing['check']['covers'])}"
        yield text


def _before(
    prefix: str, shape: PacketParts, framing: Json, address: AddressView | None
) -> Iterator[str]:
    """Yield the statements that write the parts before the payload, and the address wherever it is."""
    for part in shape.order:
        at = shape.offset(part)
        if part == "start":
            yield from (f"out[{n}] = {_byte(byte)};" for n, byte in enumerate(framing["start"]))
        elif part == "length":
            yield f"{prefix}_put_length(head >> 16, out);"
        elif part == "id":
            size = shape.size(part)
            # what is above the id is no part of it
            number = "head" if size < 3 else "head & 0xFFFFU"
            yield _put(prefix, size, f"out[{at}]", number)
        elif part == "address" and address:
            place = f"out[{at}U + (head >> 16)]" if address.is_behind else f"out[{at}]"
            yield _put(prefix, shape.size(part), place, "address", fits=shape.size(part) == 1)


def _behind(prefix: str, shape: PacketParts, framing: Json) -> Iterator[str]:
    for at, byte in enumerate(framing.get("end", ()), shape.tail("end")):
        yield f"tail[{at}] = {_byte(byte)};"
    if "check" in framing:
        size, place = shape.size("check"), f"tail[{shape.tail('check')}]"
        yield _put(prefix, size, place, f"{prefix}_check_of(packet, payload)")


def _damaged(prefix: str, shape: PacketParts, framing: Json) -> Iterator[str]:
    for at, byte in enumerate(framing.get("end", ()), shape.tail("end")):
        yield f"tail[{at}] != {_byte(byte)}"
    if "check" in framing:
        came = _read(prefix, shape.size("check"), "tail", shape.tail("check"))
        yield f"{came} != {prefix}_check_of(packet, (size_t)payload)"


def _byte(byte: int) -> str:
    return f"0x{byte:02X}U"


def _read(prefix: str, size: int, source: str, at: int, further: str = "") -> str:
    """Return the expression that reads a number of so many bytes."""
    place = f"{source}[{at}U{further}]" if further else f"{source}[{at}]"
    return place if size == 1 else f"{prefix}_get_{8 * size}({_pointer(place)})"


def _pointer(place: str) -> str:
    return place.removesuffix("[0]") if place.endswith("[0]") else f"&{place}"


def _put(prefix: str, size: int, place: str, value: str, fits: bool = False) -> str:
    """Return the statement that writes a number of so many bytes; of what does not fit, the lower ones."""
    if size > 1:
        return f"(void){prefix}_put_{8 * size}({_pointer(place)}, {value});"
    if fits:
        return f"{place} = {value};"
    value = f"({value})" if " " in value and not value.endswith(")") else value
    return f"{place} = (uint8_t)({value} & 0xFFU);"
