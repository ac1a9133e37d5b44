"""Python classes of messages in packets, one view per class, and the protocol object."""

from __future__ import annotations

from collections.abc import Iterable

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.python.brackets import Nested, Source, call, strings
from stagewire_generator.targets.python.class_view import payload_views
from stagewire_generator.targets.python.framing import Framing, named, nameless
from stagewire_generator.targets.python.source import literal

_CHECKS = {"sum": "Sum", "xor": "Xor", "crc": "Crc"}  # method -> class


def check_class(framing: Json) -> list[str]:
    """Return the name of the class of the check, or an empty list if packets have none."""
    return [_CHECKS[framing["check"]["method"]]] if "check" in framing else []


def shape(framing: Json) -> Nested:
    """Return the argument ``shape=`` of a protocol."""
    arguments: list[Source] = [
        _parts("order", framing["order"]),
        f"start={_bytes(framing['start'])}",
        f"length={framing['length']['size']}",
        _parts("counts", framing["length"]["counts"]),
        f"id={framing['id']['size']}",
        f"maximum={framing['maximum_length']}",
    ]
    if "address" in framing:
        arguments.append(f"address={framing['address']['size']}")
    if "check" in framing:
        arguments += [_check(framing["check"]), _parts("covers", framing["check"]["covers"])]
    if "end" in framing:
        arguments.append(f"end={_bytes(framing['end'])}")
    return call("shape=Shape", arguments, broken=True)


def _check(check: Json) -> Nested:
    digits = 2 * check["size"]
    arguments = {
        "sum": [f"size={check['size']}", f"complement={literal(check.get('complement', ''))}"],
        "xor": [],
        "crc": [
            f"size={check['size']}",
            *(f"{key}=0x{check.get(key, 0):0{digits}X}" for key in ("polynomial", "initial")),
            f"reflected={check.get('reflected')}",
            f"final=0x{check.get('final', 0):0{digits}X}",
        ],
    }
    method = check["method"]
    return call(f"check={_CHECKS[method]}", arguments[method])


def _parts(name: str, parts: Iterable[str]) -> Nested:
    return strings(f"{name}=", parts)


def _bytes(values: Iterable[int]) -> str:
    """Return a bytes literal with every byte escaped: they are numbers, not text."""
    return 'b"' + "".join(f"\\x{value:02x}" for value in values) + '"'


def _packet_protocol(protocol: Protocol) -> Nested:
    lines = [*named(protocol), shape(protocol.framing), nameless(protocol)]
    return call("PacketProtocol", lines, broken=True)


def _packet_imports(protocol: Protocol) -> tuple[str, ...]:
    return ("PacketMessage", "PacketProtocol", "Shape", *check_class(protocol.framing))


FRAMING = Framing(
    class_views=lambda protocol, message: payload_views(protocol, message, "PacketMessage"),
    message_base="PacketMessage",
    imports=_packet_imports,
    protocol=_packet_protocol,
)
