"""What a user may tell of a virtual unit when it is made."""

from __future__ import annotations

import enum
from collections.abc import Callable, Collection, Iterable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final, TypeVar

from stagewire import Stage
from stagewire_virtual.errors import BadOptionError

_T = TypeVar("_T")


class LinkKind(enum.StrEnum):
    """What a controller believes to be connected by; it decides whether it wants to be kept alive."""

    USB = "usb"
    RS232 = "rs232"


@dataclass(frozen=True, slots=True)
class Settings:
    """What is told of one channel or axis; what is None, its behaviour chooses.

    :param stage: the stage on it, which gives the scales; without one everything moves in counts.
    :param travel: of a stage in counts, of a piezo actuator in steps of 100 nm, of an axis of an MS-2000 in
        tenths of a micrometre.
    :param position: where it is at the beginning, in the same unit, from the lower end of its travel.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a value of another type.
    """

    stage: Stage | None = None
    travel: int | None = None
    position: int | None = None

    def __post_init__(self) -> None:
        _check(self, _SETTINGS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """All that may be told of a unit; what does not concern it is refused when it is made.

    :param seed: decides whatever is left to chance.
    :param model: model in HW_GET_INFO, 1 to 8 printable ASCII characters; None: that of the unit.
    :param serial_number: serial number in HW_GET_INFO; None: made of the prefix of the unit and the seed.
    :param hardware_type: type in HW_GET_INFO, 0 to 65535; None: that of the unit.
    :param stage_id: bytes 76 and 77 of the payload of HW_GET_INFO, 0 to 65535, by which later controllers say
        what stage they drive; None: 0. These four describe the unit itself, of a rack or a module its
        motherboard; cards and modules in bays keep their own.
    :param line: USB, or RS-232, where a controller does not ask for a keep-alive.
    :param quirks: deviations of real controllers, by name; see :mod:`stagewire_virtual.thorlabs_apt.quirks`.
    :param answer_unsupported: answer HW_RESPONSE to what is refused or not understood, instead of silence.
    :param channels: settings channel by channel, of a rack bay by bay; the last one stands for those
        that follow; () is the default for all.
    :param empty_bays: bays of a rack without a card, counted from 0.
    :param strategies: readings of the MS-2000's document, name -> value.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a value of another type.
    """

    seed: int = 0
    model: str | None = None
    serial_number: int | None = None
    hardware_type: int | None = None
    stage_id: int | None = None
    line: LinkKind = LinkKind.USB
    quirks: frozenset[str] = frozenset()
    answer_unsupported: bool = False
    channels: tuple[Settings, ...] = ()
    empty_bays: frozenset[int] = frozenset()
    strategies: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        _check(self, _OPTIONS)

    def settings(self, index: int) -> Settings:
        """Return the settings of the channel that is ``index``-th, counted from 0."""
        if not self.channels:
            return Settings()
        return self.channels[min(index, len(self.channels) - 1)]


def parse_link_kind(name: LinkKind | str) -> LinkKind:
    """Return the line of a name in any case: ``usb`` or ``rs232``.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for another one.
    """
    try:
        return LinkKind(name.lower())
    except ValueError:
        known = " or ".join(line.value for line in LinkKind)
        raise BadOptionError(f"unknown line type {name!r} (choose {known})") from None


def check_stage(stage: Stage, units: Collection[str]) -> None:
    """Refuse a stage whose scales are known on none of the units, which are given by name.

    Raises :class:`~stagewire_virtual.errors.BadOptionError`, which lists those where they are known.
    """
    known = sorted({name for names in stage.controllers.values() for name in names})
    if units and not set(units) & set(known):
        raise BadOptionError(
            f"the scales of {stage.name} on {' or '.join(units)} are not known "
            f"(they are on: {', '.join(known)}); without a stage everything is in counts"
        )


def known_only(what: str, given: Iterable[str], known: Iterable[str], unit: str) -> None:
    """Refuse names of some kind of option that the unit does not know.

    Raises :class:`~stagewire_virtual.errors.BadOptionError`, which lists those that it knows.
    """
    names = sorted(known)
    for name in sorted(given):
        if name not in names:
            there = f"there are: {', '.join(names)}" if names else "there is none"
            raise BadOptionError(f"{unit} has no {what} {name} ({there})")


def several(what: str, given: Iterable[_T]) -> Iterable[_T]:
    """Return what was given as it is; raise for one alone.

    Type checkers pass a text for a list of texts, which are its letters.
    """
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise BadOptionError(f"{what} are several; for one alone write {what}=[{given!r}]")
    return given


_Fits = Callable[[Any], bool]


def _whole(value: Any) -> bool:
    return type(value) is int  # True is none


def _none_or(fits: _Fits) -> _Fits:
    return lambda value: value is None or fits(value)


def _is(kind: type) -> _Fits:
    return lambda value: isinstance(value, kind)


def _all(kind: type, fits: _Fits) -> _Fits:
    return lambda value: _is(kind)(value) and all(map(fits, value))


def _texts_by_name(value: Any) -> bool:
    return isinstance(value, Mapping) and all(map(_is(str), (*value, *value.values())))


_SETTINGS: Final[Mapping[str, tuple[_Fits, str]]] = {
    "stage": (
        _none_or(_is(Stage)),
        "a stage such as stagewire_apt.stages.Z8 (its name is for bench files and the command line)",
    ),
    "travel": (_none_or(_whole), "a whole number"),
    "position": (_none_or(_whole), "a whole number"),
}
"""Whether a value is of the right type, and what is expected; by its name."""

_OPTIONS: Final[Mapping[str, tuple[_Fits, str]]] = {
    "seed": (_whole, "a whole number"),
    "model": (_none_or(_is(str)), "a text such as 'KDC101'"),
    "serial_number": (_none_or(_whole), "a whole number of eight digits"),
    "hardware_type": (_none_or(_whole), "a whole number"),
    "stage_id": (_none_or(_whole), "a whole number"),
    "line": (_is(LinkKind), "LinkKind.USB or LinkKind.RS232"),
    "quirks": (_all(AbstractSet, _is(str)), "a set of names"),
    "answer_unsupported": (_is(bool), "True or False"),
    "channels": (_all(tuple, _is(Settings)), "a tuple of Settings"),
    "empty_bays": (_all(AbstractSet, _whole), "a set of whole numbers, the bays from 0"),
    "strategies": (_texts_by_name, "a mapping such as {'power_on_mode': 'low'}"),
}
"""As :data:`_SETTINGS`."""


def _check(given: object, kinds: Mapping[str, tuple[_Fits, str]]) -> None:
    for name, (fits, expected) in kinds.items():
        value = getattr(given, name)
        if not fits(value):
            raise BadOptionError(f"{name}: expected {expected}, not {value!r}")
