"""One open controller: what is known of it, what moves on it, and the settings that it reported."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Final, Generic, Protocol, TypeAlias, TypeVar

from stagewire._codec.message import Message
from stagewire._devices.limits import Limits, check_measurable, limits_of
from stagewire._devices.motions import Motions
from stagewire._devices.options import SETTINGS, Choices
from stagewire._devices.scales import Scales, ToldValue
from stagewire._devices.tables import Action, Command
from stagewire._devices.unit import Alias, Facts, Setting, Told, Unit
from stagewire._devices.values import Values
from stagewire._framings.slots.protocol import CommandProtocol
from stagewire._sessions.options import Ends, SessionOptions

_log = logging.getLogger("stagewire")


Place: TypeAlias = tuple[int, int | None]
"""An address, or an axis, and a channel."""

Name: TypeAlias = int | str | tuple[int, int]
"""How a user names a place: channel or bay by number, axis by name, channel of a bay by both."""


_NO_LIMITS = Limits(None, {}, {})
"""Of what moves nothing, such as the motherboard of a rack."""


_PLAIN: Final = {"baudrate": 9600, "rtscts": False}
"""The link to a controller of commands: the slowest of its rates, and no handshake."""


class Transport(Protocol):
    """The session below, as far as no call of it waits."""

    now: Callable[[], float]

    def heard(self) -> list[tuple[int, Message]]:
        """Return the unsolicited messages since the last time, and who sent them."""


T = TypeVar("T", bound=Transport)


class Connection(Generic[T]):
    """What all parts of one device share; it outlives the link, which may be opened again.

    :param facts: of the protocol.
    :param unit: that the user named.
    :param url: of the line, for people.
    :param choices: of the user.
    :param places: the channels, bays or axes that a stage can stand on, and how the user names them.
    :param addresses: of everything that answers, the device itself first.

    Raises :class:`~stagewire.errors.UnknownScaleError` for a stated limit or tolerance that nothing can be
    compared with.
    """

    transport: T
    info: Values[Any] | None
    """What the controller says that it is; None where it was not asked."""
    broken_at: float | None = None
    """When the line before this one was lost, if it was; see :attr:`.Driver.broken_at`."""
    serial_number: int | None = None
    """That of the controller, since it was first asked for."""
    names: tuple[str, ...]
    """What the controller is, or may be where that is not certain: units and aliases, whose scales hold."""

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
        self._learning = threading.Lock()
        self._logs = 0
        self._silenced: dict[int, set[type[Message]]] = {}
        self._telling: dict[type[Message], list[tuple[Setting, Told]]] = {}
        for setting, told in facts.telling(unit):
            for cls in (told.set, told.get):
                if cls is not None:
                    self._telling.setdefault(cls, []).append((setting, told))
        self._limits = {
            place: limits_of(
                choices.stage_of(name), choices.travel_of(name), choices.ceilings_of(name)
            )
            for place, name in places.items()
        }
        self.forget()
        self._check_limits()

    def forget(self) -> None:
        """Forget what the controller said, before it is asked again on another line."""
        self.motions.leave()
        self.info = None
        unit, choices = self.unit, self.choices
        self.names = (choices.model or unit.name,)
        self._bare = Scales(
            unit.name,
            self.facts.quantities,
            ways=self._ways(),
            stages=unit.stages,
            names=self.names,
        )
        for setting, option in SETTINGS.items():
            value: Fraction | None = getattr(choices, option)
            if value is not None:
                self._bare = self._bare.told(
                    setting,
                    ToldValue(value, self.facts.settings[setting].unit, f"as {option} says"),
                )
        self._scales = {
            place: replace(self._bare, stage=choices.stage_of(name))
            for place, name in self.places.items()
        }

    def identified(self, names: tuple[str, ...]) -> None:
        """Use the scales of what the controller is, or may be.

        Raises :class:`~stagewire.errors.UnknownScaleError` where positions have none on it and a travel was
        given.
        """
        self.names = names
        self._bare = replace(self._bare, names=names)
        self._scales = {
            place: replace(scales, names=names) for place, scales in self._scales.items()
        }
        self._check_limits()

    @property
    def aliases(self) -> list[Alias]:
        """What the controller is, or may be, of what is newer than the document."""
        return [self.facts.aliases[name] for name in self.names if name in self.facts.aliases]

    def _check_limits(self) -> None:
        """Raise for a limit of the user that could be compared with nothing."""
        unit = self.unit
        has_status = unit.status_query is not None
        for place, limits in self._limits.items():
            limits.check_measurable(
                unit.name, unit.settable, self._scales[place], has_status=has_status
            )
        if self.choices.target_tolerance_mm is not None:
            check_measurable(
                "target_tolerance_mm", unit.name, unit.quantities, self._scales.values()
            )

    def warn_of_motions(self) -> None:
        """Log what may still move, since the line is lost and no stop can be sent."""
        if moving := self.motions.described():
            _log.warning(
                "%s: the line is lost and no stop was sent; may still be moving: %s",
                self.url,
                moving,
            )

    def last_words(self) -> bytes:
        """Return what is to be said before the line is closed, by a signal handler perhaps."""
        return self.motions.stops() * self.stops if self.choices.stop_on_close else b""

    @property
    def stops(self) -> int:
        """How many times a stop is sent, so that it gets through.

        A controller whose commands have no frame may hold half a command that a lost line cut off, and takes
        the bytes of the first stops for its rest. Three are longer than any command.
        """
        return 3 if self.unit.kind == "line" and self.broken_at is not None else 1

    def session_options(self) -> SessionOptions:
        """Return the times of a session as the user chose them, or as the unit needs them."""
        choices, pause = self.choices, self.unit.pause_ms
        pacing = choices.pacing
        if pacing is None:
            pacing = SessionOptions.pacing if pause is None else pause / 1000
        return SessionOptions(
            pacing=pacing, reply_timeout=choices.timeout, motion_timeout=choices.motion_timeout
        )

    def link_options(self) -> dict[str, Any]:
        """Return what the user chose of the link itself, or what suits the protocol."""
        chosen = {"baudrate": self.choices.baudrate, "rtscts": self.choices.rtscts}
        given = {name: value for name, value in chosen.items() if value is not None}
        return {**_PLAIN, **given} if isinstance(self.facts.protocol, CommandProtocol) else given

    def next_log(self) -> str | Path | None:
        """Return the file for the capture of a line; of a line that is opened again another one."""
        log = self.choices.log
        self._logs += 1
        if log is None or self._logs == 1:
            return log
        return Path(log).with_stem(f"{Path(log).stem}-{self._logs}")

    # Scales and limits

    def scales(self, place: Place) -> Scales:
        """Return the scales that hold now on one channel."""
        if self._telling:
            for source, message in self.transport.heard():
                self.learn(source, None, message)
        return self._scales.get(place, self._bare)

    def limits(self, place: Place) -> Limits:
        """Return the limits that can be checked now on one channel."""
        limits = self.stated_limits(place)
        return limits.now(self.scales(place))

    def stated_limits(self, place: Place) -> Limits:
        """Return the limits of the stage on one channel, whether or not they can be checked."""
        return self._limits.get(place, _NO_LIMITS)

    @property
    def telling(self) -> tuple[type[Message], ...]:
        """The messages to the host that tell a setting."""
        told = (told.get for tells in self._telling.values() for _, told in tells)
        return tuple({cls: None for cls in told if cls is not None})

    def learn(self, address: int, channel: int | None, message: Message) -> None:
        """Take in the settings that a message tells, whoever sent it."""
        for setting, told in self._telling.get(type(message), ()):
            raw = getattr(message, told.field)
            if told.values is not None:
                found = told.values.get(raw, str(raw))
                value = found if isinstance(found, str) else Fraction(found)
            else:
                assert told.scale is not None
                value = told.scale.from_counts(raw)
            field = self.channel_field(type(message))
            channel = getattr(message, field) if field else channel
            source = f"as {message.layout.message} says"
            now = ToldValue(value, setting.unit, source)
            with self._learning:
                for place, scales in self._scales.items():
                    if place[0] == address and channel in (None, place[1]):
                        self._scales[place] = scales.told(setting.name, now)

    def channel_field(self, cls: type[Message]) -> str | None:
        """Return the field of a message that names the channel, if it has one."""
        field: str | None = getattr(self.facts.protocol, "channel", None)
        return field if field in cls.layout.fields else None

    def _ways(self) -> dict[str, str]:
        """Return for each setting how a user makes it known."""
        ways: dict[str, str] = {}
        for setting, told in self.facts.telling(self.unit):
            option = SETTINGS.get(setting.name)
            asked = told.req or told.set
            parts = [f"give {option}= when you open it"] if option else []
            if asked is not None and asked.layout.message in self.unit.messages:
                parts.append(f"send {asked.layout.message}")
            if parts:
                ways[setting.name] = " or ".join(parts)
        for name, option in SETTINGS.items():
            ways.setdefault(name, f"give {option}= when you open it")
        return ways

    # What comes unasked

    def ends_of(self, action: Action) -> Ends | None:
        """Return the ends of an action that this unit's list has; None where it tells none."""
        if action.ends is None:
            return None
        completed, stopped = (
            tuple(cls for cls in classes if cls.layout.message in self.unit.messages)
            for classes in (action.ends.completed, action.ends.stopped)
        )
        return Ends(completed, stopped) if completed else None

    def sent(self, address: int, command: Command) -> None:
        """Note what a command that was sent keeps from coming, or lets come again."""
        silenced = self._silenced.setdefault(address, set())
        silenced.update(command.stops)
        silenced.difference_update(command.starts)

    def silenced(self, address: int, classes: Iterable[type[Message]]) -> bool:
        """Say whether one of these messages does not come now, because the user said so."""
        return not self._silenced.get(address, set()).isdisjoint(classes)

    # Values

    def values_of(self, message: Message, place: Place) -> Values[Any] | None:
        """Return the values of a message; None for one that carries none."""
        cls = self.facts.values_of(type(message))
        return None if cls is None else cls(message, self.scales(place))
