"""The tables that generated calls are made of: which messages a call sends, what it takes, what ends it.

They hold classes of messages and names of fields, and nothing that belongs to one controller, so that
the classes for threads and those for asyncio share them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeAlias, TypeVar

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
    "ParameterSet",
    "Poll",
    "Query",
    "Stored",
    "Target",
]

V = TypeVar("V", bound=Values[Any])

Target: TypeAlias = Literal["absolute", "relative"]
Named: TypeAlias = type[Enumeration] | type[Flags]


@dataclass(frozen=True, slots=True)
class Given:
    """One value that a caller gives, in counts or in units.

    :param field: of the message.
    :param keyword: by which the raw value is given.
    :param quantity: what it measures; empty where it has no unit.
    :param ways: the keywords by which it is given in units: keyword, unit, and the case of the setting that
        decides on the unit, if one does.
    :param minimum: of the raw value; None where it is no number.
    :param maximum: of the raw value.
    :param default: the raw value that the library itself sends, such as in the stop of what it started.
    :param target: whether it is a place (``absolute``) or a distance (``relative``) that the travel limits.
    :param choices: the class that names its values or bits; None where they have no names.
    :param modifiers: the values of an enumeration that are added to one of the others, as a mask.
    :param open: whether the list of choices may be incomplete, so that every number in the range is accepted.
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

    @property
    def keywords(self) -> tuple[str, ...]:
        """All keywords by which it can be given; exactly one is used."""
        return self.keyword, *(keyword for keyword, _, _ in self.ways)


@dataclass(frozen=True, slots=True)
class ParameterSet(Generic[V]):
    """A set of parameters: written by one message, read by two.

    :param name: as in the names of its methods.
    :param values: what is read.
    :param set: writes all of them; None where nothing does.
    :param req: asks for them; None where nothing does.
    :param get: answers.
    :param given: the values that a caller gives to write them.
    :param asked: the values that a request takes beside the channel.
    :param motherboard: whether it goes to the motherboard of the rack, whoever is asked for it.
    """

    name: str
    values: type[V]
    set: type[Message] | None
    req: type[Message] | None
    get: type[Message] | None
    given: tuple[Given, ...] = ()
    asked: tuple[Given, ...] = ()
    motherboard: bool = False


@dataclass(frozen=True, slots=True)
class Query(Generic[V]):
    """A question, and the messages that answer it; parameters as in :class:`ParameterSet`."""

    name: str
    values: type[V]
    req: type[Message]
    gets: tuple[type[Message], ...]
    asked: tuple[Given, ...] = ()
    motherboard: bool = False


@dataclass(frozen=True, slots=True)
class Command:
    """A message that nothing answers.

    :param halted_by: what ends that which it starts; None where it starts nothing that goes on.
    :param stops: the messages that the controller does not send any more after it.
    :param starts: the messages that it sends again after it.
    :param motherboard: as in :class:`ParameterSet`.
    """

    name: str
    message: type[Message]
    given: tuple[Given, ...] = ()
    halted_by: Action | None = None
    stops: tuple[type[Message], ...] = ()
    starts: tuple[type[Message], ...] = ()
    motherboard: bool = False


@dataclass(frozen=True, slots=True)
class Poll:
    """A question by which the end of a motion is seen, where nothing tells it.

    :param read: asks.
    :param reply: answers.
    :param field: of the answer.
    :param value: that it has when nothing moves.
    """

    read: type[Message]
    reply: type[Message]
    field: str
    value: int


@dataclass(frozen=True, slots=True)
class Stored:
    """Where a controller has stored how far, or where to, a message without a target of its own moves.

    :param table: asks for it.
    :param field: of the answer.
    :param when: another field of the answer and the value that it has while the target is used; None: it
        always is.
    """

    table: ParameterSet[Any] | Query[Any]
    field: str
    when: tuple[str, int] | None = None


@dataclass(frozen=True, slots=True)
class Action:
    """A message that starts a motion, or stops one.

    :param ends: the messages that come at its end; None where it is polled for.
    :param poll: how its end is seen where no message tells it.
    :param halted_by: what stops it; None of what is itself a stop.
    :param target: whether the value given is a place or a distance; None for neither.
    :param stored: what holds where it goes, for what carries no target of its own.
    :param motherboard: as in :class:`ParameterSet`.
    """

    name: str
    message: type[Message]
    given: tuple[Given, ...] = ()
    ends: Ends | None = None
    poll: Poll | None = None
    halted_by: Action | None = None
    target: Target | None = None
    stored: Stored | None = None
    motherboard: bool = False


@dataclass(frozen=True, slots=True)
class MotionEnd:
    """How a motion ended.

    :param message: what the controller said at its end; None where it says nothing.
    :param values: the same, in engineering units; where it carries no position and the motion had a target,
        the status that was asked for instead. None where neither carries values.
    :param seconds: from the command to its end.
    """

    message: Message | None
    values: Values[Any] | None
    seconds: float
