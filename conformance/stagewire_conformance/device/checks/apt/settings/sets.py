"""The parameter sets of a place: one is read, written and put back, and all others of its channel stay."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Self

from stagewire.errors import StagewireError
from stagewire_conformance.device.check import Case
from stagewire_conformance.device.checks.apt.replies import judge_unasked
from stagewire_conformance.device.checks.apt.settings.care import CARE, Care
from stagewire_conformance.registry import Json

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

Values = dict[str, Any]

CHANNEL: Final = "chan_ident"
_TRIES: Final = 2
"""Times that something is put back, where it is not seen to be there."""
_SHORT: Final = 0.2
"""Seconds within which what a SET sends back by itself has come."""


@dataclass(frozen=True)
class ParameterSet:
    """A SET, its REQ and its GET.

    :param name: such as ``MOT_VELPARAMS``.
    :param fields: those that carry values, without the channel, by name: entries of the registry.
    :param announces: what a SET sends back by itself.
    :param has_channel: whether it names one.
    :param effect: of the SET.
    :param skip: why it cannot be looked at, which only the PICS can say; empty: it can.
    """

    name: str
    set: str
    req: str
    get: str
    fields: Mapping[str, Json]
    announces: tuple[str, ...]
    has_channel: bool
    effect: str
    skip: str

    @property
    def messages(self) -> tuple[str, str, str]:
        """The names of the three messages."""
        return self.set, self.req, self.get


def parameter_sets(declared: Declaration, place: Target) -> Iterator[ParameterSet]:
    """Give the parameter sets in the list of a place that can be set and asked for, as the registry has them.

    Those that the PICS takes back are among them.
    """
    registry = declared.registry
    for name, roles in registry.table("sets").items():
        setting, asking, telling = (roles.get(role, "") for role in ("set", "req", "get"))
        if not {setting, asking, telling} <= place.listed:
            continue
        entry = registry.messages[setting]
        fields = {
            field: facts
            for field, facts in registry.fields(setting, entry["layouts"][0]["form"]).items()
            if facts["role"] == "value"
        }
        yield ParameterSet(
            name=name,
            set=setting,
            req=asking,
            get=telling,
            fields={field: facts for field, facts in fields.items() if field != CHANNEL},
            announces=tuple(each for each in entry["exchange"].get("announces", ())),
            has_channel=CHANNEL in fields,
            effect=entry["effect"],
            skip=place.why_none((setting, asking, telling)),
        )


@dataclass(frozen=True)
class PlacedSet:
    """A parameter set of one channel of one place.

    :param channel: None where the set names none.
    """

    place: Target
    channel: int | None
    set: ParameterSet

    @property
    def text(self) -> str:
        """Where it is, for people."""
        channel = "" if self.channel is None else f" channel {self.channel}"
        return f"{self.place.name}{channel}"

    @property
    def name(self) -> str:
        """What names it in the id of a check."""
        channel = "" if self.channel is None else f"/{self.channel}"
        return f"{self.place.name}/{self.set.set}{channel}"

    def case(self, **arguments: object) -> Case:
        """Return the case of a check that looks at it; it is the argument ``placed``.

        :param arguments: of the function besides.
        """
        return Case(
            name=self.name,
            arguments={"placed": self, **arguments},
            messages=self.set.messages,
            skip=self.set.skip,
        )

    def ask(self, trial: Trial) -> Incoming:
        """Ask for the values; the check ends where nothing answers."""
        request = trial.declared.make(self.set.req, self.channel)
        return trial.reply(request, self.place.address)

    def read(self, trial: Trial) -> Values:
        """Return the values; the check ends where nothing answers."""
        return self.values(self.ask(trial))

    def values(self, heard: Incoming) -> Values:
        """Return the values of a GET that came."""
        return {name: getattr(heard.message, name) for name in self.set.fields}

    def expected(self, trial: Trial, values: Values, came: Incoming) -> bytes:
        """Return the bytes of the GET that would have said these values, addressed as the one that came."""
        raw: bytes = self._message(trial, self.set.get, values).pack(came.dest, came.source)
        return raw

    def write(self, trial: Trial, values: Values) -> None:
        """Write values, and see that what the document has come because of that does."""
        line, place = trial.line, self.place
        line.send(self._message(trial, self.set.set, values), place.address)
        missing = {name for name in self.set.announces if name in place.messages}
        if not missing:
            return

        def complete(heard: Incoming) -> bool:
            missing.discard(heard.name)
            return not missing

        came = line.listen(_SHORT, until=complete)
        line.heard[:0] = [each for each in came if each.name not in self.set.announces]
        for name in sorted(missing):
            trial.must(False, f"{self.text}: {self.set.set} was sent, and no {name} came by itself")

    def _message(self, trial: Trial, name: str, values: Values) -> Any:
        """Return a SET or a GET with some values, which may be ones that the document does not allow.

        A controller may have had them before, and then they are put back.
        """
        allowed = {
            field: max(facts["minimum"], min(values[field], facts["maximum"]))
            if facts["kind"] == "integer"
            else values[field]
            for field, facts in self.set.fields.items()
        }
        message = trial.declared.make(name, self.channel, **allowed)
        return type(message).keep({**message.values(), **values})

    def write_and_ask(self, trial: Trial, values: Values) -> Incoming:
        """Write values and return what is then told; the check ends where nothing answers.

        A SET is not answered: what comes beside the answer to the request is said to be wrong.
        """
        self.write(trial, values)
        came = self.ask(trial)
        for heard in trial.line.listen(0):
            judge_unasked(trial, heard, f"after {self.set.set} at {self.text}")
        return came

    def put_back(self, trial: Trial, values: Values) -> None:
        """Write values and see that they are there again.

        Raises :class:`~stagewire.errors.StagewireError` with what to do where they are not.
        """
        line, declared = trial.line, trial.declared
        for _ in range(_TRIES):  # one lost message is not to leave a setting changed
            line.send(self._message(trial, self.set.set, values), self.place.address)
            if self.set.announces:
                line.listen(_SHORT)
            came = line.ask(declared.make(self.set.req, self.channel), self.place.address)
            if came is not None and self.values(came) == values:
                return
        words = " ".join(f"{name}={value!r}" for name, value in values.items())
        says = "nothing" if came is None else came.text
        raise StagewireError(f"{self.text}: write {self.set.set} {words} (it says: {says})")


def placed_sets(declared: Declaration) -> Iterator[PlacedSet]:
    """Give each parameter set of each channel of each place, of those channels that the document names."""
    for place in declared.places:
        for one in parameter_sets(declared, place):
            channels: tuple[int | None, ...] = place.channels if one.has_channel else (None,)
            if CARE.get(one.name, Care()).first_channel:
                channels = channels[:1]
            for channel in channels:
                yield PlacedSet(place, channel, one)


@dataclass(frozen=True)
class Neighbours:
    """The values of the other sets as they were.

    Left out is what lives by itself, such as counters and outputs, which two requests may see differently.
    """

    before: tuple[tuple[PlacedSet, Values], ...]

    @classmethod
    def of(cls, trial: Trial, placed: PlacedSet) -> Self:
        """Read the sets beside one; those that are not answered are left to the checks of answers."""
        before = []
        channel = placed.channel or next(iter(placed.place.channels), None)
        for one in parameter_sets(trial.declared, placed.place):
            is_still = one.effect == "settings" and not one.name.endswith("COUNTER")
            if is_still and one.name != placed.set.name and not one.skip:
                other = PlacedSet(placed.place, channel if one.has_channel else None, one)
                values = _present(trial, other)
                if values is not None:
                    before.append((other, values))
        return cls(tuple(before))

    def judge(self, trial: Trial, after: str) -> None:
        """Say which of them have changed.

        :param after: for the sentence: ``MOT_SET_VELPARAMS was sent``.
        """
        for placed, was in self.before:
            now = _present(trial, placed)
            if now is not None and now != was:
                changed = {name: value for name, value in now.items() if value != was[name]}
                trial.must(
                    False,
                    f"{placed.text}: after {after}, {placed.set.get} said "
                    + ", ".join(
                        f"{name} = {value!r}, not {was[name]!r}" for name, value in changed.items()
                    )
                    + "; a SET changes its own parameters only",
                )


def _present(trial: Trial, placed: PlacedSet) -> Values | None:
    request = trial.declared.make(placed.set.req, placed.channel)
    came = trial.line.ask(request, placed.place.address)
    return None if came is None else placed.values(came)
