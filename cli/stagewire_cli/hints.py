"""What may be behind the refusal of a frame or a packet, where its bytes give it away."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from stagewire.errors import CodecError, StagewireError, UnknownMessageError
from stagewire.protocols import (
    DATA_FLAG,
    HEADER_SIZE,
    CommandProtocol,
    FramedProtocol,
    PacketProtocol,
    available_protocols,
    load_protocol,
)
from stagewire_conformance.answers import message_of
from stagewire_conformance.codec import codec_of
from stagewire_conformance.codec.base import Codec

_SEVERAL = "several {} in one text are read from a file, from standard input, or with --end"


def codecs() -> list[Codec]:
    """Return the codecs of all protocols that are installed and can be used.

    To look for them takes milliseconds: who explains many refusals asks once.
    """
    found = []
    for name in available_protocols():
        try:
            found.append(codec_of(load_protocol(name)))
        except StagewireError:  # what cannot be loaded is no hint
            continue
    return found


def hints_for_frame(
    protocol: FramedProtocol, raw: bytes, error: CodecError, known: Iterable[Codec]
) -> Iterator[str]:
    """Yield what may have gone wrong with bytes that a protocol refuses.

    :param known: the codecs that may read them instead.
    """
    if isinstance(error, UnknownMessageError):
        ids = {cls.layout.id: cls.layout.message for cls in protocol.messages}
        turned = raw[0] << 8 | raw[1]
        if turned in ids:
            yield (
                f"{turned:#06x} is {ids[turned]}; the id comes low byte first: "
                f"{raw[1]:02X} {raw[0]:02X}"
            )
    elif _lacks_flag(raw):
        yield (
            f"bytes 2 and 3 would declare exactly the {len(raw) - HEADER_SIZE} bytes that follow: "
            f"byte 4 seems to lack the bit of a data packet ({raw[4] | DATA_FLAG:#04x})"
        )
    elif error.code == "trailing":
        yield _SEVERAL.format("frames")
    yield from _in_others(raw, known)


def hints_for_packet(
    protocol: PacketProtocol, raw: bytes, error: CodecError, known: Iterable[Codec]
) -> Iterator[str]:
    """Yield what may have gone wrong with bytes that a protocol of packets refuses.

    :param known: the codecs that may read them instead.
    """
    start = raw.find(protocol.shape.start)
    if start > 0:
        yield f"the bytes that begin a packet stand at byte {start}"
    elif error.code == "trailing":
        yield _SEVERAL.format("packets")
    yield from _in_others(raw, known)


def _in_others(raw: bytes, known: Iterable[Codec]) -> Iterator[str]:
    """Yield what bytes that were refused are in other protocols, and how they are read so."""
    for codec in known:
        try:
            message = message_of(codec.decoded(raw, {})).layout.message
        except StagewireError:  # what cannot be read so is no hint
            continue
        name = codec.protocol.name
        if isinstance(codec.protocol, CommandProtocol):
            yield f"as a command of {name} this is {message}: say --direction command"
        else:
            yield f"in {name} this is {message}: say --protocol {name}"


def _lacks_flag(raw: bytes) -> bool:
    """Whether this is a data frame but for the bit that announces its packet."""
    following = len(raw) - HEADER_SIZE
    return following > 0 and not raw[4] & DATA_FLAG and raw[2] | raw[3] << 8 == following
