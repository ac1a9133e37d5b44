"""A minimal instrument for tests of links and servers: it echoes bytes, and ticks."""

from __future__ import annotations

from collections.abc import Sequence

from stagewire_virtual.clock import Clock, nanoseconds
from stagewire_virtual.errors import UnknownPartError
from stagewire_virtual.instrument import Instrument, Row, find_unit
from stagewire_virtual.serving.link import Link, Observer

TICK = b"tick!"


class EchoInstrument(Instrument):
    """Echoes each chunk; ``t`` starts ticks every 10 ms, ``s`` stops them, and ``!`` raises."""

    def __init__(self, clock: Clock, period: float = 0.01) -> None:
        super().__init__(find_unit("TDC001"), clock)
        self.period = nanoseconds(period)
        self.heard: list[tuple[int, bytes]] = []
        self.ticking = False

    def receive(self, data: bytes) -> None:
        self.heard.append((self.clock.now, data))
        if data == b"!":
            raise RuntimeError("the instrument failed")
        if data == b"t":
            self.ticking = True
            self.clock.call_later(self.period, self._tick)
        elif data == b"s":
            self.ticking = False
        else:
            self.on_send(data)

    def _tick(self) -> None:
        if self.ticking:
            self.on_send(TICK)
            self.clock.call_later(self.period, self._tick)

    def power_cycle(self) -> None:
        self.ticking = False

    def rows(self) -> Sequence[Row]:
        return [Row("part", "0 m", "talking")]

    def stick(self, part: str, stuck: bool) -> None:
        raise UnknownPartError(part, ["part"])


class Notebook(Observer):
    """An observer that records everything."""

    def __init__(self) -> None:
        self.lines: list[tuple[str, int, bytes | str]] = []

    def received(self, link: Link, when: int, data: bytes) -> None:
        self.lines.append((">", when, data))

    def sent(self, link: Link, when: int, data: bytes) -> None:
        self.lines.append(("<", when, data))

    def noted(self, link: Link, when: int, text: str) -> None:
        self.lines.append(("#", when, text))

    @property
    def notes(self) -> list[str]:
        return [str(what) for kind, _, what in self.lines if kind == "#"]
