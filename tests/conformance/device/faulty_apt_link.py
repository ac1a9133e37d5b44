"""A line to a virtual Thorlabs APT controller that changes frames, so that rules are broken."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from stagewire.framing import End
from stagewire.links import Link
from stagewire_apt import PROTOCOL
from wrapped_links import WrappedLink

DATA_FLAG = 0x80
IDS = {
    entry["name"]: entry["id"]
    for entry in PROTOCOL.registry()["messages"]
    if entry["id"] is not None
}

_NAMES = {
    (entry["id"], entry.get("sub_message")): name
    for entry in reversed(PROTOCOL.registry()["messages"])
    if (name := entry["name"]) in IDS
}

Change = Callable[[bytes], bytes]
"""Takes the bytes of a frame and returns the bytes to pass on: none, one or several frames."""


def as_it_is(raw: bytes) -> bytes:
    return raw


@dataclass
class LinkFault:
    """A fault.

    :param to_host: changes frames from the controller.
    :param to_controller: changes writes; each write is a frame or another piece of bytes.
    :param late: delay of everything received, in seconds.
    """

    to_host: Change = as_it_is
    to_controller: Change = as_it_is
    late: float = 0.0


class FaultyAptLink(WrappedLink):
    """A stepped line that changes the traffic."""

    def __init__(self, link: Link, spoil: LinkFault) -> None:
        super().__init__(link)
        self._spoil = spoil
        self._framer = PROTOCOL.framer(End.HOST)

    def read(self, timeout: float) -> bytes:
        data = self._link.read(timeout)
        if data and self._spoil.late:
            data += self._link.read(self._spoil.late)
        return b"".join(self._spoil.to_host(event.raw) for event in self._framer.feed(data))

    def write(self, data: bytes) -> None:
        if changed := self._spoil.to_controller(data):
            self._link.write(changed)


def name_of(raw: bytes) -> str:
    """Return the name of the message with the id and sub-message of these bytes; empty if it is unknown."""
    id = int.from_bytes(raw[:2], "little")
    has_data = len(raw) > 6 and raw[4] & DATA_FLAG
    number = int.from_bytes(raw[6:8] if has_data else raw[2:3], "little")
    return _NAMES.get((id, number)) or _NAMES.get((id, None), "")


def of(names: str | Iterable[str], change: Change) -> Change:
    """Change only the frames of some messages."""
    wanted = {names} if isinstance(names, str) else set(names)
    return lambda raw: change(raw) if name_of(raw) in wanted else raw


def of_source(source: int, change: Change) -> Change:
    """Change only the frames from one address."""
    return lambda raw: change(raw) if raw[5] == source else raw


def byte(at: int, value: int) -> Change:
    """Replace a byte of the frame."""
    return lambda raw: raw[:at] + bytes((value,)) + raw[at + 1 :] if len(raw) > at else raw


def plus(at: int, by: int) -> Change:
    """Add to a byte of a frame that has it, modulo 256."""
    return lambda raw: (
        raw[:at] + bytes(((raw[at] + by) % 256,)) + raw[at + 1 :] if len(raw) > at else raw
    )


def flip(at: int, mask: int) -> Change:
    """Invert bits of a byte."""
    return lambda raw: raw[:at] + bytes((raw[at] ^ mask,)) + raw[at + 1 :]


def renamed(name: str) -> Change:
    """Replace the id of a frame by that of another message."""
    return lambda raw: IDS[name].to_bytes(2, "little") + raw[2:]


def shorter(raw: bytes) -> bytes:
    """Remove a byte from the packet, with a matching length in the header."""
    return raw[:2] + (len(raw) - 7).to_bytes(2, "little") + raw[4:-1]


def dropped(raw: bytes) -> bytes:
    return b""


def twice(raw: bytes) -> bytes:
    return raw + raw


def followed_by(more: bytes) -> Change:
    return lambda raw: raw + more


def every(count: int, change: Change) -> Change:
    """Change only every ``count``-th frame."""
    seen = [0]

    def changed(raw: bytes) -> bytes:
        seen[0] += 1
        return change(raw) if seen[0] % count == 0 else raw

    return changed


def from_the(number: int, change: Change) -> Change:
    """Change the ``number``-th frame and all later ones."""
    seen = [0]

    def changed(raw: bytes) -> bytes:
        seen[0] += 1
        return change(raw) if seen[0] >= number else raw

    return changed


def frame(name: str, param1: int = 0, param2: int = 0, dest: int = 1, source: int = 0x50) -> bytes:
    """Return a header."""
    return IDS[name].to_bytes(2, "little") + bytes((param1, param2, dest, source))
