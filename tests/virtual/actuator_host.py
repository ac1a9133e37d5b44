"""A host in tests for one channel of a piezo controller, strain gauge reader or solenoid driver."""

from typing import Any

from apt_host import HOST, USB

from stagewire import FramedMessage
from stagewire_apt import PROTOCOL
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.instrument import find_unit
from stagewire_virtual.options import Options, Settings
from stagewire_virtual.thorlabs_apt.instrument import AptInstrument

STATUS = {"piezo": "PZ_GET_PZSTATUSUPDATE", "stepper": "MOT_GET_STATUSUPDATE"}


class ActuatorHost:
    """Sends messages, and records received messages with their instants in nanoseconds.

    :param unit: the name of the unit.
    :param address: the address to send to.
    :param travel: the travel of the channel, as in :class:`Settings`.
    :param position: the position of the channel, as in :class:`Settings`.
    :param seed: the seed of the instrument.
    """

    def __init__(
        self,
        unit: str,
        *,
        address: int = USB,
        travel: int | None = None,
        position: int | None = None,
        seed: int = 0,
    ) -> None:
        self.clock = SteppedClock()
        self.address = address
        options = Options(seed=seed, channels=(Settings(travel=travel, position=position),))
        self.instrument = AptInstrument(find_unit(unit), self.clock, options)
        self.behaviour: Any = self.instrument.channel(1).behaviour
        self.refusals: list[str] = []
        self.said: list[tuple[int, FramedMessage]] = []
        self.instrument.on_refusal = self.refusals.append
        self.instrument.on_send = self._hear
        facts = find_unit(unit).facts
        self._context = {"status": facts["status"]} if "status" in facts else {}

    def tell(self, *messages: FramedMessage) -> list[FramedMessage]:
        """Send messages and return the answers at the same instant."""
        before = len(self.said)
        for message in messages:
            self.instrument.receive(message.pack(self.address, HOST))
        return [message for _, message in self.said[before:]]

    def ask(self, message: FramedMessage) -> Any:
        """Send a request and return its only answer."""
        (answer,) = self.tell(message)
        return answer

    def refuses(self, message: FramedMessage) -> str:
        """Send a message that is refused in silence, and return the reason."""
        before = len(self.refusals)
        assert self.tell(message) == []
        (why,) = self.refusals[before:]
        return why

    def to(self, milliseconds: float) -> None:
        """Advance to an instant."""
        self.clock.run_until(round(milliseconds * 1e6))

    def status(self) -> Any:
        """Return the present status message, as in an update."""
        message = PROTOCOL.message_class(STATUS[self._context["status"]])
        return message(chan_ident=1, **self.behaviour.status())

    def _hear(self, data: bytes) -> None:
        frame = PROTOCOL.decode(data, self._context)
        assert frame.dest == HOST
        assert frame.source == self.address
        self.said.append((self.clock.now, frame.message))
