"""Motions that a check may have started, and the messages that end them, the mildest first."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

from stagewire.protocols import FramedMessage
from stagewire.sessions import Matching
from stagewire_apt import flags
from stagewire_apt.enumerations import ChannelEnableMode, EnableState, SolenoidState
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.targets import Target

_PROFILED: Final = "PROFILED"
"""The stop mode that is used first: without losing steps, as in the library."""
_IMMEDIATE: Final = "IMMEDIATE"

STATUS_BITS: Final[Mapping[str, Callable[[int], Any]]] = {
    "dc": flags.DcStatusBits,
    "stepper": flags.StepperStatusBits,
}
"""The bits of a status by the form of the status messages of a unit."""

_MOTION: Final = (
    "moving_forward", "moving_reverse", "jogging_forward", "jogging_reverse", "homing",
)  # fmt: skip


def reports_motion(bits: Any) -> bool:
    """Return whether the bits of a status report motion."""
    return any(getattr(bits, name) for name in _MOTION)


_ENABLE: Final = "MOD_SET_CHANENABLESTATE"
_MODE: Final = "PZMOT_SET_KCUBECHANENABLEMODE"
_SOLENOID: Final = "MOT_SET_SOL_STATE"


class _Where(NamedTuple):
    """An address and a channel; None for all channels."""

    dest: int
    channel: int | None


class Ending(NamedTuple):
    """Messages that should bring a channel to rest.

    :param text: for sentences.
    :param disables: whether they disable the channel.
    """

    text: str
    messages: tuple[FramedMessage, ...]
    disables: bool = False


class Moved:
    """The motions started since the last check began.

    :param declared: the controller.
    :param matching: finds the source and the channel of a message.
    """

    def __init__(self, declared: Declaration, matching: Matching) -> None:
        self._declared = declared
        self._matching = matching
        self._entries = declared.registry.messages
        self.ends = frozenset[str]().union(*map(self._ends_of, self._entries))
        """The messages that report the end of a motion."""
        # Place of a motion -> the messages that report its end; an empty set if only a stop ends it.
        # None: the motion has ended.
        self._going: dict[_Where, frozenset[str] | None] = {}
        self._asked = False  # something was asked to move or to stop
        self.unasked: dict[str, bytes] = {}
        """Ends of motions that no message asked for: message -> the first one received."""

    def _ends_of(self, message: str) -> frozenset[str]:
        exchange = self._entries[message]["exchange"]
        return frozenset(exchange.get("completes_with", ())) | set(exchange.get("stops_with", ()))

    def sends(self, message: FramedMessage, dest: int, effect: str | None) -> None:
        """Note a message that is about to be sent."""
        where = _Where(dest, self._matching.channel_of(message))
        name = message.layout.message
        self._asked |= effect in ("motion", "stop")
        if effect == "motion":
            goes_on = bool(self._entries[name]["exchange"].get("halted_by"))
            ends = self._ends_of(name) if goes_on else self._going.get(where)
            self._going[where] = ends
        elif effect == "stop" and (ends := self._going.get(where)) is not None:
            self._going[where] = ends | self._ends_of(name) if ends else None

    def suspects(self, dest: int, channel: int) -> None:
        """Note that a faulty controller may move a channel, although the next message should not."""
        self._going.setdefault(_Where(dest, channel), None)

    def hears(self, message: FramedMessage, raw: bytes) -> None:
        """Note a received message, which may be the end of a motion."""
        if message.layout.message not in self.ends:
            return
        if not self._asked:
            self.unasked.setdefault(message.layout.message, raw)
        source, channel = self._matching.source_of(raw), self._matching.channel_of(message)
        for where, ends in self._going.items():
            if ends and message.layout.message in ends and where == _Where(source or -1, channel):
                self._going[where] = None

    def channels(self, *, going: bool = False) -> list[tuple[Target, int]]:
        """Return every channel that was set in motion.

        :param going: whether to return only those whose end was not reported.
        """
        found: dict[tuple[int, int], tuple[Target, int]] = {}
        for where, ends in self._going.items():
            place = self._declared.place_at(where.dest)
            if place is None or (going and ends is None):
                continue
            for channel in place.channels if where.channel is None else (where.channel,):
                found[where.dest, channel] = place, channel
        return list(found.values())

    def forget(self) -> None:
        """Forget all motions, before the next check."""
        self._going.clear()
        self.unasked.clear()
        self._asked = False

    def endings(self, place: Target, channel: int) -> list[Ending]:
        """Return the messages that end the motion of a channel, the mildest first.

        They include messages that the PICS lists as unsupported. A channel is disabled last, and only if it
        can be stopped at all.
        """
        names = sorted(name for name in place.listed if self._entries[name]["effect"] == "stop")
        found = []
        if names:
            stops = tuple(self._stop(name, channel, _PROFILED) for name in names)
            found.append(Ending(" and ".join(names), stops))
        manners = [name for name in names if self._manner(name, _IMMEDIATE)]
        if manners:
            stops = tuple(self._stop(name, channel, _IMMEDIATE) for name in manners)
            found.append(Ending(f"an immediate {' and '.join(manners)}", stops))
        if _SOLENOID in place.listed:
            off = self._declared.make(_SOLENOID, channel, state=SolenoidState.SOLENOID_OFF)
            found.insert(0, Ending(_SOLENOID, (off,)))
        if found and place.reports_position and (disable := self._disable(place, channel)):
            told = " and ".join(each.layout.message for each in disable)
            found.append(Ending(f"{told} (disable)", disable, disables=True))
        return found

    def _disable(self, place: Target, channel: int) -> tuple[FramedMessage, ...]:
        """Return the messages that disable a channel; with a mode for all channels, they disable all."""
        make = self._declared.make
        found: list[FramedMessage] = []
        if _ENABLE in place.listed:
            found.append(make(_ENABLE, channel, enable_state=EnableState.DISABLE))
        if _MODE in place.listed:
            found.append(make(_MODE, mode=ChannelEnableMode.NONE))
        return tuple(found)

    def _stop(self, name: str, channel: int, manner: str) -> FramedMessage:
        made: FramedMessage = self._declared.make(name, channel, **self._manner(name, manner))
        return made

    def _manner(self, name: str, manner: str) -> dict[str, Any]:
        """Return the fields of a stop that choose how to stop; empty if there is only one way."""
        [layout] = self._entries[name]["layouts"]
        fields = self._declared.registry.fields(name, layout["form"])
        return {
            field: entry["enum"][manner]
            for field, entry in fields.items()
            if manner in entry.get("enum", ())
        }
