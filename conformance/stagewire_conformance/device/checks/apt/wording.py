"""Descriptions of received data, for the sentences of findings."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

from stagewire.errors import CodecError, TrailingBytesError
from stagewire.framing import Garbage
from stagewire.protocols import DATA_FLAG, HEADER_SIZE, FramedProtocol
from stagewire_conformance.device.lines.dialogue import Incoming
from stagewire_conformance.device.lines.strays import entry_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.trial import Trial


_SHOWN: Final = 4
"""The most messages that a sentence names."""


def described(trial: Trial, heard: Iterable[Incoming]) -> str:
    """Return a description of received data: ``MOT_GET_VELPARAMS from 0x50 to 0x01, …``."""
    every = joined(heard)
    if not every:
        return "nothing"
    said = ", then ".join(_said(trial.declared, each) for each in every[:_SHOWN])
    more = len(every) - _SHOWN
    return f"{said}, and {more} more" if more > 0 else said


def joined(heard: Iterable[Incoming]) -> list[Incoming]:
    """Return received data, with consecutive bytes that do not form a message merged into one piece."""
    pieces: list[Incoming] = []
    for each in heard:
        if pieces and pieces[-1].kind == each.kind == "garbage":
            last = pieces[-1]
            pieces[-1] = Incoming(each.time, Garbage(last.raw + each.raw), last.after)
        else:
            pieces.append(each)
    return pieces


def raw_of(heard: Iterable[Incoming]) -> bytes | None:
    """Return all received bytes; None if there are none."""
    return b"".join(each.raw for each in heard) or None


def _said(declared: Declaration, heard: Incoming) -> str:
    addresses = f"from {heard.source:#04x} to {heard.dest:#04x}" if heard.kind != "garbage" else ""
    match heard.kind:
        case "message" | "undocumented":
            channel = "" if heard.channel is None else f" for channel {heard.channel}"
            return f"{heard.name}{channel} {addresses}"
        case "unknown":
            id = int.from_bytes(heard.raw[:2], "little")
            return f"a message {addresses} with the unknown id {id:#06x}"
        case "bad_length":
            name, lengths = _of_id(declared, heard.raw)
            length = len(heard.raw) - HEADER_SIZE
            return f"{name} {addresses} with a packet of {length} bytes instead of {lengths}"
    return f"{heard.raw.hex(' ')}, which is not a message ({_why_none(declared, heard.raw)})"


def _of_id(declared: Declaration, raw: bytes) -> tuple[str, str]:
    """Return the name of the message that bytes begin like, and the lengths that its packet can have."""
    entry = entry_of(declared, raw)
    assert entry is not None  # the framer knows the id
    lengths = sorted({layout["length"] for layout in entry["layouts"] if layout["length"]})
    return entry["name"], " or ".join(map(str, lengths))


def _why_none(declared: Declaration, raw: bytes) -> str:
    """Return why bytes are not a message, judged by the frame at their start."""
    protocol = declared.framed
    has_packet = len(raw) >= HEADER_SIZE and bool(raw[4] & DATA_FLAG)
    packet = int.from_bytes(raw[2:4], "little") if has_packet else 0
    try:
        frame = protocol.decode(raw[: HEADER_SIZE + packet])
    except CodecError as error:
        if len(raw) > HEADER_SIZE and not has_packet:
            return _why_no_packet(protocol, raw) or str(error)
        return str(error)
    name = frame.message.layout.message
    if declared.registry.messages[name]["direction"] == "to_controller":
        return f"decoded as {name}, which only a host sends"
    return (
        f"decoded as {name}, it goes from {frame.source:#04x} to {frame.dest:#04x}, not from a "
        "controller to the host"
    )


def _why_no_packet(protocol: FramedProtocol, raw: bytes) -> str:
    """Return what is wrong with a frame that has an unannounced packet; empty if nothing is."""
    try:
        protocol.decode(raw)
    except TrailingBytesError as error:
        return str(error)
    except CodecError:
        pass
    return ""
