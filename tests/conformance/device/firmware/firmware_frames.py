"""Frames of Thorlabs APT as firmware has them in its hands: bytes, and where in them what stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

from stagewire_apt import PROTOCOL

HOST = 0x01
_HEADER = 6
_FLAG = 0x80
_ENTRIES: dict[str, dict[str, Any]] = {e["name"]: e for e in PROTOCOL.registry()["messages"]}
ID: dict[str, int] = {name: e["id"] for name, e in _ENTRIES.items() if e["id"] is not None}
"""Name of a message -> its id."""
NAME: dict[int, str] = {id: name for name, id in ID.items()}
"""Id -> name of the message."""


def entry(name: str) -> dict[str, Any]:
    """Return what the registry has of a message."""
    return _ENTRIES[name]


@cache
def fields_of(name: str, length: int, status: str = "") -> dict[str, dict[str, Any]]:
    """Return the fields of a message by name: those of its header, or of a packet of this length.

    :param status: decides where two layouts have this length.
    """
    for layout in _ENTRIES[name]["layouts"]:
        when = layout["when"] or {}
        is_header = layout["form"] == "header"
        if is_header != (length < 0) or (not is_header and layout["length"] != length):
            continue
        if when and status and when.get("status") != status:
            continue
        params = [layout[key] for key in ("param1", "param2") if layout[key]]
        return {field["name"]: field for field in (*params, *layout["fields"])}
    return {}


@dataclass(frozen=True)
class Frame:
    """A whole frame of a known message.

    :param raw: its bytes.
    :param status: which layout a status has on this unit.
    """

    raw: bytes
    status: str = ""

    @property
    def name(self) -> str:
        """The name of the message; empty for an id that is none."""
        return NAME.get(int.from_bytes(self.raw[:2], "little"), "")

    @property
    def has_packet(self) -> bool:
        """Whether a packet follows the header."""
        return bool(self.raw[4] & _FLAG)

    @property
    def packet(self) -> bytes:
        """The packet; empty where there is none."""
        return self.raw[_HEADER:]

    @property
    def dest(self) -> int:
        """Whom it goes to."""
        return self.raw[4] & ~_FLAG

    @property
    def source(self) -> int:
        """Whom it comes from."""
        return self.raw[5]

    @property
    def place(self) -> int:
        """The end of it that is not the host."""
        return self.source if self.dest == HOST else self.dest

    @property
    def fields(self) -> dict[str, dict[str, Any]]:
        """Its fields by name, as the registry has them."""
        return fields_of(self.name, len(self.packet) if self.has_packet else -1, self.status)

    @property
    def channel(self) -> int | None:
        """The channel that it is about; None: it names none."""
        return self["chan_ident"] if "chan_ident" in self.fields else None

    def _span(self, name: str) -> tuple[int, int, bool]:
        field = self.fields[name]
        begins = field["offset"] + (_HEADER if self.has_packet else 0)
        return begins, begins + field["size"], field["signed"]

    def __getitem__(self, name: str) -> int:
        """Return a field as a number."""
        begins, ends, signed = self._span(name)
        return int.from_bytes(self.raw[begins:ends], "little", signed=signed)

    def with_(self, name: str, value: int) -> Frame:
        """Return it with another number in a field, which wraps where it does not fit."""
        begins, ends, _ = self._span(name)
        data = (value % (1 << 8 * (ends - begins))).to_bytes(ends - begins, "little")
        return self.patched(begins, data)

    def patched(self, at: int, data: bytes) -> Frame:
        """Return it with other bytes in a place."""
        return Frame(self.raw[:at] + data + self.raw[at + len(data) :], self.status)

    def renamed(self, name: str) -> Frame:
        """Return it with the id of another message."""
        return self.patched(0, ID[name].to_bytes(2, "little"))

    def to(self, dest: int) -> Frame:
        """Return it with another receiver."""
        return self.patched(4, bytes((dest | (self.raw[4] & _FLAG),)))

    def coming_from(self, source: int) -> Frame:
        """Return it with another sender."""
        return self.patched(5, bytes((source,)))

    def with_packet(self, packet: bytes) -> Frame:
        """Return it with another packet, and a header that says how long that is."""
        head = self.raw[:2] + len(packet).to_bytes(2, "little")
        return Frame(head + bytes((self.raw[4] | _FLAG,)) + self.raw[5:6] + packet, self.status)


def is_message(raw: bytes) -> bool:
    """Whether bytes are a whole message of the document, in one of its forms."""
    if not is_whole(raw):
        return False
    frame = Frame(raw)
    forms = _ENTRIES[frame.name]["layouts"] if frame.name else ()
    if not frame.has_packet:
        return any(layout["form"] == "header" for layout in forms)
    lengths = [layout["length"] for layout in forms if layout["form"] != "header"]
    return len(frame.packet) in lengths


def is_whole(raw: bytes) -> bool:
    """Whether bytes are as many as their header says."""
    return len(raw) >= _HEADER and len(raw) == _length(raw)


def _length(raw: bytes) -> int:
    return _HEADER + (int.from_bytes(raw[2:4], "little") if raw[4] & _FLAG else 0)


def cut(data: bytes) -> Iterator[bytes]:
    """Cut bytes where headers say that frames end; the last piece may be the beginning of one."""
    while data:
        length = _length(data) if len(data) >= _HEADER else len(data)
        yield data[:length]
        data = data[length:]
