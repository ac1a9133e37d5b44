"""The state of one open controller: its identity, its motions, and the settings that it reported."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from time import time
from typing import Any, Final, Generic, Protocol, TypeVar

from stagewire._codec.message import Message
from stagewire._devices.limits import Limits, check_measurable, limits_of
from stagewire._devices.motions import Motions, Outputs
from stagewire._devices.options import SETTINGS, Choices, settable
from stagewire._devices.ratings import Rating
from stagewire._devices.readiness import Readiness
from stagewire._devices.scales import Scales, ToldValue
from stagewire._devices.stages import Name, Place, Stages
from stagewire._devices.stated_limits import TOLERANCES
from stagewire._devices.tables import Action, Command
from stagewire._devices.travel import Held
from stagewire._devices.unit import Alias, Facts, Setting, Told, Unit
from stagewire._devices.values import Arrival, Values
from stagewire._framings.slots.protocol import CommandProtocol
from stagewire._sessions.options import Ends, SessionOptions

_log = logging.getLogger("stagewire")


_NO_LIMITS = Limits(None, {}, {})
"""Limits of a part that moves nothing, such as the motherboard of a rack."""


_PLAIN: Final = {"baudrate": 9600, "rtscts": False}
"""Link options for controllers of commands: their lowest baud rate, and no handshake."""


class Transport(Protocol):
    """The part of a transport that never waits."""

    now: Callable[[], float]

    def heard(self) -> list[tuple[int, Message]]:
        """Return the unsolicited messages since the last call, with their source addresses."""


T = TypeVar("T", bound=Transport)
R = TypeVar("R", bound=Values[Any])


def link_options(protocol: object, **chosen: Any) -> dict[str, Any]:
    """Return the options of a link: those that are not None, or defaults for the protocol."""
    given = {name: value for name, value in chosen.items() if value is not None}
    return {**_PLAIN, **given} if isinstance(protocol, CommandProtocol) else given


class Connection(Generic[T]):
    """State that all parts of one device share; it outlives the link, which may be reopened.

    :param facts: data of the generated package.
    :param unit: unit that the user named.
    :param url: URL of the line, for messages.
    :param choices: options of the user.
    :param places: channels, bays or axes that can have a stage -> how the user names them.
    :param addresses: all addresses that answer, that of the device first.

    Raise :class:`~stagewire.errors.UnknownScaleError` for a limit or tolerance of the user that cannot be
    checked.
    """

    transport: T
    info: Values[Any] | None
    """The identity that the controller reported; None if it was not asked."""
    broken_at: float | None = None
    """When the previous line was lost, if it was; see :attr:`.Driver.broken_at`."""
    left_moving: tuple[str, ...] = ()
    """The motions that may continue after the line was closed."""
    aborted = False
    """Whether the line, if it ends now, ends without a normal close: after an exception, or by a signal."""
    serial_number: int | None = None
    """Serial number of the controller; None until it is read."""
    names: tuple[str, ...]
    """Units and aliases that the controller may be; they determine the scales."""

    def __init__(
        self,
        facts: Facts,
        unit: Unit,
        url: str,
        choices: Choices,
        places: dict[Place, Name],
        addresses: tuple[int, ...],
    ) -> None:
        self.facts = facts
        self.unit = unit
        self.url = url
        self.choices = choices
        self.places = places
        self.addresses = addresses
        self.motions = Motions()
        self.readiness = Readiness(unit)
        self.outputs = Outputs(unit, self.channel_field)
        self.contexts: dict[str, str] = {}  # those that select layouts, as far as they are known
        self._learning = threading.Lock()
        self._logs = 0
        self._silenced: dict[int, set[type[Message]]] = {}
        self._reporting: set[int] = set()  # addresses that have what they need to report ends
        self._updating: dict[tuple[int, type[Message]], bytes] = {}  # what ends the updates
        self.updates = facts.updates(unit)
        self._recorders: dict[int, set[object]] = {}  # by address, those that need the updates
        self._telling: dict[type[Message], list[tuple[Setting, Told]]] = {}
        for setting, told in facts.telling(unit):
            for cls in (told.set, told.get):
                if cls is not None:
                    self._telling.setdefault(cls, []).append((setting, told))
        self.rating = Rating(facts, unit, choices.max_volts)
        self.stages = Stages(facts.package, unit, choices, places)
        self.forget()
        self._check_limits()

    def forget(self) -> None:
        """Forget what the controller reported, before it is read again on another line."""
        self.motions.leave()
        self.readiness.forget()
        self.outputs.forget()
        self._reporting.clear()
        self._updating.clear()
        self._recorders.clear()
        self.info = None
        self._latest: dict[tuple[Place, type[Values[Any]]], Values[Any]] = {}
        self.stages.forget()
        unit, choices = self.unit, self.choices
        self.names = (choices.model or unit.name,)
        self._ends: dict[Place, dict[tuple[str, bool], dict[str, int]]] = {}
        self._bare = Scales(
            unit.name,
            self.facts.quantities,
            ways=self._ways(),
            writers=self.facts.writers_of_settings(unit),
            stages=unit.stages,
            names=self.names,
            source_of_scales=choices.scale_source,
        )
        for setting, option in SETTINGS.items():
            value: Fraction | None = getattr(choices, option)
            if value is not None:
                self._bare = self._bare.told(
                    setting,
                    ToldValue(value, self.facts.settings[setting].unit, f"set by {option}"),
                )
        for setting, value in choices.settings.items():
            given = ToldValue(value, self.facts.settings[setting].unit, "set by settings")
            self._bare = self._bare.told(setting, given)
        self._use_stages()

    def _use_stages(self) -> None:
        """Set the scales and limits of every place to those of its stage."""
        choices, found = self.choices, {place: self.stages.at(place) for place in self.places}
        self._scales = {place: replace(self._bare, stage=stage) for place, stage in found.items()}
        self._limits = {
            place: limits_of(found[place], choices.travel_of(name), choices.ceilings_of(name))
            for place, name in self.places.items()
        }

    def reported_stage(self, place: Place, id: int) -> None:
        """Store the stage that the controller reported at a place, which has its scales from now on.

        A stage that the user chose keeps its place.
        """
        self.stages.report(place, id, self.names)

    def stages_reported(self) -> None:
        """Use the stages that the controller reported; it reports no others until the line is reopened.

        Raise :class:`~stagewire.errors.UnknownScaleError` for a limit of the user that cannot be checked.
        """
        self.stages.are_known = True
        self._use_stages()
        self._check_limits()
        for warning in self.stages.contradictions():
            _log.warning("%s: %s", self.url, warning)

    def identified(self, names: tuple[str, ...]) -> None:
        """Use the scales of the units or aliases that the controller may be.

        Raise :class:`~stagewire.errors.UnknownScaleError` for a given travel if their positions have no
        scale.
        """
        self.names = names
        self._bare = replace(self._bare, names=names)
        self._scales = {
            place: replace(scales, names=names) for place, scales in self._scales.items()
        }
        self._check_limits()

    @property
    def aliases(self) -> list[Alias]:
        """The aliases, newer than the document, that the controller may be."""
        return [self.facts.aliases[name] for name in self.names if name in self.facts.aliases]

    def _check_limits(self) -> None:
        """Raise an error for a limit of the user that cannot be checked, once the stages are known."""
        if not self.stages.are_known:
            return
        unit = self.unit
        has_status = unit.status_query is not None
        for place, limits in self._limits.items():
            limits.check_measurable(
                unit.name, unit.settable, self._scales[place], has_status=has_status
            )
        for base in self.choices.target_tolerances:
            check_measurable(TOLERANCES, base, unit.name, unit.quantities, self._scales.values())

    def note_motions(self, *, lost: bool) -> None:
        """Note and log the motions that may continue after the line is closed.

        :param lost: whether the line is lost, so that no stop can be sent.
        """
        stopped = self.choices.stop_on_close and not lost
        self.left_moving = self.motions.names(stopped=stopped)
        if self.left_moving:
            why = "the line is lost" if lost else 'it was opened with on_close="leave"'
            if stopped:
                why = "the unit cannot stop"
            _log.warning(
                "%s: %s and no stop was sent; may still be %s: %s",
                self.url,
                why,
                "on" if self.unit.safe_state else "moving",
                ", ".join(self.left_moving),
            )

    def last_words(self) -> bytes:
        """Return the bytes to send before the line is closed; a signal handler may call this."""
        if not self.choices.stop_on_close:
            return self._farewell()
        off = self.outputs.off(self.places, self.facts.protocol)
        stops = self.motions.stops(without=off) * self.stops
        return b"".join(off) + stops + self._farewell()

    def _farewell(self) -> bytes:
        """Return the bytes that end the updates that were started here.

        If the session is aborted, also those that stop all updates, and that end the connection.
        """
        words = dict(self._updating)
        if self.aborted:
            for ending in self.unit.farewell:
                words.setdefault(
                    (self.addresses[0], ending), self._packed(ending, self.addresses[0])
                )
        last = {ending: index for index, ending in enumerate(self.unit.farewell)}
        return b"".join(words[key] for key in sorted(words, key=lambda key: last[key[1]]))

    def _packed(self, cls: type[Message], address: int) -> bytes:
        protocol: Any = self.facts.protocol
        message: Any = cls()
        packed: bytes = message.pack(address, protocol.host)
        return packed

    @property
    def stops(self) -> int:
        """How many times each stop is sent.

        A controller whose commands have no frame may still hold half a command from before the line was lost,
        and take the first stops for the rest of it. Three stops are longer than any command.
        """
        return 3 if self.unit.kind == "line" and self.broken_at is not None else 1

    def session_options(self) -> SessionOptions:
        """Return the times of a session: those of the user, or those that the unit requires."""
        choices, pause = self.choices, self.unit.pause_ms
        pacing = choices.pacing
        if pacing is None:
            pacing = SessionOptions.pacing if pause is None else pause / 1000
        return SessionOptions(
            pacing=pacing, reply_timeout=choices.timeout, motion_timeout=choices.motion_timeout
        )

    def link_options(self) -> dict[str, Any]:
        """Return the options of the link: those of the user, or defaults for the protocol."""
        return link_options(
            self.facts.protocol, baudrate=self.choices.baudrate, rtscts=self.choices.rtscts
        )

    def next_log(self) -> str | Path | None:
        """Return the file for the capture of a line; each reopened line has a new file."""
        log = self.choices.log
        self._logs += 1
        if log is None or self._logs == 1:
            return log
        return Path(log).with_stem(f"{Path(log).stem}-{self._logs}")

    # Scales and limits

    def scales(self, place: Place) -> Scales:
        """Return the current scales of one channel."""
        if self._telling:
            for source, message in self.transport.heard():
                self.learn(source, None, message)
        return self._scales.get(place, self._bare)

    def limits(self, place: Place) -> Limits:
        """Return the limits of one channel that can currently be checked."""
        scales = self.scales(place)  # it also learns
        return self.stated_limits(place).now(scales)

    def stated_limits(self, place: Place) -> Limits:
        """Return all limits of the stage on one channel, checked or not."""
        held = (
            Held.between(ends.values(), source, chosen=chosen)
            for (source, chosen), ends in self._ends.get(place, {}).items()
        )
        return self._limits.get(place, _NO_LIMITS).holding(one for one in held if one is not None)

    @property
    def telling(self) -> tuple[type[Message], ...]:
        """The messages to the host that report a setting."""
        told = (told.get for tells in self._telling.values() for _, told in tells)
        return tuple({cls: None for cls in told if cls is not None})

    def learn(self, address: int, channel: int | None, message: Message) -> None:
        """Store the settings and the state that a message reports or sets."""
        required = self.unit.reports_ends_after
        if required is not None and required.is_written_with(type(message)):
            self._reporting.add(address)
        self.outputs.learn(address, message)
        if self.readiness.needs(message):
            field = self.channel_field(type(message))
            number = getattr(message, field) if field else channel
            for place in self.places:
                if place[0] == address and number in (None, place[1]):
                    self.readiness.learn(place, message)
        for setting, told in self._telling.get(type(message), ()):
            raw = getattr(message, told.field)
            if setting.quantity:
                self._learn_end(address, channel, message, setting, told)
                continue
            if told.values is not None:
                found = told.values.get(raw, str(raw))
                value = found if isinstance(found, str) else Fraction(found)
            else:
                assert told.scale is not None
                value = told.scale.from_counts(raw)
            field = self.channel_field(type(message))
            channel = getattr(message, field) if field else channel
            source = f"from {message.layout.message}"
            now = ToldValue(value, setting.unit, source)
            with self._learning:
                for place, scales in self._scales.items():
                    if place[0] == address and channel in (None, place[1]):
                        self._scales[place] = scales.told(setting.name, now)

    def _learn_end(
        self, address: int, channel: int | None, message: Message, setting: Setting, told: Told
    ) -> None:
        """Store an end of the travel that the controller allows, or forget one that it no longer applies."""
        field = self.channel_field(type(message))
        channel = getattr(message, field) if field else channel
        reported = told.get or told.set
        assert reported is not None
        group = (f"from {reported.layout.message}", told.active is not None)
        with self._learning:
            for place in self.places:
                if place[0] != address or channel not in (None, place[1]):
                    continue
                ends = self._ends.setdefault(place, {}).setdefault(group, {})
                ends.pop(setting.name, None)
                if told.applies(message):
                    ends[setting.name] = getattr(message, told.field)

    def channel_field(self, cls: type[Message]) -> str | None:
        """Return the name of the field for the channel, if a message has one."""
        field: str | None = getattr(self.facts.protocol, "channel", None)
        return field if field in cls.layout.fields else None

    def _ways(self) -> dict[str, str]:
        """Return how a user can make each setting known."""
        ways: dict[str, str] = {}
        for setting, told in self.facts.telling(self.unit):
            asked = told.req or told.set
            if asked is not None and asked.layout.message in self.unit.messages:
                ways[setting.name] = f"send {asked.layout.message}"
        options = {name: f"{option}=" for name, option in SETTINGS.items()}
        options |= {name: f"settings={{{name!r}: …}}" for name in settable(self.facts, self.unit)}
        for name, option in options.items():
            sent = f" or {ways[name]}" if name in ways else ""
            ways[name] = f"pass {option} to open{sent}"
        return ways

    # Unsolicited messages

    def ends_of(self, action: Action) -> Ends | None:
        """Return the end messages of an action that this unit supports; None if it reports no end."""
        if action.ends is None:
            return None
        completed, stopped = (
            tuple(cls for cls in classes if cls.layout.message in self.unit.messages)
            for classes in (action.ends.completed, action.ends.stopped)
        )
        return Ends(completed, stopped) if completed else None

    @property
    def updating(self) -> tuple[tuple[int, type[Message]], ...]:
        """The addresses at which updates were started, each with the message that stops them."""
        return tuple(self._updating)

    def share_updates(self, address: int, recorder: object) -> bool:
        """Note that a recorder needs the updates from an address; return whether it must start them."""
        recorders = self._recorders.setdefault(address, set())
        on = self._are_on(address)
        if not on or recorders:  # otherwise the user has started them
            recorders.add(recorder)
        return not on

    def release_updates(self, address: int, recorder: object) -> bool:
        """Note that a recorder no longer needs the updates; return whether it must stop them."""
        recorders = self._recorders.get(address, set())
        if recorder not in recorders:
            return False
        recorders.remove(recorder)
        return not recorders and self._are_on(address)

    def _are_on(self, address: int) -> bool:
        return self.updates is not None and (address, self.updates.stop.message) in self._updating

    def reports_ends(self, address: int) -> bool:
        """Return whether a controller reports the ends of motions, as far as is known.

        Some units first require parameters on each connection (``Unit.reports_ends_after``).
        """
        return self.unit.reports_ends_after is None or address in self._reporting

    def sent(self, address: int, command: Command) -> None:
        """Record the messages that a sent command suspends or resumes, and the updates that it starts."""
        for ending, starters in self.unit.farewell.items():
            if command.message in starters:
                self._updating[address, ending] = self._packed(ending, address)
            elif command.message is ending:
                self._updating.pop((address, ending), None)
        silenced = self._silenced.setdefault(address, set())
        silenced.update(command.stops)
        silenced.difference_update(command.starts)

    def silenced(self, address: int, classes: Iterable[type[Message]]) -> bool:
        """Return whether the user has suspended one of these messages."""
        return not self._silenced.get(address, set()).isdisjoint(classes)

    # Values

    def values_of(
        self, message: Message, place: Place, received: float | None = None
    ) -> Values[Any] | None:
        """Return the values of a message; None if it has none.

        :param received: when it was received, in the time of the session; None: now.
        """
        cls = self.facts.values_of(type(message))
        if cls is None:
            return None
        if received is not None:
            return self.report(cls, message, place, received)
        return cls(message, self.scales(place), self.arrival())

    def report(
        self, cls: type[R], message: Message, place: Place, received: float | None = None
    ) -> R:
        """Return the values of a message from the controller, and remember them as the latest.

        :param received: as for :meth:`values_of`.
        """
        values = cls(message, self.scales(place), self.arrival(received))
        self._latest[place, cls] = values
        return values

    def outdate(self, cls: type[Values[Any]], place: Place) -> None:
        """Forget the latest values of a class, because others were written."""
        self._latest.pop((place, cls), None)

    def latest(self) -> list[tuple[Place, Values[Any]]]:
        """Return the latest values of each class with the place that reported them, the newest first."""
        found = [(place, values) for (place, _), values in tuple(self._latest.items())]
        return sorted(found, key=lambda one: -one[1].received)

    def arrival(self, received: float | None = None) -> Arrival:
        """Return the arrival of a message, which is now unless the session read it earlier.

        :param received: when it was read, in the time of the session.
        """
        now: float = self.transport.now()
        if received is None:
            return now, time()
        return received, time() - (now - received)
