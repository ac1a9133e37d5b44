"""A line in simulated time that records what was written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from stagewire.protocols import Protocol
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.linking import SteppedLink


class RecordingLink(SteppedLink):
    """A line to a virtual controller; `sent` is what was written since the last `forget`."""

    def __init__(self, controller: VirtualController) -> None:
        super().__init__(controller)
        self.controller = controller
        self.sent: list[bytes] = []
        self.twist: Callable[[bytes], bytes] = bytes  # applied to all bytes from the controller

    def read(self, timeout: float) -> bytes:
        return self.twist(super().read(timeout))

    def write(self, data: bytes) -> None:
        self.sent.append(bytes(data))
        super().write(data)

    write_now = write

    def forget(self) -> None:
        self.sent.clear()

    @property
    def raw(self) -> bytes:
        return b"".join(self.sent)

    def names(self, protocol: Protocol) -> list[str]:
        """Return the names of the written messages, without keep-alive messages."""
        framer: Any = protocol
        events = framer.framer().feed(self.raw)
        names = [event.frame.message.layout.message for event in events]
        return [name for name in names if not name.endswith("ACK_DCSTATUSUPDATE")]
