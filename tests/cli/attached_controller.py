"""Virtual controllers for commands: their clock runs while a command waits."""

from __future__ import annotations

import pytest

import stagewire_virtual as virtual
from stagewire import End
from stagewire_apt import PROTOCOL
from stagewire_virtual import linking
from stagewire_virtual.linking import SteppedLink

URL = "virtual://made"


class Written(SteppedLink):
    """A link to a virtual controller that advances its clock while waiting and records sent messages."""

    def __init__(self, controller: virtual.VirtualController) -> None:
        super().__init__(controller)
        self.written: list[bytes] = []

    def write(self, data: bytes) -> None:
        self.written.append(bytes(data))
        super().write(data)

    write_now = write

    def sent(self) -> list[str]:
        """The names of the sent messages."""
        events = PROTOCOL.framer(End.NONE).feed(b"".join(self.written))
        return [event.frame.message.layout.message for event in events]

    def count(self, *ids: bytes) -> int:
        return sum(data.count(id) for data in self.written for id in ids)


def attached(monkeypatch: pytest.MonkeyPatch, controller: virtual.VirtualController) -> Written:
    """Make URL open a controller, and return the record of everything that is sent to it."""
    made = Written(controller)

    def open_link(url: str, settings: object) -> Written:
        again = Written(controller)
        again.written = made.written
        return again

    monkeypatch.setattr(linking, "open_link", open_link)
    return made
