"""The shape of packets: the places of their parts, as expressions and statements of ``wire.h``.

Offsets count from the first byte of a packet, or from the end of its payload. A check is computed bit by
bit, without a table.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.c.source import call, names_of, unsigned


class PacketParts:
    """The parts of the packets of one protocol.

    :param framing: the framing of the registry.
    """

    def __init__(self, framing: Json) -> None:
        self.order: tuple[str, ...] = tuple(framing["order"])
        self._sizes = {
            part: len(framing[part]) if part in ("start", "end") else framing[part]["size"]
            for part in self.order
            if part != "payload"
        }
        self.counted = sum(self.size(part) for part in framing["length"]["counts"])
        self.payload_at = self.offset("payload")

    @property
    def overhead(self) -> int:
        """Length of a packet without payload in bytes."""
        return sum(self._sizes.values())

    def size(self, part: str) -> int:
        """Return the length of a part in bytes; 0 for the payload, whose length varies."""
        return self._sizes.get(part, 0)

    def offset(self, part: str) -> int:
        """Return the offset of a part in a packet without payload."""
        return sum(self.size(before) for before in self.order[: self.order.index(part)])

    def tail(self, part: str) -> int:
        """Return the offset of a part from the end of the payload; 0 if packets have no such part."""
        return self.offset(part) - self.payload_at if part in self.order else 0

    def is_behind(self, part: str) -> bool:
        """Whether a part follows the payload."""
        return self.order.index(part) > self.order.index("payload")


class CheckView(NamedTuple):
    """A check.

    :param doc: its description.
    :param template: template of the function that updates it with bytes.
    :param type: its type during the computation.
    :param initial: its value before the first byte.
    :param byte: for a CRC, the expression that is combined with a byte.
    :param leaving: for a CRC, the mask of the bit that is shifted out next.
    :param shifted: for a CRC, the expression for the shifted value.
    :param polynomial: for a CRC, the polynomial in the order of its bits.
    :param runs: the arguments of the function for each covered run of bytes.
    :param covers_payload: whether one of the runs depends on the length of the payload.
    :param result: the expression for the value that is sent.
    :param odd_size: its size if that is five to seven bytes, which fields never have; else 0.
    """

    doc: str
    template: str
    type: str
    initial: str
    runs: tuple[str, ...]
    covers_payload: bool
    result: str
    odd_size: int
    byte: str = ""
    leaving: str = ""
    shifted: str = ""
    polynomial: str = ""


def check_view(shape: PacketParts, framing: Json) -> CheckView | None:
    """Make the view of the check; return None if packets have none."""
    check = framing.get("check")
    if not check:
        return None
    runs = tuple(_runs(shape, check["covers"]))
    size: int = check["size"]
    facts = _METHODS[check["method"]](check, size)
    return CheckView(
        type=_type(size),
        runs=runs,
        covers_payload=any("payload" in run for run in runs),
        odd_size=size if size in (5, 6, 7) else 0,
        **facts,
    )


def _runs(shape: PacketParts, covers: list[str]) -> Iterator[str]:
    """Yield the start and the length of each run of consecutive parts."""
    run: list[str] = []
    for part in (*shape.order, ""):
        if part in covers:
            run.append(part)
        elif run:
            at, size = shape.offset(run[0]), sum(shape.size(member) for member in run)
            place = f"{at}U + payload" if shape.is_behind(run[0]) else f"{at}"
            count = f"{size}U" if "payload" not in run else f"{size}U + payload"
            yield f"&packet[{place}], {'payload' if count == '0U + payload' else count}"
            run.clear()


def _type(size: int) -> str:
    return "uint32_t" if size <= 4 else "uint64_t"


def _number(value: int, size: int) -> str:
    """Return a literal of the type of the check."""
    return unsigned(value, 8 if size > 4 else 4, 2 * size)


def _masked(value: str, size: int) -> str:
    """Return an expression that keeps only the bytes of the check."""
    if size in (4, 8):  # its type has exactly these bytes
        return value
    return f"{value} & {_number((1 << 8 * size) - 1, size)}"


def _sum(check: Json, size: int) -> dict[str, str]:
    complement = check.get("complement", "none")
    zero = "0U" if size <= 4 else "UINT64_C(0)"
    results = {"none": "check", "ones": "~check", "twos": f"({zero} - check)"}
    ends = {"none": "", "ones": ", its ones' complement", "twos": ", its twos' complement"}
    return {
        "doc": f"the sum of the bytes{ends[complement]}",
        "template": "packet_sum.h.j2",
        "initial": "0U",
        "result": _masked(results[complement], size),
    }


def _xor(check: Json, size: int) -> dict[str, str]:
    return {
        "doc": "the exclusive or of the bytes",
        "template": "packet_xor.h.j2",
        "initial": "0U",
        "result": "check",
    }


def _crc(check: Json, size: int) -> dict[str, str]:
    width, reflected = 8 * size, check["reflected"]
    polynomial, initial = check["polynomial"], check["initial"]
    high = 1 if reflected else 1 << width - 1
    wide = f"({_type(size)})bytes[at] << {width - 8}" if width > 8 else "bytes[at]"
    end = f"check ^ {_number(check['final'], size)}" if check["final"] else "check"
    digits = 2 * size
    words = [f"polynomial 0x{polynomial:0{digits}X}", f"initial 0x{initial:0{digits}X}"]
    words += ["reflected" if reflected else "not reflected", f"final 0x{check['final']:0{digits}X}"]
    return {
        "doc": f"a CRC of {width} bits: {', '.join(words)}",
        "template": "packet_crc.h.j2",
        "initial": _number(_reflected(initial, width) if reflected else initial, size),
        "byte": "bytes[at]" if reflected else wide,
        "leaving": _number(high, size),
        "shifted": "check >> 1" if reflected else _shifted(size),
        "polynomial": _number(_reflected(polynomial, width) if reflected else polynomial, size),
        "result": end,
    }


def _shifted(size: int) -> str:
    return "check << 1" if size in (4, 8) else _masked("(check << 1)", size)


def _reflected(number: int, width: int) -> int:
    """Return a number with its bits reversed."""
    return int(f"{number:0{width}b}"[::-1], 2)


_METHODS = {"sum": _sum, "xor": _xor, "crc": _crc}


_TYPES = {1: "uint8_t", 2: "uint16_t", 3: "uint32_t", 4: "uint32_t"}


class AddressView(NamedTuple):
    """The address.

    :param type: the smallest type for it.
    :param read: the expression that reads it from a packet.
    :param put: the statement that writes it to a packet with ``payload`` bytes of payload.
    :param is_behind: whether it follows the payload.
    """

    type: str
    highest: str
    read: str
    put: str
    is_behind: bool


class PacketShapeView(NamedTuple):
    """The shape of packets.

    :param doc: lines of a comment on the parts of a packet.
    :param start: the start bytes.
    :param known: number of bytes needed to know the length.
    :param overhead: length of a packet without payload.
    :param payload_at: offset of the payload.
    :param payload: the expression for the length of the payload; exceeds the maximum if the length in the
        packet is impossible.
    :param put_length: the statement that writes the length of a payload.
    :param begin: the head of the function that writes the parts before a payload.
    :param before: the statements that write these parts.
    :param behind: the statements that write the parts after the payload; the check is the last.
    :param damaged: conditions for damage in a packet of the right length.
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
    """Yield a line for each part: its length and its content."""
    for part in shape.order:
        if part == "payload":
            yield f"payload: at most {framing['maximum_length']} bytes"
            continue
        size = shape.size(part)
        text = f"{part}: {size} byte{'s' * (size > 1)}"
        if part in ("start", "end"):
            text += f", {' '.join(f'{byte:02X}' for byte in framing[part])}"
        elif part == "length":
            text += f", the number of bytes in {', '.join(framing['length']['counts'])}"
        elif part == "check":
            text += f", covers {', '.join(framing['check']['covers'])}"
        yield text


def _before(
    prefix: str, shape: PacketParts, framing: Json, address: AddressView | None
) -> Iterator[str]:
    """Yield the statements that write the parts before the payload, and the address in any case."""
    for part in shape.order:
        at = shape.offset(part)
        if part == "start":
            yield from (f"out[{n}] = {_byte(byte)};" for n, byte in enumerate(framing["start"]))
        elif part == "length":
            yield f"{prefix}_put_length(head >> 16, out);"
        elif part == "id":
            size = shape.size(part)
            # the bits above the id are the length
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
    """Return the expression that reads a number of ``size`` bytes."""
    place = f"{source}[{at}U{further}]" if further else f"{source}[{at}]"
    return place if size == 1 else f"{prefix}_get_{8 * size}({_pointer(place)})"


def _pointer(place: str) -> str:
    return place.removesuffix("[0]") if place.endswith("[0]") else f"&{place}"


def _put(prefix: str, size: int, place: str, value: str, fits: bool = False) -> str:
    """Return the statement that writes the lower ``size`` bytes of a number."""
    if size > 1:
        return f"(void){prefix}_put_{8 * size}({_pointer(place)}, {value});"
    if fits:
        return f"{place} = {value};"
    value = f"({value})" if " " in value and not value.endswith(")") else value
    return f"{place} = (uint8_t)({value} & 0xFFU);"
