"""Frames of Thorlabs APT inside firmware: their bytes, and the positions of their fields."""

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
"""Id -> name of the message; of one of them if several share the id."""
_SHARED: dict[tuple[int, int], str] = {
    (e["id"], e["sub_message"]): name for name, e in _ENTRIES.items() if e.get("sub_message")
}
"""Id and sub-message -> name of the message."""


def entry(name: str) -> dict[str, Any]:
    """Return the registry entry of a message."""
    return _ENTRIES[name]


@cache
def fields_of(name: str, length: int, status: str = "") -> dict[str, dict[str, Any]]:
    """Return the fields of a message by name: those of its header, or of a packet of this length.

    :param status: selects between two layouts of this length.
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
    :param status: the status layout of the unit.
    """

    raw: bytes
    status: str = ""

    @property
    def name(self) -> str:
        """The name of the message; empty for an unknown id."""
        id = int.from_bytes(self.raw[:2], "little")
        sub = int.from_bytes(self.raw[6:8], "little") if self.has_packet else self.raw[2]
        return _SHARED.get((id, sub)) or NAME.get(id, "")

    @property
    def has_packet(self) -> bool:
        """Whether a packet follows the header."""
        return bool(self.raw[4] & _FLAG)

    @property
    def packet(self) -> bytes:
        """The packet; empty without one."""
        return self.raw[_HEADER:]

    @property
    def dest(self) -> int:
        """The destination."""
        return self.raw[4] & ~_FLAG

    @property
    def source(self) -> int:
        """The source."""
        return self.raw[5]

    @property
    def place(self) -> int:
        """The address that is not the host's."""
        return self.source if self.dest == HOST else self.dest

    @property
    def fields(self) -> dict[str, dict[str, Any]]:
        """Its fields by name, as in the registry."""
        return fields_of(self.name, len(self.packet) if self.has_packet else -1, self.status)

    @property
    def channel(self) -> int | None:
        """The channel of the message; None without one."""
        return self["chan_ident"] if "chan_ident" in self.fields else None

    def _span(self, name: str) -> tuple[int, int, bool]:
        field = self.fields[name]
        begins = field["offset"] + (_HEADER if self.has_packet else 0)
        return begins, begins + field["size"], field["signed"]

    def __getitem__(self, name: str) -> int:
        """Return the number in a field."""
        begins, ends, signed = self._span(name)
        return int.from_bytes(self.raw[begins:ends], "little", signed=signed)

    def with_(self, name: str, value: int) -> Frame:
        """Return a copy with another number in a field, wrapped to its size."""
        begins, ends, _ = self._span(name)
        data = (value % (1 << 8 * (ends - begins))).to_bytes(ends - begins, "little")
        return self.patched(begins, data)

    def patched(self, at: int, data: bytes) -> Frame:
        """Return a copy with other bytes at a position."""
        return Frame(self.raw[:at] + data + self.raw[at + len(data) :], self.status)

    def renamed(self, name: str) -> Frame:
        """Return a copy with the id of another message."""
        return self.patched(0, ID[name].to_bytes(2, "little"))

    def to(self, dest: int) -> Frame:
        """Return a copy with another destination."""
        return self.patched(4, bytes((dest | (self.raw[4] & _FLAG),)))

    def coming_from(self, source: int) -> Frame:
        """Return a copy with another source."""
        return self.patched(5, bytes((source,)))

    def with_packet(self, packet: bytes) -> Frame:
        """Return a copy with another packet, and its length in the header."""
        head = self.raw[:2] + len(packet).to_bytes(2, "little")
        return Frame(head + bytes((self.raw[4] | _FLAG,)) + self.raw[5:6] + packet, self.status)


def is_message(raw: bytes) -> bool:
    """Return whether bytes are a whole documented message, in one of its forms."""
    if not is_whole(raw):
        return False
    frame = Frame(raw)
    forms = _ENTRIES[frame.name]["layouts"] if frame.name else ()
    if not frame.has_packet:
        return any(layout["form"] == "header" for layout in forms)
    lengths = [layout["length"] for layout in forms if layout["form"] != "header"]
    return len(frame.packet) in lengths


def is_whole(raw: bytes) -> bool:
    """Return whether the number of bytes matches the header."""
    return len(raw) >= _HEADER and len(raw) == _length(raw)


def _length(raw: bytes) -> int:
    return _HEADER + (int.from_bytes(raw[2:4], "little") if raw[4] & _FLAG else 0)


def cut(data: bytes) -> Iterator[bytes]:
    """Split bytes at the ends of frames; the last piece may be incomplete."""
    while data:
        length = _length(data) if len(data) >= _HEADER else len(data)
        yield data[:length]
        data = data[length:]
