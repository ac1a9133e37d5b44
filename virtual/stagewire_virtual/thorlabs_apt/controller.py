"""One controller at its address: a motherboard, a card in a bay, or a stand-alone unit."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from typing import Final

from stagewire import Frame, FramedMessage
from stagewire_apt import messages as m
from stagewire_apt.enumerations import HubBay
from stagewire_virtual.clock import SECOND, Clock, Timer
from stagewire_virtual.instrument import Row, Unit
from stagewire_virtual.options import LinkKind, Options
from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.facts import CHANNEL, Message, class_of, facts_of
from stagewire_virtual.thorlabs_apt.parameters import (
    SAVING,
    Parameters,
    addressed,
    obey_enable_state,
)
from stagewire_virtual.thorlabs_apt.transmitter import Handler, Panel, Transmitter


class Updates:
    """Sends the status of a controller periodically.

    :param clock: the clock.
    :param say: sends the status once, to the sender of a frame.
    """

    def __init__(self, clock: Clock, say: Callable[[Frame], None]) -> None:
        self._clock = clock
        self._say = say
        self._timer: Timer | None = None

    def start(self, cause: Frame, period: int) -> None:
        """Send the status to the sender of ``cause`` every ``period`` nanoseconds.

        If updates are already running, their timing does not change.
        """
        self._cause = cause
        self._period = period
        if self._timer is None:
            self._timer = self._clock.call_later(self._period, self._tick)

    def stop(self) -> None:
        """Stop the updates, if they are running."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _tick(self) -> None:
        self._timer = self._clock.call_later(self._period, self._tick)
        self._say(self._cause)


IDENTIFYING: Final = 5 * SECOND
"""How long the front panel flashes after MOD_IDENTIFY; the document does not specify it."""


class Controller:
    """Answers the messages to one address, from the registry and the behaviours of its channels.

    :param unit: its unit in the registry.
    :param clock: the clock.
    :param options: the options of the instrument.
    :param information: its hardware information.
    :param channels: its channels with their behaviours; none for a motherboard.
    :param panels: the other parts that answer at its address.
    :param transmit: sends the bytes of a frame.
    :param disconnect: silences the whole instrument.
    :param refused: called with the reason for each refusal.
    """

    def __init__(
        self,
        unit: Unit,
        clock: Clock,
        options: Options,
        *,
        information: m.HwGetInfo,
        channels: Sequence[Channel],
        panels: Sequence[Panel],
        transmit: Callable[[bytes], None],
        disconnect: Callable[[], None],
        refused: Callable[[str], None],
    ) -> None:
        self.unit = unit
        self.channels = tuple(channels)
        self._clock = clock
        self._answers_unsupported = options.answer_unsupported
        self._information = information
        self._disconnect = disconnect
        self._refused = refused
        self._facts = facts_of(unit)
        self._keep_alive = unit.facts.get("keep_alive", "none")
        wants_signs = options.line is LinkKind.USB and self._keep_alive != "none"
        self._transmitter = Transmitter(unit, wants_signs, options.quirks, transmit)
        self._parameters = Parameters(unit, self.channels, self)
        self._status = self._status_class()
        self._no_status = {}  # the status of a channel without a behaviour
        if self._status is not None:
            said = set(self._status.layout.fields) - set(self._status.layout.optional)
            self._no_status = dict.fromkeys(sorted(said), 0)
        self._names_channel = CHANNEL in self._no_status
        rate = unit.facts.get("update_rate_hz")
        self._period = SECOND // rate if rate else None  # None: the period of the message
        self._updates = Updates(clock, self._send_status)
        self._flashes_until = 0
        for channel in self.channels:
            channel.send = self.send
            channel.report_fault = self.refuse
        self._handlers = dict(self._find_handlers(panels))

    # Messages from the host

    def receive(self, frame: Frame) -> None:
        """Handle a frame to this address."""
        name = frame.message.layout.message
        handler = self._handlers.get(name)
        if handler is None:
            self.refuse(frame, f"it does not accept {name}")
        else:
            handler(frame)

    def _find_handlers(self, panels: Sequence[Panel]) -> Iterator[tuple[str, Handler]]:
        """Yield the messages that this controller accepts with their handlers."""
        own: dict[str, Handler] = {
            "HW_REQ_INFO": functools.partial(self.send, self._information),
            "HW_DISCONNECT": lambda frame: self._disconnect(),
            "MOD_IDENTIFY": self._identify,
            "HUB_REQ_BAYUSED": functools.partial(self.send, m.HubGetBayUsed(HubBay.STANDALONE)),
            self._keep_alive: lambda frame: self._transmitter.keep_alive(),
            **dict.fromkeys(SAVING, self._parameters.save),
        }
        for panel in panels:
            own.update(panel.handlers(self))
        for name, facts in self._facts.items():
            of_all = facts.of_the_unit or facts.addressee == "every"
            if facts.to_controller and (self.channels or of_all):
                handler = own.get(name) or self._by_the_registry(facts)
                if handler is not None:
                    yield name, handler

    def _by_the_registry(self, facts: Message) -> Handler | None:
        """Return the handler of a message according to the registry; None if another address answers it."""
        if any(channel.behaviour.method("handles", facts.name) for channel in self.channels):
            return functools.partial(self._dispatch, facts)
        if facts.role and facts.of_the_unit and (facts.addressee or not self.channels):
            return None  # a message of racks, which another address answers
        if facts.role == "set":
            return functools.partial(self._parameters.store, facts)
        if facts.role == "req":
            return functools.partial(self._parameters.answer, facts)
        if self._status is not None and self._status.layout.message in facts.answered_by:
            return self._answer_status
        return functools.partial(self._start_and_stop, facts)

    def _dispatch(self, facts: Message, frame: Frame) -> None:
        for channel in addressed(self.channels, frame, self):
            if handle := channel.behaviour.method("handles", facts.name):
                handle(frame)

    def _start_and_stop(self, facts: Message, frame: Frame) -> None:
        """Start and stop the messages that the registry assigns to a message."""
        self._transmitter.unmute(facts.starts)
        self._transmitter.mute(
            {name for name in facts.stops if self._is_muted_by(name, facts.name)}
        )
        if self._status is None or not self.channels:
            return
        status = self._status.layout.message
        if facts.period and status in facts.starts:
            self._updates.start(frame, self._period or facts.period)
        elif status in facts.stops:
            self._updates.stop()

    def _is_muted_by(self, name: str, by: str) -> bool:
        return name in self._facts and by in self._facts[name].muted_by

    def _identify(self, frame: Frame) -> None:
        self._flashes_until = self._clock.now + IDENTIFYING

    # Messages to the host

    def send(self, message: FramedMessage, cause: Frame) -> None:
        """Send a message that a frame of the host caused, unless it is withheld or muted."""
        self._transmitter.send(message, cause)

    def refuse(self, cause: Frame, why: str) -> None:
        """Refuse a frame of the host, with HW_RESPONSE if that option is set."""
        self.refuse_from(cause.source, cause.dest, why)

    def refuse_from(self, host: int, address: int, why: str) -> None:
        """Refuse a message from ``host`` to ``address``."""
        self._refused(f"{self.unit.name} at {address:#04x}: {why}")
        if self._answers_unsupported:
            self._transmitter.respond(host, address)

    def _status_class(self) -> type[FramedMessage] | None:
        """Return the class of the periodic status message; None for a unit without channels."""
        periodic = [facts.starts for facts in self._facts.values() if facts.period]
        names = frozenset().union(*periodic) & self._facts.keys() if self.channels else frozenset()
        requested = {name for facts in self._facts.values() for name in facts.answered_by}
        # An inertial cube also has the status of a stepper, but no message that requests it (page 28).
        return class_of(self.unit, min(names & requested or names)) if names else None

    def _answer_status(self, frame: Frame) -> None:
        if self._is_common:
            self._send_common_status(frame)
            return
        for channel in addressed(self.channels, frame, self):
            self._send_status_of(channel, frame)

    def _send_status(self, cause: Frame) -> None:
        if self._transmitter.withholds_updates:
            return
        if self._is_common:
            self._send_common_status(cause)
            return
        for channel in self.channels if self._names_channel else self.channels[:1]:
            self._send_status_of(channel, cause)

    @property
    def _is_common(self) -> bool:
        """Whether one status message has numbered fields for all channels."""
        return self._status is not None and f"{CHANNEL}_1" in self._status.layout.fields

    def _send_common_status(self, cause: Frame) -> None:
        status = dict(self._no_status)
        for number, channel in enumerate(self.channels, 1):
            values = {**channel.behaviour.status(), CHANNEL: channel.ident}
            status.update({f"{name}_{number}": value for name, value in values.items()})
        if self._status is not None:
            self.send(self._status(**status), cause)

    def _send_status_of(self, channel: Channel, cause: Frame) -> None:
        if self._status is not None:
            status = {**self._no_status, **channel.behaviour.status()}
            if self._names_channel:
                status[CHANNEL] = channel.ident
            self.send(self._status(**status), cause)

    # Outside the line

    def stop_updates(self) -> None:
        """Stop the updates until the host starts them again."""
        self._updates.stop()

    def power_cycle(self) -> None:
        """Switch off and on. Only the EEPROM and the positions of the stages are kept."""
        self._updates.stop()
        self._transmitter.reset()
        self._flashes_until = 0
        for channel in self.channels:
            channel.restore()
            channel.behaviour.power_on()  # must come first: disabling a moving motor reports a stop
            obey_enable_state(channel)

    def rows(self, where: str) -> Iterator[Row]:
        """Yield the rows of the live table; ``where`` is a prefix for the names of the channels."""
        flashes = ["identifying"] if self._clock.now < self._flashes_until else []
        for number, channel in enumerate(self.channels, 1):
            position, state = channel.behaviour.row()
            states = [state] if state else []
            yield Row(f"{where}channel {number}", position, ", ".join(states + flashes))
        if not self.channels:
            yield Row(where, "", ", ".join(flashes))
