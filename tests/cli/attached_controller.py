"""A virtual controller at the other end of the line that a command opens; its time goes on when it waits."""

from __future__ import annotations

import pytest

import stagewire_virtual as virtual
from stagewire import End
from stagewire_apt import PROTOCOL
from stagewire_virtual import linking
from stagewire_virtual.linking import SteppedLink

URL = "virtual://made"


class Written(SteppedLink):
    """The line of a virtual controller, whose time goes on when somebody waits; keeps what was sent."""

    def __init__(self, controller: virtual.VirtualController) -> None:
        super().__init__(controller)
        self.written: list[bytes] = []

    def write(self, data: bytes) -> None:
        self.written.append(bytes(data))
        super().write(data)

    write_now = write

    def sent(self) -> list[str]:
        """The names of what was sent."""
        events = PROTOCOL.framer(End.NONE).feed(b"".join(self.written))
        return [event.frame.message.layout.message for event in events]

    def count(self, *ids: bytes) -> int:
        return sum(data.count(id) for data in self.written for id in ids)


def attached(monkeypatch: pytest.MonkeyPatch, controller: virtual.VirtualController) -> Written:
    """Have URL lead to a controller, each time that it is opened; what is sent is kept together."""
    made = Written(controller)

    def open_link(url: str, settings: object) -> Written:
        again = Written(controller)
        again.written = made.written
        return again

    monkeypatch.setattr(linking, "open_link", open_link)
    return made
