"""What may be behind the refusal of a frame, where its bytes give it away."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire.commands import CommandProtocol
from stagewire.errors import CodecError, UnknownMessageError
from stagewire.framed import FramedProtocol
from stagewire.header import DATA_FLAG, HEADER_SIZE
from stagewire.protocol import available_protocols, load_protocol

__all__ = ["hints_for_frame"]


def hints_for_frame(protocol: FramedProtocol, raw: bytes, error: CodecError) -> Iterator[str]:
    """Yield what may have gone wrong with bytes that a protocol refuses."""
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
        yield "several frames in one text are read from a file, from standard input, or with --end"
    yield from _as_a_command(raw)


def _as_a_command(raw: bytes) -> Iterator[str]:
    """Yield what the bytes are for a protocol of commands; without options they are taken for a frame."""
    for name in available_protocols():
        protocol = load_protocol(name)
        if not isinstance(protocol, CommandProtocol):
            continue
        try:
            command = protocol.decode(raw).message.layout.message
        except CodecError:
            continue
        yield f"as a command of {name} this is {command}: say --direction command"


def _lacks_flag(raw: bytes) -> bool:
    """Whether this is a data frame but for the bit that announces its packet."""
    following = len(raw) - HEADER_SIZE
    return following > 0 and not raw[4] & DATA_FLAG and raw[2] | raw[3] << 8 == following
