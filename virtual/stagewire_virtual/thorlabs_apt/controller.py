"""One controller at its address: a motherboard, a card in a bay, or a unit of its own.

Status updates go out from the start to the stop, at the unit's own rate.
"""

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
    """Says the status of a controller again and again.

    :param clock: the time.
    :param say: says the status once, to who sent the frame that it is given.
    """

    def __init__(self, clock: Clock, say: Callable[[Frame], None]) -> None:
        self._clock = clock
        self._say = say
        self._timer: Timer | None = None

    def start(self, cause: Frame, period: int) -> None:
        """Say the status to who sent ``cause``, once a period from now on, in nanoseconds.

        When it is being said already, the beat goes on.
        """
        self._cause = cause
        self._period = period
        if self._timer is None:
            self._timer = self._clock.call_later(self._period, self._tick)

    def stop(self) -> None:
        """Say nothing more; harmless when nothing is said."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _tick(self) -> None:
        self._timer = self._clock.call_later(self._period, self._tick)
        self._say(self._cause)


IDENTIFYING: Final = 5 * SECOND
"""How long the front panel flashes after MOD_IDENTIFY; the document does not say."""


class Controller:
    """Answers what comes to one address, by the registry and by the behaviours of its channels.

    :param unit: what the registry says of it.
    :param clock: the time.
    :param options: what the user told of the instrument.
    :param information: what it says of itself.
    :param channels: those that it has, with their behaviours; none for a motherboard.
    :param panels: what else answers at its address.
    :param transmit: takes the bytes of a frame.
    :param disconnect: ends the conversation of the whole instrument.
    :param refused: hears why something was not done.
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
        self._no_status = {}  # what the status is of a channel that does nothing
        if self._status is not None:
            said = set(self._status.layout.fields) - set(self._status.layout.optional)
            self._no_status = dict.fromkeys(sorted(said), 0)
        rate = unit.facts.get("update_rate_hz")
        self._period = SECOND // rate if rate else None  # its own; None for that of the message
        self._updates = Updates(clock, self._send_status)
        self._flashes_until = 0
        for channel in self.channels:
            channel.send = self.send
            channel.report_fault = self.refuse
        self._handlers = dict(self._find_handlers(panels))

    # What comes

    def receive(self, frame: Frame) -> None:
        """Take a frame that has come to this address."""
        name = frame.message.layout.message
        handler = self._handlers.get(name)
        if handler is None:
            self.refuse(frame, f"it takes no {name}")
        else:
            handler(frame)

    def _find_handlers(self, panels: Sequence[Panel]) -> Iterator[tuple[str, Handler]]:
        """Yield what takes each message, for the messages that this controller takes."""
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
            if facts.to_controller and (self.channels or facts.of_the_unit):
                handler = own.get(name) or self._by_the_registry(facts)
                if handler is not None:
                    yield name, handler

    def _by_the_registry(self, facts: Message) -> Handler | None:
        """Return what takes a message by its place in the registry; None for one that is not ours."""
        if any(channel.behaviour.method("handles", facts.name) for channel in self.channels):
            return functools.partial(self._dispatch, facts)
        if facts.of_the_unit and facts.role:
            return None  # a message of racks or hubs, which another address answers
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
        """Let the controller send, or keep it from sending, what the registry says."""
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

    # What goes out

    def send(self, message: FramedMessage, cause: Frame) -> None:
        """Say something that a frame of the host caused, if it may be said."""
        self._transmitter.send(message, cause)

    def refuse(self, cause: Frame, why: str) -> None:
        """Do nothing of what a frame of the host wants, and answer HW_RESPONSE if that was asked for."""
        self.refuse_from(cause.source, cause.dest, why)

    def refuse_from(self, host: int, address: int, why: str) -> None:
        """Do nothing of what came from ``host`` to ``address``, whatever it was."""
        self._refused(f"{self.unit.name} at {address:#04x}: {why}")
        if self._answers_unsupported:
            self._transmitter.respond(host, address)

    def _status_class(self) -> type[FramedMessage] | None:
        """Return the status message that comes again and again; None for a unit without channels."""
        periodic = [facts.starts for facts in self._facts.values() if facts.period]
        names = frozenset().union(*periodic) & self._facts.keys() if self.channels else ()
        return class_of(self.unit, min(names)) if names else None

    def _answer_status(self, frame: Frame) -> None:
        for channel in addressed(self.channels, frame, self):
            self._send_status_of(channel, frame)

    def _send_status(self, cause: Frame) -> None:
        if not self._transmitter.withholds_updates:
            for channel in self.channels:
                self._send_status_of(channel, cause)

    def _send_status_of(self, channel: Channel, cause: Frame) -> None:
        if self._status is not None:
            status = {**self._no_status, **channel.behaviour.status(), CHANNEL: channel.ident}
            self.send(self._status(**status), cause)

    # As a thing on the bench

    def stop_updates(self) -> None:
        """Say nothing unasked until the host starts the updates again."""
        self._updates.stop()

    def power_cycle(self) -> None:
        """Forget all but what is in the EEPROM and where the stages stand."""
        self._updates.stop()
        self._transmitter.reset()
        self._flashes_until = 0
        for channel in self.channels:
            channel.restore()
            channel.behaviour.power_on()  # before that, what is disabled would say that it stops
            obey_enable_state(channel)

    def rows(self, where: str) -> Iterator[Row]:
        """Yield what the live table shows; ``where`` is put before the names of the channels."""
        flashes = ["identifying"] if self._clock.now < self._flashes_until else []
        for channel in self.channels:
            position, state = channel.behaviour.row()
            states = [state] if state else []
            yield Row(f"{where}channel {channel.ident}", position, ", ".join(states + flashes))
        if not self.channels:
            yield Row(where, "", ", ".join(flashes))
