"""Checks of outputs: one for each channel whose target claims the messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final, NoReturn, TypeVar

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.permissions import COUNTS, HAZARDS, Need
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire.protocols import FramedMessage
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


_Look = TypeVar("_Look", bound=Callable[..., None])


class Output:
    """A channel with an output, during a check.

    :param trial: the trial of the check.
    :param place: the target that has the channel.
    :param channel: the number of the channel.
    """

    def __init__(self, trial: Trial, place: Target, channel: int) -> None:
        self.trial = trial
        self.place = place
        self.channel = channel
        self.text = f"{place.name} channel {channel}"

    def send(self, message: FramedMessage) -> None:
        """Send a message to the target."""
        self.trial.line.send(message, self.place.address)

    def ask(self, request: FramedMessage) -> Any:
        """Send a request, and return the reply; the check ends without one."""
        return self.trial.reply(request, self.place.address).message

    def give_up(self, why: str) -> NoReturn:
        """End the check without a verdict."""
        self.trial.inconclusive(why)
        raise EnoughError


_BOUND: Final = "each output changes at once, within {range}"


def output_check(
    kind: Kind,
    title: str,
    *,
    messages: tuple[str, ...],
    does: str,
    settings: bool = False,
    seconds: float = 0.3,
    lacks: Callable[[Declaration, Permissions, Target], str] = lambda declared, allowed, place: "",
    also: Callable[[Target], tuple[str, ...]] = lambda place: (),
    skip: Callable[[Declaration, Target], str] = lambda declared, place: "",
    fits: Callable[[Target], object] = lambda place: True,
) -> Callable[[_Look], _Look]:
    """Declare a function as a check of each channel whose target has some messages; a decorator.

    It needs the permissions for the hazards of its messages, and for those that tune a loop.

    :param title: has the channel as ``{output}``.
    :param does: has the allowed range as ``{range}``.
    :param settings: whether the check also changes settings.
    :param also: returns further messages of a target that the check uses.
    :param skip: returns why the PICS excludes a target, apart from the messages.
    :param fits: returns whether a target has what the check is about, apart from the messages.
    :param lacks: returns why the permissions do not suffice for a target.
    """

    def cases(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
        for place in declared.places:
            if not place.listed.issuperset(messages) or not fits(place):
                continue
            for channel in place.channels:
                yield Case(
                    name=f"{place.name}/{channel}",
                    arguments={"place": place, "channel": channel},
                    words={"output": f"channel {channel} of {place.name}"},
                    messages=also(place),
                    needs=declared.needs((*messages, *also(place)), place)
                    & {*HAZARDS, Need.TUNING},
                    skip=place.why_none(messages) or skip(declared, place),
                    lacks=lacks(declared, allowed, place),
                )

    return kind.check(
        title,
        messages=messages,
        needs={Need.MOTION, Need.SETTINGS} if settings else {Need.MOTION},
        does=does,
        bound=_BOUND,
        seconds=seconds,
        each=cases,
    )


def lacks_volts(declared: Declaration, allowed: Permissions, place: Target) -> str:
    """Return why the allowed range does not suffice if it is not a range of voltages; otherwise empty."""
    return lacks_unit(allowed, ("V", "mV"), "voltages")


def lacks_unit(allowed: Permissions, units: tuple[str, ...], what: str) -> str:
    """Return why the allowed range does not suffice if it is in other units; otherwise empty."""
    motion = allowed.motion
    if motion is None or motion.unit in (*units, COUNTS):
        return ""
    return f"{motion} is not a range of {what}; allow one in {units[0]} or in counts"
