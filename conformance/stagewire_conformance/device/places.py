"""Places: everything of a controller that has an address of its own, and what is connected there."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import NamedTuple

from stagewire.devices import Facts, Scales, Unit
from stagewire.errors import UnknownScaleError
from stagewire.protocols import FramedMessage
from stagewire.quantities import Scale, Stage
from stagewire_conformance.device.pics import ChannelPics

__all__ = ["Connected", "Target", "Travel", "connected", "moves_stages"]

_POSITION = "position"
"""The quantity that a travel and a range of motion are about."""

_WHERE = "MOT_REQ_POSCOUNTER"


class Travel(NamedTuple):
    """From which count to which; both belong to it."""

    low: int
    high: int

    def __str__(self) -> str:
        return f"{self.low}..{self.high}"


@dataclass(frozen=True)
class Connected:
    """What is connected to one channel, or to one axis.

    :param stated: it, as the PICS has it.
    :param stage: it, with its scales; None: not known, so that there are counts only.
    :param scales: those that hold there.
    :param travel: in counts; None: not known.
    :param homes: whether it can be sent home.
    :param limit_switches: whether its ends have switches.
    """

    stated: ChannelPics
    stage: Stage | None
    scales: Scales
    travel: Travel | None
    homes: bool = True
    limit_switches: bool = True

    @property
    def position_scale(self) -> Scale | None:
        """The scale of positions; None: not known."""
        if _POSITION not in self.scales.rules:
            return None
        try:
            return self.scales.of(_POSITION, self.scales.unit_of(_POSITION))
        except UnknownScaleError:
            return None


def moves_stages(unit: Unit) -> bool:
    """Return whether a unit moves stages: it has axes, or can be asked where a stage stands.

    A solenoid driver takes messages of motors, too; it has no positions.
    """
    return unit.kind == "line" or _WHERE in unit.messages


def connected(
    unit: Unit, facts: Facts, stated: ChannelPics, names: tuple[str, ...] = ()
) -> Connected:
    """Return what is connected to a channel as it is stated.

    :param names: what the controller is, or may be: units and aliases, whose scales apply. Empty: the unit.

    Raises :class:`.RangeError` for a travel that no known scale converts to counts.
    """
    stage: Stage | None = None
    if stated.stage:
        stage = getattr(import_module(f"{facts.package}.stages"), stated.stage)
    elif stated.counts_per_mm is not None:
        stage = Stage.of_user("stage of the PICS", position=Scale(stated.counts_per_mm, "mm"))
    scales = Scales(unit.name, facts.quantities, stage=stage, stages=unit.stages, names=names)
    bare = Connected(stated, stage, scales, None, stated.homes, stated.limit_switches)
    if stated.travel is None:
        return bare
    travel = Travel(*stated.travel.in_counts(bare.position_scale))
    return replace(bare, travel=travel)


@dataclass(frozen=True, kw_only=True)
class Target:
    """Something with an address of its own, or an axis.

    :param address: or the identifier of the axis.
    :param name: as it stands in ids and texts: ``0x50``, or ``X``.
    :param unit: what the document says of what is there: of a bay that of its card or module.
    :param bay: from 1 on; None for what is in no bay.
    :param is_motherboard: whether it is the motherboard of a rack, which has no channels.
    :param channels: by number; of an axis none.
    :param listed: the messages that the document gives it.
    :param unsupported: those of them that the PICS takes back, with the reasons.
    :param fitted: channel -> what is connected to it; of an axis under None.
    """

    address: int
    name: str
    unit: Unit
    facts: Facts = field(repr=False)
    bay: int | None = None
    is_motherboard: bool = False
    channels: tuple[int, ...] = ()
    listed: frozenset[str] = field(repr=False)
    unsupported: Mapping[str, str] = field(default_factory=dict, repr=False)
    fitted: Mapping[int | None, Connected] = field(default_factory=dict, repr=False)

    @functools.cached_property
    def messages(self) -> frozenset[str]:
        """The messages that it is claimed to take and to give."""
        return self.listed - self.unsupported.keys()

    @property
    def status(self) -> str | None:
        """Which form of status it sends: ``dc``, ``stepper``, ``piezo`` or None."""
        return self.unit.status

    @property
    def keep_alive(self) -> type[FramedMessage] | None:
        """What it has to hear again and again on USB; None: nothing."""
        sign = None if self.is_motherboard else self.unit.keep_alive
        if sign is None or sign.layout.message not in self.messages:
            return None
        assert issubclass(sign, FramedMessage)  # commands keep nobody alive
        return sign

    @functools.cached_property
    def moves_stages(self) -> bool:
        """Whether stages can be connected to it, and not only actuators, shutters or sensors."""
        return moves_stages(self.unit) and not self.is_motherboard

    def why_not(self, message: str) -> str:
        """Return why a message is not claimed, for a check that is skipped; empty where it is."""
        if message in self.messages:
            return ""
        if message in self.unsupported:
            return f"the PICS says that {message} is not supported: {self.unsupported[message]}"
        return f"{message} is not in the list of {self.unit.name}"

    def named(self, names: tuple[str, ...]) -> Target:
        """Return the place of a controller that is, or may be, one of some units and aliases.

        Raises :class:`.RangeError` where the travel of its stage is in a unit that has no scale on them.
        """
        fitted = {
            channel: connected(self.unit, self.facts, each.stated, names)
            for channel, each in self.fitted.items()
        }
        return replace(self, fitted=fitted)

    def connected_to(self, channel: int | None = None) -> Connected:
        """Return what is connected to a channel; raises :class:`KeyError` for one that is not there."""
        return self.fitted[channel]

    def stage_of(self, channel: int | None = None) -> Stage | None:
        """Return the stage on a channel; None: not known."""
        return self.fitted[channel].stage

    def travel_of(self, channel: int | None = None) -> Travel | None:
        """Return the travel of the stage on a channel, in counts; None: not known."""
        return self.fitted[channel].travel

    def position_scale(self, channel: int | None = None) -> Scale | None:
        """Return the scale of positions on a channel; None: not known."""
        return self.fitted[channel].position_scale
