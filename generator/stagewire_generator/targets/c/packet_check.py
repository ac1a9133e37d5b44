"""How the check of a packet is computed: bit by bit, which needs no table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from stagewire_generator.model import Json
from stagewire_generator.targets.c.packet_parts import PacketParts
from stagewire_generator.targets.c.source import unsigned

__all__ = ["CheckView", "check_view"]


@dataclass(frozen=True, slots=True)
class CheckView:
    """A check.

    :param doc: what it is.
    :param template: that of the function that takes bytes into it.
    :param type: of the number while it is computed.
    :param initial: the number before the first byte.
    :param byte: of a CRC, a byte where it is taken in.
    :param leaving: of a CRC, the bit that goes out next.
    :param shifted: of a CRC, the number without that bit.
    :param polynomial: of a CRC, in the order of its bits.
    :param runs: the arguments of that function for each run of bytes that is covered.
    :param covers_payload: whether one of them depends on the length of the payload.
    :param result: what is sent of the number in the end.
    :param odd_size: its bytes where these are five to seven, which no field has; else 0.
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
    """Make the view of the check, if packets have one."""
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
    """Yield where each run of parts that follow one another begins, and its bytes."""
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
    """Return a number without what goes beyond the bytes that it has."""
    if size in (4, 8):  # its type has no more
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
    """Return the number with its bits in the other order."""
    return int(f"{number:0{width}b}"[::-1], 2)


_METHODS = {"sum": _sum, "xor": _xor, "crc": _crc}
