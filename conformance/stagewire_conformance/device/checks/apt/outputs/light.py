"""A laser or a temperature controller under test: its status, its readings and its settings.

Nothing is written while its output is on: :meth:`Light.begin` then ends the check without a verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final, TypeVar

from stagewire.errors import StagewireError
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, Values, parameter_sets
from stagewire_conformance.device.permissions import HAZARDS
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial
    from stagewire_conformance.registry import Json

_Look = TypeVar("_Look", bound=Callable[..., None])

STATUS: Final = ("LA_{}_STATUSUPDATE", "LD_{}_STATUSUPDATE", "TEC_{}_STATUSUPDATE")
"""The status messages of laser sources, diode drivers and temperature controllers."""

_TRIES: Final = 3
_SHORT: Final = 0.1  # seconds until a change is undone
_OFF: Final = 0.01  # share of full scale below which a reading counts as zero
FULL: Final = 32767
"""Counts of a whole share."""


class Light:
    """A laser or a temperature controller under test."""

    def __init__(self, trial: Trial, place: Target) -> None:
        self.trial, self.place = trial, place
        self._request = next(each for each in status_messages() if each[0] in place.messages)

    @property
    def is_driver(self) -> bool:
        """Whether it is a laser diode driver."""
        return self.status_name.startswith("LD_")

    @property
    def status_name(self) -> str:
        """The name of its status message."""
        return self._request[1]

    def ask(self, request: str, **values: int) -> Any:
        """Send a request, and return the message that answers it."""
        message = self.trial.declared.make(request, None, **values)
        return self.trial.reply(message, self.place.address).message

    def send(self, name: str, **values: int) -> None:
        """Send a message."""
        message = self.trial.declared.make(name, None, **values)
        self.trial.line.send(message, self.place.address)

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        self.trial.line.listen(seconds)

    def status(self) -> tuple[Any, frozenset[str]]:
        """Return the status message, and the names of the bits that are set."""
        status = self.ask(self._request[0])
        return status, self.bits(self.status_name, status)

    def bits(self, name: str, message: Any) -> frozenset[str]:
        """Return the names of the bits that are set in a message."""
        table = masks_of(self.trial.declared, self.place, name)
        return frozenset(bit for bit, mask in table.items() if message.status_bits & mask)

    def is_on(self) -> bool:
        """Return whether the status reports an output that is on."""
        return "output_enabled" in self.status()[1]

    def begin(self) -> None:
        """End the check without a verdict if the output is on: nothing may be written to it."""
        status, bits = self.status()
        on = "output_enabled" in bits
        if on or drawn(status):
            said = "its output is on" if on else "its output is off, but there is a current"
            self.trial.inconclusive(
                f"{self.place.name}: {said}, so nothing was written; switch it off and repeat"
            )
            raise EnoughError

    def undo(
        self, what: str, name: str, action: Callable[[], None], is_so: Callable[[], bool]
    ) -> None:
        """Undo a change at the end of the check, and read back that it is undone; see :meth:`.Trial.undo`.

        :param name: the message with which the action undoes the change.
        """

        def put_back() -> None:
            for _ in range(_TRIES):  # a lost message must not leave a laser on
                action()
                self.wait(_SHORT)
                if is_so():
                    return
            raise StagewireError(f"{name} was sent {_TRIES} times without effect")

        self.trial.undo(what, put_back, because=lambda: (Cause(name, EFFECT),))

    def set_of(self, name: str) -> PlacedSet:
        """Return a parameter set."""
        sets = parameter_sets(self.trial.declared, self.place)
        return PlacedSet(self.place, None, next(each for each in sets if each.name == name))

    def keeps(self, placed: PlacedSet, values: Values, rule: str = "get-answers-request") -> bool:
        """Write values, and return whether they are read back; a difference breaks the rule."""
        came = placed.write_and_ask(self.trial, values)
        told = placed.values(came)
        return self.trial.must(
            {name: told[name] for name in values} == dict(values),
            f"{placed.text}: {placed.set.set} wrote {_text(values)}, but {placed.set.get} then returned "
            f"{_text({name: told[name] for name in values})}",
            wanted=placed.expected(self.trial, {**told, **values}, came),
            came=came.raw,
            rule=rule,
            cause=Cause(placed.set.set, EFFECT),
        )


def drawn(status: Any) -> bool:
    """Return whether a status reports more current than none; TEC currents are in mA."""
    current = getattr(status, "laser_current", None)
    return bool(status.i_tec) if current is None else abs(current) > _OFF * FULL


def status_messages() -> Iterator[tuple[str, str]]:
    """Yield the request and the status message of each kind of unit."""
    for name in STATUS:
        yield name.format("REQ"), name.format("GET")


def masks_of(declared: Declaration, place: Target, message: str) -> dict[str, int]:
    """Return the masks of the status bits of a unit in a message, by name."""
    field: Json = declared.registry.fields(message, "data")["status_bits"]
    table = field.get("flags_by_unit", {}).get(place.unit.name, field["flag_table"])
    bits = declared.registry.table("flags")[table]["bits"]
    return {name: bit["mask"] for name, bit in bits.items()}


def light_check(
    kind: Kind,
    title: str,
    *,
    messages: tuple[str, ...],
    does: str = "",
    seconds: float = 0.3,
    bound: str = "",
) -> Callable[[_Look], _Look]:
    """Declare a function as a check of each target with some messages; a decorator.

    It needs the permissions for the hazards of its messages, and is called with a :class:`Light`.

    :param title: has the target as ``{place.name}``.
    """

    def cases(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
        for place in declared.places:
            asked = [each for each in status_messages() if each[0] in place.listed]
            if place.listed.issuperset(messages) and asked:
                yield Case(
                    name=place.name,
                    arguments={"place": place},
                    messages=asked[0],
                    needs=declared.needs(messages, place) & HAZARDS,
                    skip=place.why_none((*messages, *asked[0])),
                )

    return kind.check(title, messages=messages, does=does, bound=bound, seconds=seconds, each=cases)


def _text(values: Values) -> str:
    return ", ".join(f"{name} = {value}" for name, value in values.items())
