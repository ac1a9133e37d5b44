"""Fault reports: messages by which a controller says, unsolicited, that something went wrong.

Which messages report a fault, and where in their frames the code and the text are, is a fact of the
protocol (:attr:`stagewire.framed.FramedProtocol.faults`). It is given in offsets into the frame and not in
fields, because an issue of a document may name such a message without a layout.
"""

from __future__ import annotations

__all__ = ["Fault", "FaultPlaces"]

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
