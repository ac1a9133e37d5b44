"""Defects of firmware: their behaviour, the units that can have them, and the checks that must find them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from random import Random

from firmware_bench import BENCHES, Bench
from firmware_frames import HOST, ID, Frame, entry
from firmware_line import Firmware

from stagewire_conformance.device.results import Result
from stagewire_conformance.device.targets import Target

Change = Callable[[Frame], Iterable[Frame | bytes]]
"""Changes a message to none, one or several messages."""


_OF_ISSUE_3 = [
    name
    for name, each in BENCHES.items()
    if each.declared.issue == "3" and not name.endswith("2000")
]
"""The benches of APT units that can have a defect. The defects change messages of Issue 3."""


class NotHereError(Exception):
    """The unit cannot have this defect."""


@dataclass(frozen=True)
class Defect:
    """A defect of firmware.

    :param seed: selects the unit and the message, so that a new name changes neither.
    :param name: as in a bug report.
    :param found_by: kinds of checks, one of which must find it.
    :param make: makes the firmware for a unit; returns it with the message that the check must name; empty
        for any message.
    :param units: the benches that can have it; empty for all.
    :param result: its severity.
    :param ends: why the run ends early because of it; empty for a run to the end.
    """

    seed: int
    name: str
    found_by: frozenset[str]
    make: Callable[[Draw], tuple[Firmware, str]]
    units: Sequence[str] = ()
    result: Result = Result.FAIL
    ends: str = ""

    def draw(self, number: int) -> Drawn:
        """Return the defect on a unit and in a message, selected by its seed and the number of the draw."""
        random = Random(f"{self.seed}/{number}")
        names = list(self.units or _OF_ISSUE_3)
        random.shuffle(names)
        for name in names:
            try:
                firmware, about = self.make(Draw(BENCHES[name], random))
            except NotHereError:
                continue
            return Drawn(self, name, firmware, about)
        raise AssertionError(f"no unit can have the defect: {self.name}")


@dataclass(frozen=True)
class Drawn:
    """A defect on a unit.

    :param firmware: for one run.
    :param about: the message that the check must name; empty for any.
    """

    defect: Defect
    unit: str
    firmware: Firmware
    about: str


@dataclass(frozen=True)
class Asked:
    """A request to a channel or to a whole place."""

    place: Target
    channel: int | None
    request: str
    answer: str

    def is_answer(self, frame: Frame) -> bool:
        """Return whether a message answers it."""
        mine = frame.name == self.answer and frame.place == self.place.address
        return mine and (frame.channel is None or frame.channel == self.channel)


@dataclass(frozen=True)
class Draw:
    """A unit with random choices."""

    bench: Bench
    random: Random
    _asked: list[Asked] = field(default_factory=list)
    _present: dict[tuple[int, int | None, str], Frame] = field(default_factory=dict)

    @property
    def places(self) -> tuple[Target, ...]:
        """The places of the unit."""
        return self.bench.declared.places

    def asked(self, allow: Callable[[Asked], bool] = lambda asked: True) -> Asked:
        """Choose a request of the unit.

        Raises :class:`NotHereError` if no request is suitable.
        """
        found = [asked for asked in self.all_asked() if allow(asked)]
        if not found:
            raise NotHereError
        return self.random.choice(found)

    def all_asked(self) -> list[Asked]:
        """Return every request of the unit."""
        if not self._asked:
            for place in self.places:
                for request in sorted(place.messages):
                    answers = entry(request)["exchange"].get("answered_by", ())
                    if answers:
                        params = [layout["param1"] for layout in entry(request)["layouts"]]
                        named = any(param and param["name"] == "chan_ident" for param in params)
                        channels = place.channels if named else (None,)
                        found = [Asked(place, c, request, answers[0]) for c in channels]
                        self._asked.extend(found)
        return self._asked

    def present(self, asked: Asked) -> Frame:
        """Return the answer of the unit after power-on."""
        key = asked.place.address, asked.channel, asked.request
        if key not in self._present:
            link = self.bench.line()
            params = [layout["param1"] for layout in entry(asked.request)["layouts"]]
            given = asked.channel or (params[0] and params[0]["constant"]) or 0
            raw = ID[asked.request].to_bytes(2, "little")
            link.write(raw + bytes((given, 0, asked.place.address, HOST)))
            self._present[key] = Frame(link.read(0.5), asked.place.status or "")
        return self._present[key]

    def unit_is(self, *units: str) -> bool:
        """Return whether it is one of these units."""
        return self.bench.unit in units

    def claims(self, *messages: str) -> None:
        """Raise :class:`NotHereError` unless the unit has all these messages."""
        if not all(any(name in place.messages for place in self.places) for name in messages):
            raise NotHereError

    def moves(self) -> None:
        """Raise :class:`NotHereError` unless the unit moves stages."""
        if not any(place.moves_stages for place in self.places):
            raise NotHereError

    def one_of(self, *messages: str) -> str:
        """Choose one of these messages that the unit has.

        Raises :class:`NotHereError` if it has none.
        """
        found = [m for m in messages if any(m in place.messages for place in self.places)]
        if not found:
            raise NotHereError
        return self.random.choice(found)


def of(kinds: str) -> frozenset[str]:
    """Return kinds of checks from a text with blanks between them."""
    return frozenset(kinds.split())


def named(*names: str) -> Callable[[Frame], bool]:
    """Return a predicate for messages with one of some names."""
    return lambda frame: frame.name in names


class Says(Firmware):
    """Changes some messages from the controller.

    :param which: selects the messages.
    """

    def __init__(self, which: Callable[[Frame], bool], change: Change) -> None:
        self._which = which
        self._change = change

    def says(self, frame: Frame) -> None:
        for said in self._change(frame) if self._which(frame) else (frame,):
            self.say(said if isinstance(said, bytes) else said.raw)


class Takes(Firmware):
    """Changes or drops some messages to the controller.

    :param which: selects the messages.
    """

    def __init__(self, which: Callable[[Frame], bool], change: Change) -> None:
        self._which = which
        self._change = change

    def takes(self, frame: Frame) -> None:
        for taken in self._change(frame) if self._which(frame) else (frame,):
            self.pass_on(taken if isinstance(taken, bytes) else taken.raw)


class Echoes(Firmware):
    """Answers messages that have no answer.

    :param which: selects the messages.
    :param answer: the name of the answer; empty to return the messages themselves.
    """

    def __init__(self, which: Callable[[Frame], bool], answer: str = "") -> None:
        self._which = which
        self._answer = answer

    def takes(self, frame: Frame) -> None:
        self.pass_on(frame.raw)
        if self._which(frame):
            answer = frame.renamed(self._answer or frame.name)
            self.say(answer.to(HOST).coming_from(frame.dest).raw)


class Deaf(Firmware):
    """Ignores everything for some seconds after a message.

    :param which: selects the message.
    """

    def __init__(self, which: Callable[[Frame], bool], seconds: float) -> None:
        self._which = which
        self._seconds = seconds
        self._until = 0.0

    def takes(self, frame: Frame) -> None:
        if self.now() >= self._until:
            self.pass_on(frame.raw)
        if self._which(frame):
            self._until = self.now() + self._seconds
