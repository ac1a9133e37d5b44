"""A host for virtual APT controllers in tests: it sends messages, receives frames and advances the clock."""

from __future__ import annotations

from typing import Any

from stagewire import End, Frame, FramedMessage
from stagewire.framing import Received
from stagewire_apt import PROTOCOL
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.instrument import find_unit
from stagewire_virtual.options import Options
from stagewire_virtual.thorlabs_apt.instrument import AptInstrument

HOST = 0x01
USB = 0x50
MOTHERBOARD = 0x11
BAY = 0x21  # the first bay


class Host:
    """The host of ``instrument``, which has a stepped clock."""

    def __init__(self, instrument: AptInstrument) -> None:
        self.instrument = instrument
        assert isinstance(instrument.clock, SteppedClock)
        self.clock = instrument.clock
        self.refusals: list[str] = []
        self._raw: list[bytes] = []
        instrument.on_send = self._raw.append
        instrument.on_refusal = self.refusals.append

    def say(self, message: FramedMessage, dest: int = USB, source: int = HOST) -> None:
        self.instrument.receive(Frame(message, dest, source).encode())

    def ask(self, message: FramedMessage, dest: int = USB) -> list[FramedMessage]:
        """Send a message and return the immediate answers."""
        self.heard_raw()
        self.say(message, dest)
        return [frame.message for frame in self.heard()]

    def heard_raw(self) -> list[bytes]:
        """Return the frames received since the last call, one by one."""
        raw, self._raw[:] = list(self._raw), []
        return raw

    def heard(self) -> list[Frame]:
        """Return the frames received since the last call, decoded with the unit's status block."""
        frames = []
        framer = PROTOCOL.framer(End.HOST)
        for source in PROTOCOL.devices:
            framer.tell(source, status=self.instrument.unit.facts.get("status", "dc"))
        for raw in self.heard_raw():
            [event] = framer.feed(raw)
            assert isinstance(event, Received), event
            frames.append(event.frame)
        return frames

    def messages(self) -> list[FramedMessage]:
        return [frame.message for frame in self.heard()]


def host_of(name: str, **options: Any) -> Host:
    """Return the host of a new virtual unit."""
    return Host(AptInstrument(find_unit(name), SteppedClock(), Options(**options)))
