"""Outputs that can burn or heat: whether they are on, and switching them off.

They are the outputs of units with a ``safe_state`` in the registry. Their status has a bit for the output.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Final, Protocol

from stagewire.protocols import FramedMessage
from stagewire_conformance.device.lines.dialogue import addressed_text

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target

_BITS: Final = "status_bits"
_ON: Final = "output_enabled"
"""The status bit of an output that is on."""
_WAIT: Final = 0.5
"""Seconds to wait for a status."""


class Asks(Protocol):
    """A line on which a status can be requested."""

    declared: Declaration

    def ask(self, request: FramedMessage, dest: int, wait: float = ...) -> Incoming | None:
        """Send a request and return its reply."""
        ...


class LiveOutputs:
    """The outputs of a controller that can burn or heat.

    :param line: requests the status.
    :param write_now: sends bytes, with a function that describes them for the log.
    """

    def __init__(self, line: Asks, write_now: Callable[[bytes, Callable[[], str]], None]) -> None:
        self._line = line
        self._write_now = write_now

    @property
    def places(self) -> list[Target]:
        """The targets with such an output."""
        return [place for place in self._line.declared.places if place.unit.safe_state]

    def on(self) -> list[Target]:
        """Return the targets whose status reports that the output is on."""
        return [place for place in self.places if self._is_on(place)]

    def _is_on(self, place: Target) -> bool:
        for request, answer, mask in self._questions(place):
            heard = self._line.ask(request, place.address, _WAIT)
            if heard is not None and heard.name == answer:
                return bool(heard.message.status_bits & mask)
        return False

    def _questions(self, place: Target) -> Iterator[tuple[FramedMessage, str, int]]:
        """Yield the requests of a status with the bit: each with its reply and the mask of the bit."""
        registry = self._line.declared.registry
        tables = registry.table("flags")
        for name in sorted(place.messages):
            for answer in registry.messages[name]["exchange"].get("answered_by", ()):
                field = registry.fields(answer, "data").get(_BITS, {})
                table = field.get("flags_by_unit", {}).get(place.unit.name, field.get("flag_table"))
                if table and _ON in tables[table]["bits"]:
                    channel = place.channels[0] if place.channels else None
                    request = self._line.declared.request(name, channel)
                    yield request, answer, tables[table]["bits"][_ON]["mask"]

    def switch_off(self, place: Target) -> None:
        """Send the messages of the safe state that end the output. It is sent even after an interruption."""
        declared = self._line.declared
        host = declared.framed.host
        channel = place.channels[0] if place.channels else None
        for order in place.unit.safe_state:
            name = order.message.layout.message
            if declared.registry.messages[name]["effect"] == "stop":
                message: FramedMessage = declared.make(name, channel, **order.values)
                told = partial(addressed_text, message, place.address, host)
                self._write_now(message.pack(place.address, host), told)
