"""The facts of a protocol that framing needs: ids with directions and forms, addresses, and fault reports.

A fault report is an unsolicited message in which a controller reports that something went wrong. The messages
that are fault reports, and the offsets of code and text in their frames, are facts of the protocol
(:attr:`stagewire.protocols.FramedProtocol.faults`). They are offsets into the frame, not fields, because a
document may name such a message without its layout.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping

from stagewire._codec.message import Direction
from stagewire._framings.header.counted import Counted
from stagewire._framings.header.message import DATA_FLAG, HEADER_SIZE, MAXIMUM_PACKET

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Final

_WORD = 2  # bytes
SUB_MESSAGE_SIZE: Final = _WORD
"""Bytes of a sub-message at the beginning of a packet; in a header it is the first parameter."""


class Fault:
    """A fault that a controller reported.

    :param code: the controller's own fault code; 0: the report has none.
    :param text: the controller's own text; empty: the report has none. Hex if the bytes are not printable
        ASCII.
    :param request: id of the message that caused the fault; 0: the report names none.
    """

    __slots__ = ("code", "request", "text")

    def __init__(self, code: int, text: str, request: int) -> None:
        self.code = code
        self.text = text
        self.request = request

    def __str__(self) -> str:
        """Return the code and the text for people."""
        parts = [f"code {self.code}"] if self.code else []
        if self.text:
            parts.append(repr(self.text))
        return ", ".join(parts) or "without a code"


class FaultPlaces:
    """Offsets, in the frame of a fault report, of the reported values. Numbers have two bytes.

    :param code: offset of the fault code.
    :param text: offset of the text, which ends at a zero byte or with the frame; None: no text.
    :param request: offset of the id of the message that caused the fault; None: no id.
    """

    __slots__ = ("code", "request", "text")

    def __init__(self, code: int, text: int | None = None, request: int | None = None) -> None:
        self.code = code
        self.text = text
        self.request = request

    def read(self, raw: bytes) -> Fault:
        """Return the fault in a frame. Values missing from a short frame are 0 or empty."""
        text = b"" if self.text is None else raw[self.text :].split(b"\0")[0]
        shown = text.decode("ascii") if _is_printable(text) else text.hex(" ")
        request = 0 if self.request is None else _word(raw, self.request)
        return Fault(_word(raw, self.code), shown.strip(), request)


def _word(raw: bytes, offset: int) -> int:
    return int.from_bytes(raw[offset : offset + _WORD], "little")


def _is_printable(text: bytes) -> bool:
    return all(0x20 <= byte <= 0x7E for byte in text)


class End(enum.Enum):
    """The end of the line that a framer is at. It determines which messages reach the framer.

    ``HOST`` receives messages from controllers, ``DEVICE`` messages from the host, and ``NONE``, a listener,
    receives both.
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


_NONE: Mapping[int, Forms] = {}


class Forms:
    """The facts of one message id that framing needs. Do not modify them.

    :param name: name of the message, for people.
    :param direction: the direction in which it travels.
    :param header: whether it has a form without a packet.
    :param lengths: packet lengths of its data forms; empty if it has none.
    :param documented: False for an id that is known without a layout.
    :param only_zero_parameters: the header form is valid only if both parameter bytes are zero.
    :param sub_messages: sub-message -> its forms, if several messages share the id; the others are then those
        of any of them.
    :param counted: the array at the end of its packets, whose length depends on their fields; None: all
        lengths are in ``lengths``.
    """

    __slots__ = (
        "counted", "direction", "documented", "header", "lengths", "name", "only_zero_parameters",
        "sub_messages",
    )  # fmt: skip

    def __init__(
        self,
        name: str,
        direction: Direction,
        header: bool,
        lengths: frozenset[int],
        documented: bool = True,
        only_zero_parameters: bool = False,
        sub_messages: Mapping[int, Forms] = _NONE,
        counted: Counted | None = None,
    ) -> None:
        self.name = name
        self.direction = direction
        self.header = header
        self.lengths = lengths
        self.documented = documented
        self.only_zero_parameters = only_zero_parameters
        self.sub_messages = sub_messages
        self.counted = counted


def shared_forms(sub_messages: Mapping[int, Forms]) -> Forms:
    """Return the forms of an id from those of its sub-messages, which have one direction."""
    every = tuple(sub_messages.values())
    return Forms(
        f"{every[0].name} or another sub-message",
        every[0].direction,
        any(forms.header for forms in every),
        frozenset().union(*(forms.lengths for forms in every)),
        sub_messages=sub_messages,
    )


def sub_message_of(raw: bytes) -> int | None:
    """Return the sub-message in a whole frame of a shared id; None if its packet is too short for one."""
    if len(raw) == HEADER_SIZE and not raw[4] & DATA_FLAG:
        return raw[2]
    return _word(raw, HEADER_SIZE) if len(raw) >= HEADER_SIZE + SUB_MESSAGE_SIZE else None


def message_key(id: int, sub_message: int | None) -> int:
    """Return one number for a message: its id, or a greater number if it has a sub-message."""
    return id if sub_message is None else id | (sub_message + 1) << 16


class FramingTable:
    """The facts of a protocol that framing needs. Do not modify them.

    :param forms: message id -> its forms.
    :param host: address of the host.
    :param devices: addresses of controllers.
    :param without_flag: the first four bytes of frames that have a packet even without the data flag.

    Raises :class:`ValueError` for numbers that no frame can hold.
    """

    __slots__ = ("devices", "forms", "host", "names", "shared", "without_flag")

    def __init__(
        self,
        forms: Mapping[int, Forms],
        host: int,
        devices: frozenset[int],
        without_flag: frozenset[bytes] = frozenset(),
    ) -> None:
        for address in (host, *devices):
            if not 0 <= address <= 0xFF or address & DATA_FLAG:
                raise ValueError(f"{address:#x} is not an address: bit 7, the data flag, must be 0")
        for id, known in forms.items():
            if not 0 <= id <= 0xFFFF:
                raise ValueError(f"{known.name}: the id {id:#x} does not fit into 16 bits")
            least = SUB_MESSAGE_SIZE if known.sub_messages else 1
            for length in known.lengths:
                if not least <= length <= MAXIMUM_PACKET:
                    raise ValueError(
                        f"{known.name}: a packet has {least} to {MAXIMUM_PACKET} bytes, not {length}"
                    )
        self.forms = forms
        self.shared = frozenset(id for id, known in forms.items() if known.sub_messages)
        """The ids that several messages share."""
        self.names = {id: known.name for id, known in forms.items()}
        """Key of a message (:func:`message_key`) -> its name."""
        for id in self.shared:
            for value, known in forms[id].sub_messages.items():
                self.names[message_key(id, value)] = known.name
        self.host = host
        self.devices = devices
        self.without_flag = without_flag

    def has_packet(self, header: bytes) -> bool:
        """Whether a packet follows a header."""
        return header[4] >= DATA_FLAG or header[:4] in self.without_flag

    def key_of(self, raw: bytes) -> int:
        """Return the key of the message in a whole frame."""
        id = _word(raw, 0)
        return message_key(id, sub_message_of(raw)) if id in self.shared else id
