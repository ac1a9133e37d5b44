"""The tables of generated calls: messages, arguments, and the end of a motion.

They contain classes of messages and names of fields, but no state of a controller. Classes for threads and
for asyncio share them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from dataclasses import field as field_of
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeAlias, TypeVar

from stagewire._codec.flags import Enumeration, Flags
from stagewire._codec.message import Message
from stagewire._devices.values import Values
from stagewire._sessions.options import Ends

__all__ = [
    "Action",
    "Command",
    "Ends",
    "Given",
    "MotionEnd",
    "Named",
    "Order",
    "ParameterSet",
    "Poll",
    "Query",
    "Reported",
    "Stored",
    "Target",
]

V = TypeVar("V", bound=Values[Any])
if TYPE_CHECKING:  # type checkers know this module; Python has defaults from 3.13 on
    from typing_extensions import TypeVar as TypeVarWithDefault

    Reported = TypeVarWithDefault(
        "Reported", bound=Values[Any] | None, covariant=True, default=Values[Any] | None
    )
else:
    Reported = TypeVar("Reported", covariant=True)
"""Values that a unit reports at the end of a motion."""

Target: TypeAlias = Literal["absolute", "relative"]
Named: TypeAlias = type[Enumeration] | type[Flags]


@dataclass(frozen=True, slots=True)
class Given:
    """One argument of a call, in counts or in units.

    :param field: field of the message.
    :param keyword: keyword for the raw value.
    :param quantity: quantity that it measures; empty if it has no unit.
    :param ways: keywords for values in units: keyword, unit, and the case if the unit depends on a setting.
    :param minimum: minimum of the raw value; None if it is not a number.
    :param maximum: maximum of the raw value.
    :param default: raw value in messages that the library itself sends, such as the stop of a motion.
    :param target: whether it is a position (``absolute``) or a distance (``relative``), limited by the
        travel.
    :param choices: class with the names of its values or bits; None if they have no names.
    :param modifiers: mask of the values of an enumeration that can be combined with another value.
    :param open: whether the list of choices may be incomplete; then every number in the range is accepted.
    :param ranges: controller -> its minimum and maximum, if they differ from those of others.
    :param names: controller -> its class with the names of the values, and whether that list may be open.
    :param real: size of a real number in bytes, whose minimum and maximum are bit patterns; 0 for any other
        value.
    """

    field: str
    keyword: str
    quantity: str = ""
    ways: tuple[tuple[str, str, str | None], ...] = ()
    minimum: int | None = None
    maximum: int | None = None
    default: int | None = None
    target: Target | None = None
    choices: Named | None = None
    modifiers: int = 0
    open: bool = False
    ranges: Mapping[str, tuple[int, int]] = field_of(default_factory=dict)
    names: Mapping[str, tuple[Named, bool]] = field_of(default_factory=dict)
    real: int = 0

    def on(self, controllers: tuple[str, ...]) -> Given:
        """Return the argument with the range and the names that all of these controllers accept.

        Without names that all of them have, only numbers are accepted.
        """
        named = self._named(controllers) if self.names else self
        if not self.ranges or self.minimum is None or self.maximum is None:
            return named
        own = self.minimum, self.maximum
        lows, highs = zip(*(self.ranges.get(name, own) for name in controllers), strict=True)
        return replace(named, minimum=max(lows), maximum=min(highs), ranges={})

    def _named(self, controllers: tuple[str, ...]) -> Given:
        own = self.choices, self.open
        found = {self.names.get(name, own) for name in controllers}
        choices, is_open = found.pop() if len(found) == 1 else (None, True)
        return replace(self, choices=choices, open=is_open, names={})

    @property
    def keywords(self) -> tuple[str, ...]:
        """All keywords for the value; a call uses exactly one."""
        return self.keyword, *(keyword for keyword, _, _ in self.ways)


@dataclass(frozen=True, slots=True)
class ParameterSet(Generic[V]):
    """A set of parameters, written with one message and read with two.

    :param name: name as in the names of its methods.
    :param values: class of the values that are read.
    :param set: message that writes them; None if they cannot be written.
    :param req: message that requests them; None if they cannot be read.
    :param get: message with the reply.
    :param given: arguments for writing.
    :param asked: arguments of the request, in addition to the channel.
    :param others: replies of other lengths, each with the message that writes the set in that length.
    :param motherboard: whether its messages always go to the motherboard of the rack.
    :param forms: messages of other lengths that write the set, each with the contexts that require it.
    :param effect: effect of writing it: ``settings``, a lasting value; ``tuning``, a control loop or the
        drive of a motor; ``motion``, something moves, opens or changes its output; ``counter``, the zero of a
        count that each motion changes.
    """

    name: str
    values: type[V]
    set: type[Message] | None
    req: type[Message] | None
    get: type[Message] | None
    given: tuple[Given, ...] = ()
    asked: tuple[Given, ...] = ()
    others: tuple[tuple[type[Message], type[Message] | None], ...] = ()
    motherboard: bool = False
    forms: tuple[tuple[type[Message], Mapping[str, str]], ...] = ()
    effect: str = "settings"

    def written_in(self, contexts: Mapping[str, str]) -> type[Message] | None:
        """Return the message that writes the set on a controller with these contexts."""
        for message, wanted in self.forms:
            if wanted.items() <= contexts.items():
                return message
        return self.set

    def is_written_with(self, cls: type[Message]) -> bool:
        """Return whether a message of this class writes the set, in any length."""
        written = (self.set, *(form for form, _ in self.forms), *(set for _, set in self.others))
        return cls in written

    def written_with(self, read: Message) -> type[Message] | None:
        """Return the message that writes the set in the length in which a controller reported it."""
        return dict(self.others).get(type(read), self.set)


@dataclass(frozen=True, slots=True)
class Query(Generic[V]):
    """A request and its possible replies; the parameters are as in :class:`ParameterSet`."""

    name: str
    values: type[V]
    req: type[Message]
    gets: tuple[type[Message], ...]
    asked: tuple[Given, ...] = ()
    motherboard: bool = False


@dataclass(frozen=True, slots=True)
class Command:
    """A message without a reply.

    :param halted_by: action that stops the motion that it starts; None if it starts no motion.
    :param or_halted_by: further such actions; a unit gets the last one that it has.
    :param stops: messages that the controller no longer sends afterwards.
    :param starts: messages that the controller sends again afterwards.
    :param motherboard: as in :class:`ParameterSet`.
    """

    name: str
    message: type[Message]
    given: tuple[Given, ...] = ()
    halted_by: Action | None = None
    or_halted_by: tuple[Action, ...] = ()
    stops: tuple[type[Message], ...] = ()
    starts: tuple[type[Message], ...] = ()
    motherboard: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Order:
    """A message that brings the outputs of a unit into a state, such as off.

    :param message: class of the message.
    :param values: values of its fields, except the channel.
    :param kept: fields that keep the values that the controller reports.
    :param read: parameter set that reads them; None if there are none.
    """

    message: type[Message]
    values: Mapping[str, int] = field_of(default_factory=dict)
    kept: tuple[str, ...] = ()
    read: ParameterSet[Any] | None = None


@dataclass(frozen=True, slots=True)
class Poll:
    """A request for polling, if no message reports the end of a motion.

    :param read: message that is sent.
    :param reply: message with the reply.
    :param field: field of the reply.
    :param value: value of the field when nothing moves.
    """

    read: type[Message]
    reply: type[Message]
    field: str
    value: int


@dataclass(frozen=True, slots=True)
class Stored:
    """A distance or target that is stored in the controller, for messages that contain none.

    :param table: table that reads it.
    :param field: field of the reply.
    :param when: another field of the reply, and its value while the stored target is in use; None: always.
    """

    table: ParameterSet[Any] | Query[Any]
    field: str
    when: tuple[str, int] | None = None


@dataclass(frozen=True, slots=True)
class Action:
    """A message that starts a motion, or stops one.

    :param ends: messages that report its end; None if it is polled for.
    :param poll: request for polling, if no message reports its end.
    :param halted_by: action that stops it; None for a stop.
    :param or_halted_by: as in :class:`Command`.
    :param target: whether its target is a position or a distance; None if it has no target.
    :param stored: where its target is stored, if the message contains none.
    :param motherboard: as in :class:`ParameterSet`.
    """

    name: str
    message: type[Message]
    given: tuple[Given, ...] = ()
    ends: Ends | None = None
    poll: Poll | None = None
    halted_by: Action | None = None
    or_halted_by: tuple[Action, ...] = ()
    target: Target | None = None
    stored: Stored | None = None
    motherboard: bool = False


@dataclass(frozen=True, slots=True, repr=False)
class MotionEnd(Generic[Reported]):
    """How a motion ended.

    :param message: message that reported the end; None if there was none.
    :param values: its values in engineering units; if it has no position and the motion had a target, those
        of the status that was read instead. None if neither has values, as after homing. Type checkers
        know the class for each unit, and that a motion to a target has values.
    :param seconds: seconds from the command to the end.
    """

    message: Message | None
    values: Reported
    seconds: float

    def __repr__(self) -> str:
        shown = "no values" if self.values is None else repr(self.values).strip("<>")
        return f"<MotionEnd after {self.seconds:.3g} s: {shown}>"
