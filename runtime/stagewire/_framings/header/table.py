"""What framing has to know of a protocol: which end receives what, ids, forms, addresses and fault reports.

A fault report is a message by which a controller says, unsolicited, that something went wrong. Which messages
report a fault, and where in their frames the code and the text are, is a fact of the protocol
(:attr:`stagewire.protocols.FramedProtocol.faults`). It is given in offsets into the frame and not in fields,
because an issue of a document may name such a message without a layout.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping

from stagewire._codec.message import Direction
from stagewire._framings.header.message import DATA_FLAG, MAXIMUM_PACKET

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Final

_WORD = 2  # bytes


class Fault:
    """What a controller reported.

    :param code: the controller's own fault code; 0: the report carries none.
    :param text: the controller's own words; empty: the report carries none. Bytes that are not printable
        ASCII are given in hex.
    :param request: id of the message that brought the fault about; 0: the report names none.
    """

    __slots__ = ("code", "request", "text")

    def __init__(self, code: int, text: str, request: int) -> None:
        self.code = code
        self.text = text
        self.request = request

    def __str__(self) -> str:
        """Return code and text for people."""
        parts = [f"code {self.code}"] if self.code else []
        if self.text:
            parts.append(repr(self.text))
        return ", ".join(parts) or "without a code"


class FaultPlaces:
    """Where a message that reports a fault says what; offsets into the frame, numbers of two bytes.

    :param code: of the fault code.
    :param text: of the text, which ends with the frame or at a zero byte; None: the message has none.
    :param request: of the id of the message that brought the fault about; None: the message has none.
    """

    __slots__ = ("code", "request", "text")

    def __init__(self, code: int, text: int | None = None, request: int | None = None) -> None:
        self.code = code
        self.text = text
        self.request = request

    def read(self, raw: bytes) -> Fault:
        """Read the report from the bytes of a frame; what a short frame leaves out is not reported."""
        text = b"" if self.text is None else raw[self.text :].split(b"\0")[0]
        shown = text.decode("ascii") if _is_printable(text) else text.hex(" ")
        request = 0 if self.request is None else _word(raw, self.request)
        return Fault(_word(raw, self.code), shown.strip(), request)


def _word(raw: bytes, offset: int) -> int:
    return int.from_bytes(raw[offset : offset + _WORD], "little")


def _is_printable(text: bytes) -> bool:
    return all(0x20 <= byte <= 0x7E for byte in text)


class End(enum.Enum):
    """Which end of the line a framer sits on, hence which messages reach it.

    ``HOST`` receives what controllers send, ``DEVICE`` what the host sends, ``NONE`` listens to
    both.
    """

    HOST = "host"
    DEVICE = "device"
    NONE = "none"

    @property
    def receives(self) -> Direction:
        """The directions of the messages that reach this end."""
        return _RECEIVES[self]


_RECEIVES: Final = {
    End.HOST: Direction.TO_HOST,
    End.DEVICE: Direction.TO_CONTROLLER,
    End.NONE: Direction.BOTH,
}


class Forms:
    """What framing has to know of one message id. Not to be modified.

    :param name: name of the message, for people.
    :param direction: which way it travels.
    :param header: whether it has a form without a packet.
    :param lengths: packet lengths of its data forms; empty when it has none.
    :param documented: False for an id that is known without a layout.
    :param only_zero_parameters: the header form counts only with both parameter bytes zero.
    """

    __slots__ = ("direction", "documented", "header", "lengths", "name", "only_zero_parameters")

    def __init__(
        self,
        name: str,
        direction: Direction,
        header: bool,
        lengths: frozenset[int],
        documented: bool = True,
        only_zero_parameters: bool = False,
    ) -> None:
        self.name = name
        self.direction = direction
        self.header = header
        self.lengths = lengths
        self.documented = documented
        self.only_zero_parameters = only_zero_parameters


class FramingTable:
    """Everything that framing has to know of a protocol. Not to be modified.

    :param forms: message id -> its forms.
    :param host: address of the host.
    :param devices: addresses that controllers have.

    Raises :class:`ValueError` for numbers that no frame can carry.
    """

    __slots__ = ("devices", "forms", "host")

    def __init__(self, forms: Mapping[int, Forms], host: int, devices: frozenset[int]) -> None:
        for address in (host, *devices):
            if not 0 <= address <= 0xFF or address & DATA_FLAG:
                raise ValueError(f"{address:#x} is no address: it has to leave the data flag free")
        for id, known in forms.items():
            if not 0 <= id <= 0xFFFF:
                raise ValueError(f"{known.name}: a message id has 16 bits, {id:#x} has more")
            for length in known.lengths:
                if not 0 < length <= MAXIMUM_PACKET:
                    raise ValueError(
                        f"{known.name}: a packet has 1 to {MAXIMUM_PACKET} bytes, not {length}"
                    )
        self.forms = forms
        self.host = host
        self.devices = devices
