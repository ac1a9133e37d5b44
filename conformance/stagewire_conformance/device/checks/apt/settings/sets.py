"""The parameter sets of a target: reading, writing and restoring one without a change of the others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Self

from stagewire.errors import StagewireError
from stagewire_conformance.device.causes import DELIVERY, Cause
from stagewire_conformance.device.check import Case
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.replies import judge_unasked
from stagewire_conformance.device.checks.apt.settings.care import CARE, Care
from stagewire_conformance.device.checks.apt.undocumented import undocumented_values
from stagewire_conformance.device.checks.apt.wording import joined
from stagewire_conformance.device.trial import EnoughError
from stagewire_conformance.registry import PLAIN, Json, Registry

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Need
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

Values = dict[str, Any]

CHANNEL: Final = "chan_ident"
_TRIES: Final = 2
"""The most attempts to restore values."""
_SHORT: Final = 0.2
"""Seconds in which unsolicited messages after a SET arrive."""


@dataclass(frozen=True)
class ParameterSet:
    """A SET, its REQ and its GET.

    :param name: such as ``MOT_VELPARAMS``.
    :param fields: the registry entries of the fields with values, without the channel, by name.
    :param reported: the other fields with values that only the GET has.
    :param announces: the messages that the controller sends unsolicited after a SET.
    :param has_channel: whether the messages have a channel.
    :param effect: the effect of the SET.
    :param needs: the permissions that the SET needs.
    :param chooser: the field with which the REQ selects the connector or port to read; empty without one.
    :param skip: why the set cannot be checked, because of the PICS or because its GET does not contain all
        values of its SET; empty if it can.
    """

    name: str
    set: str
    req: str
    get: str
    fields: Mapping[str, Json]
    reported: tuple[str, ...]
    announces: tuple[str, ...]
    has_channel: bool
    effect: str
    needs: frozenset[Need]
    chooser: str
    skip: str

    @property
    def messages(self) -> tuple[str, str, str]:
        """The names of the three messages."""
        return self.set, self.req, self.get


def parameter_sets(declared: Declaration, place: Target) -> Iterator[ParameterSet]:
    """Yield the parameter sets in the list of a target that can be both set and read.

    They come in the order of the registry, and include sets that the PICS withdraws.
    """
    registry = declared.registry
    for name, roles in registry.table("sets").items():
        setting, asking, telling = (roles.get(role, "") for role in ("set", "req", "get"))
        if not {setting, asking, telling} <= place.listed:
            continue
        entry = registry.messages[setting]
        unit = place.unit.name
        fields, told = _values(registry, setting, unit), _values(registry, telling, unit)
        asked = _arguments(registry, asking)
        unread = ", ".join(field for field in fields if field not in told)
        lacking = f"{telling} does not contain {unread}" if unread else ""
        chosen = next((field for field in asked if field != CHANNEL), "")
        lacking = lacking or (f"{asking} reads only the values of one {chosen}" if chosen else "")
        yield ParameterSet(
            name=name,
            set=setting,
            req=asking,
            get=telling,
            fields={field: facts for field, facts in fields.items() if field != CHANNEL},
            reported=tuple(field for field in told if field not in fields),
            announces=tuple(each for each in entry["exchange"].get("announces", ())),
            has_channel=CHANNEL in fields or CHANNEL in asked,
            effect=entry["effect"],
            needs=declared.needs([setting], place),
            chooser=chosen,
            skip=place.why_none((setting, asking, telling)) or lacking,
        )


def _arguments(registry: Registry, message: str) -> list[str]:
    """Return the fields of a request that must be given."""
    fields = registry.fields(message, registry.forms(message)[0])
    return [name for name, facts in fields.items() if facts["role"] == "value"]


def _values(
    registry: Registry, message: str, unit: str = "", form: str | None = None
) -> Mapping[str, Json]:
    """Return the registry entries of the fields with values of a form, by default the plain one."""
    forms = registry.forms(message)
    fields = registry.fields(message, form or (PLAIN if PLAIN in forms else forms[0]), unit)
    return {field: facts for field, facts in fields.items() if facts["role"] == "value"}


@dataclass(frozen=True)
class PlacedSet:
    """A parameter set of one channel of one target.

    :param channel: the channel; None if the set has none.
    """

    place: Target
    channel: int | None
    set: ParameterSet

    @property
    def text(self) -> str:
        """The target and channel, for people."""
        channel = "" if self.channel is None else f" channel {self.channel}"
        return f"{self.place.name}{channel}"

    @property
    def name(self) -> str:
        """The part of the id of a check that identifies the set."""
        channel = "" if self.channel is None else f"/{self.channel}"
        return f"{self.place.name}/{self.set.set}{channel}"

    def case(self, **arguments: object) -> Case:
        """Return the case of a check of this set, which gets it as the argument ``placed``.

        :param arguments: further arguments of the function.
        """
        return Case(
            name=self.name,
            arguments={"placed": self, **arguments},
            messages=self.set.messages,
            skip=self.set.skip,
        )

    def ask(self, trial: Trial) -> Incoming:
        """Request the values; the check ends without a reply."""
        request = trial.declared.make(self.set.req, self.channel)
        return trial.reply(request, self.place.address)

    def read(self, trial: Trial) -> Values:
        """Return the values; the check ends without a reply."""
        return self.values(self.ask(trial))

    def values(self, heard: Incoming) -> Values:
        """Return the values of a GET that was received; a short form may lack some."""
        there = heard.message.layout.fields
        return {name: getattr(heard.message, name) for name in self.set.fields if name in there}

    def differing(self, told: Values, wanted: Values) -> tuple[Cause, ...]:
        """Return the causes that the set does not store the fields that differ."""
        return tuple(Cause(self.set.set, name) for name in told if told[name] != wanted[name])

    def reported(self, trial: Trial) -> tuple[Cause, ...]:
        """Return the defects of the set that the run has reported."""
        return tuple(cause for cause in trial.causes if cause.subject == self.set.set)

    def undo(self, trial: Trial, values: Values) -> None:
        """Restore values at the end of the check, which ends now if it must not write them."""
        if excluded := self._excluded(values):
            trial.inconclusive(f"{self.text}: nothing was written with {self.set.set}: {excluded}")
            raise EnoughError
        trial.undo(
            f"{self.set.set} at {self.text}",
            lambda: self.put_back(trial, values),
            rule=rule_of_set(self.set.set),
            because=lambda: self.reported(trial),
        )

    def expected(self, trial: Trial, values: Values, came: Incoming) -> bytes:
        """Return the bytes of a GET with these values, and the addresses of the one that was received."""
        form, there = came.message.layout.form, came.message.layout.fields
        told = {name: getattr(came.message, name) for name in self.set.reported if name in there}
        message = self._message(trial, self.set.get, values, told, form)
        raw: bytes = message.pack(came.dest, came.source)
        return raw

    def write(self, trial: Trial, values: Values) -> None:
        """Write values, and check that the announced messages arrive."""
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
            trial.must(
                False,
                f"{self.text}: the controller sent no {name} after {self.set.set}; it should "
                "send one unsolicited",
                rule="max-travel-announced"
                if name == "PZ_GET_MAXTRAVEL"
                else "max-voltage-answered",
                cause=Cause(name, DELIVERY),
            )

    def _message(
        self,
        trial: Trial,
        name: str,
        values: Values,
        told: Values | None = None,
        form: str | None = None,
    ) -> Any:
        """Return a SET or a GET with these values, which may be undocumented.

        A controller may have had such values before; then they are restored, except for numbers outside their
        range.

        :param told: values that only a GET has.
        :param form: by default the plain one, or the first one that needs only these values.
        """
        if form is None and values.keys() < self.set.fields.keys():
            registry = trial.declared.registry
            form = next(
                form
                for form in registry.forms(name)
                if values.keys() >= _values(registry, name, form=form).keys() - {CHANNEL}
            )
        allowed = {
            field: max(facts["minimum"], min(values[field], facts["maximum"]))
            if facts["kind"] == "integer"
            else values[field]
            for field, facts in self.set.fields.items()
            if field in values
        }
        message = trial.declared.make(name, self.channel, form, **allowed, **(told or {}))
        return type(message).keep({**message.values(), **values})

    def write_and_ask(self, trial: Trial, values: Values) -> Incoming:
        """Write values, and return the reply to a request for them; the check ends without one.

        A SET is not answered, so anything other than this reply is reported.
        """
        self.write(trial, values)
        came = self.ask(trial)
        for heard in joined(trial.line.listen(0)):
            judge_unasked(trial, heard, f"after {self.set.set} at {self.text}")
        return came

    def _excluded(self, values: Values) -> str:
        """Return why values must not be written; empty if they may be.

        A number outside its range may damage what is connected, such as 1100 V for a motor that takes 125 V.
        """
        faults = undocumented_values(self.set.fields, values)
        beyond = [fault.text for fault in faults if fault.is_range and fault.grave]
        says = f"{self.set.get} returned values that are not safe to write back"
        return f"{says} ({'; '.join(beyond)})" if beyond else ""

    def put_back(self, trial: Trial, values: Values) -> None:
        """Write values, and check that they are in effect.

        Raise :class:`~stagewire.errors.StagewireError`, which says what to do, if they are not in effect or
        must not be written.
        """
        if excluded := self._excluded(values):
            raise StagewireError(excluded)
        line, declared = trial.line, trial.declared
        for _ in range(_TRIES):  # a lost message must not leave a setting changed
            line.send(self._message(trial, self.set.set, values), self.place.address)
            if self.set.announces:
                line.listen(_SHORT)
            came = line.ask(declared.make(self.set.req, self.channel), self.place.address)
            if came is not None and self.values(came) == values:
                return
        words = " ".join(f"{name}={value!r}" for name, value in values.items())
        says = "no reply" if came is None else came.text
        raise StagewireError(
            f"{self.text}: send {self.set.set} with {words} (current state: {says})"
        )


def placed_sets(declared: Declaration) -> Iterator[PlacedSet]:
    """Yield each parameter set of each target, for each channel that the document names."""
    for place in declared.places:
        for one in parameter_sets(declared, place):
            channels: tuple[int | None, ...] = place.channels if one.has_channel else (None,)
            if CARE.get(one.name, Care()).first_channel:
                channels = channels[:1]
            for channel in channels:
                yield PlacedSet(place, channel, one)


@dataclass(frozen=True)
class Neighbours:
    """The previous values of the other parameter sets.

    Live values, such as counters and outputs, are left out: they may differ between two requests.
    """

    before: tuple[tuple[PlacedSet, Values], ...]

    @classmethod
    def of(cls, trial: Trial, placed: PlacedSet) -> Self:
        """Read the other sets. Sets without a reply are left to the checks of answers.

        A set whose GET has a reported defect is not read: its bytes would count against this check.
        """
        before = []
        channel = placed.channel or next(iter(placed.place.channels), None)
        for one in parameter_sets(trial.declared, placed.place):
            is_still = one.effect in ("settings", "tuning") and not one.name.endswith("COUNTER")
            is_spoilt = trial.causes.check_of(Cause(one.get, DELIVERY))
            if is_still and one.name != placed.set.name and not one.skip and not is_spoilt:
                other = PlacedSet(placed.place, channel if one.has_channel else None, one)
                values = _present(trial, other)
                if values is not None:
                    before.append((other, values))
        return cls(tuple(before))

    def judge(self, trial: Trial, after: str) -> None:
        """Report the sets that have changed.

        :param after: the cause, for the sentence: ``MOT_SET_VELPARAMS was sent``.
        """
        for placed, was in self.before:
            now = _present(trial, placed)
            if now is not None and now != was:
                changed = {name: value for name, value in now.items() if value != was[name]}
                trial.must(
                    False,
                    f"{placed.text}: after {after}, {placed.set.get} returned "
                    + ", ".join(
                        f"{name} = {value!r} instead of {was[name]!r}"
                        for name, value in changed.items()
                    )
                    + "; a SET should change its own parameters only",
                    rule=rule_of_set(after.partition(" ")[0]),
                    cause=Cause(after.partition(" ")[0], "another set"),
                )


def _present(trial: Trial, placed: PlacedSet) -> Values | None:
    request = trial.declared.make(placed.set.req, placed.channel)
    came = trial.line.ask(request, placed.place.address)
    return None if came is None else placed.values(came)
