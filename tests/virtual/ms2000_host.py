"""A host for a virtual MS-2000 in tests, with decimal bytes as in the document and a stepped clock."""

from collections.abc import Mapping
from functools import cache

from stagewire_virtual.asi_ms2000.instrument import Ms2000Instrument
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.instrument import find_unit
from stagewire_virtual.options import Options, Settings

X = 24
unit_of = cache(find_unit)


class Host:
    """Sends commands, and records answers with their instants in nanoseconds."""

    def __init__(
        self,
        *,
        unit: str = "MS2000",
        strategies: Mapping[str, str] | None = None,
        low_level: bool = True,
        **settings: int,
    ) -> None:
        self.clock = SteppedClock()
        options = Options(
            strategies=strategies or {}, channels=(Settings(**settings),) if settings else ()
        )
        self.instrument = Ms2000Instrument(unit_of(unit), self.clock, options)
        self.said: list[tuple[int, bytes]] = []
        self.refusals: list[str] = []
        self.instrument.on_send = lambda data: self.said.append((self.clock.now, data))
        self.instrument.on_refusal = self.refusals.append
        if low_level:
            self.send(b"\xffB")

    def send(self, data: bytes) -> bytes:
        """Send bytes and return the answers at the same instant."""
        self.said.clear()
        self.instrument.receive(data)
        return b"".join(data for _, data in self.said)

    def ask(self, decimal: str) -> str:
        """Send decimal bytes and return the decimal bytes of the answer."""
        return " ".join(map(str, self.send(bytes(map(int, decimal.split())))))

    def number(self, command: int, size: int, *, signed: bool = True, axis: int = X) -> int:
        """Return the number in the reply to a command."""
        reply = self.send(bytes((axis, command, size, 58)))
        assert len(reply) == size
        return int.from_bytes(reply, "little", signed=signed)

    def write(self, command: int, size: int, number: int, axis: int = X) -> None:
        """Write a number, which must get no answer."""
        data = (number % 256**size).to_bytes(size, "little")
        assert self.send(bytes((axis, command, size)) + data + b":") == b""

    def to(self, milliseconds: float) -> None:
        """Advance to an instant."""
        self.clock.run_until(round(milliseconds * 1e6))

    @property
    def position(self) -> int:
        return self.number(97, 3)

    @property
    def target(self) -> int:
        return self.number(116, 3)

    @property
    def speed(self) -> int:
        return self.number(111, 2)

    @property
    def status(self) -> int:
        return self.number(126, 1, signed=False)

    @property
    def busy(self) -> bool:
        letter = self.send(bytes((X, 63, 58)))
        assert letter in (b"B", b"b")
        return letter == b"B"
