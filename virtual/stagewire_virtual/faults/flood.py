"""A flood: frames that nobody asked for, one after another."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from stagewire.framed import FramedProtocol
from stagewire_virtual.clock import Clock, nanoseconds
from stagewire_virtual.errors import FaultError
from stagewire_virtual.units import Unit

__all__ = ["Flood", "status_frame"]

_COUNT: Final = 100
_PERIOD: Final = 0.01  # seconds: ten times as often as status updates come


class Flood:
    """Sends the same frame again and again; begun anew while it runs, it goes on as it is.

    :param clock: the time.
    :param send: takes a frame.
    :param data: the frame.
    :param count: how many; by default 100.
    :param period: seconds between two; by default 0.01.
    """

    def __init__(
        self,
        clock: Clock,
        send: Callable[[bytes], None],
        data: bytes,
        count: int | None,
        period: float | None,
    ) -> None:
        self._clock = clock
        self._send = send
        self._data = data
        self._count = count or _COUNT
        self._period = nanoseconds(_PERIOD if period is None else period)
        self._left = 0

    def begin(self) -> None:
        """Begin as soon as time goes on."""
        if not self._left:
            self._left = self._count
            self._clock.call_later(0, self._next)

    def _next(self) -> None:
        self._left -= 1
        if self._left:
            self._clock.call_later(self._period, self._next)
        self._send(self._data)


def status_frame(unit: Unit) -> bytes:
    """Return the status message that a unit sends unasked, of its first channel and with all values zero.

    Raises :class:`~stagewire_virtual.errors.FaultError` for a unit that sends none.
    """
    protocol = unit.protocol
    name = next((name for name in _unasked(unit) if name in unit.messages), None)
    own = unit.facts.get("address")
    if name is None or own is None or not isinstance(protocol, FramedProtocol):
        raise FaultError(f"the {unit.name} has no status message that is known; give hex=BYTES")
    addresses = unit.registry["addresses"]
    source = addresses[own]["value"] if own in addresses else addresses["bays"]["first"]
    layout = protocol.message_class(name).layout
    fields = {field: int(field == "chan_ident") for field in layout.fields}
    message: Any = protocol.build(name, fields)
    raw: bytes = message.pack(addresses["host"]["value"], source)
    return raw


def _unasked(unit: Unit) -> list[str]:
    """Return what messages of the unit begin to have sent again and again."""
    found: list[str] = []
    for entry in unit.registry["messages"]:
        exchange = entry.get("exchange") or {}
        if entry["name"] in unit.messages and "periodic_ms" in exchange:
            found += exchange.get("starts", ())
    return found
