"""The options of virtual units."""

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
    """The kind of line that a controller assumes; only on USB does it require keep-alive messages."""

    USB = "usb"
    RS232 = "rs232"


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of one channel or axis; None leaves the choice to its behaviour.

    :param stage: its stage, which determines the scales; without one, values are in counts.
    :param travel: its travel: counts for a stage or a paddle, steps of 100 nm for a piezo actuator, nm for an
        inertial drive, tenths of a micrometre for an axis of an MS-2000.
    :param position: its first position, in the same unit, from the lower end of the travel.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a value of another type.
    """

    stage: Stage | None = None
    travel: int | None = None
    position: int | None = None

    def __post_init__(self) -> None:
        _check(self, _SETTINGS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """The options of a unit; making a unit raises for options that it does not support.

    The model, serial number, hardware type and stage id describe the unit itself: for a rack or a module, the
    motherboard. Cards and modules in bays keep their own.

    :param seed: seed of all random choices.
    :param model: model in HW_GET_INFO, 1 to 8 printable ASCII characters; None: that of the unit.
    :param serial_number: serial number in HW_GET_INFO; None: the prefix of the unit and six digits from the
        seed.
    :param hardware_type: type in HW_GET_INFO, 0 to 65535; None: that of the unit.
    :param stage_id: bytes 76 and 77 of the payload of HW_GET_INFO, 0 to 65535, in which later controllers
        report the stage that they drive; None: the id of the stage on units that report it there, else 0.
    :param line: USB or RS-232; on RS-232 a controller requires no keep-alive messages.
    :param quirks: names of deviations of real controllers; see
        :mod:`stagewire_virtual.thorlabs_apt.quirks`.
    :param answer_unsupported: whether refused and unknown messages are answered with HW_RESPONSE instead of
        silence.
    :param channels: the settings of each channel, for a rack bay by bay; the last entry also applies to all
        further channels; () is the default for all.
    :param empty_bays: the bays of a rack without a card, counted from 1.
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
        """Return the settings of the channel with this index, counted from 0."""
        if not self.channels:
            return Settings()
        return self.channels[min(index, len(self.channels) - 1)]


def parse_link_kind(name: LinkKind | str) -> LinkKind:
    """Return the kind of line with this name, in any case: ``usb`` or ``rs232``.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for any other name.
    """
    try:
        return LinkKind(name.lower())
    except ValueError:
        known = " or ".join(line.value for line in LinkKind)
        raise BadOptionError(f"unknown line type {name!r} (choose {known})") from None


def stage_units(stage: Stage) -> set[str]:
    """Return the names of the units on which the scales of a stage are known."""
    return {name for names in stage.controllers.values() for name in names}


def check_stage(stage: Stage, units: Collection[str]) -> None:
    """Raise for a stage whose scales are not known on any of the named units.

    The :class:`~stagewire_virtual.errors.BadOptionError` lists the units for which they are known.
    """
    if "" in stage.scales:  # of a user, for every unit
        return
    known = stage_units(stage) | stage.controllers.keys()
    if units and not known & set(units):
        raise BadOptionError(
            f"the scales of {stage.name} on {' or '.join(units)} are unknown "
            f"(known on: {', '.join(sorted(known))}); without a stage, values are in counts"
        )


def known_only(what: str, given: Iterable[str], known: Iterable[str], unit: str) -> None:
    """Raise for names that are not among the known ones; ``what`` is the kind of option, for the message.

    The :class:`~stagewire_virtual.errors.BadOptionError` lists the known names.
    """
    names = sorted(known)
    for name in sorted(given):
        if name not in names:
            choices = f"available: {', '.join(names)}" if names else "none available"
            raise BadOptionError(f"{unit} has no {what} {name} ({choices})")


def several(what: str, given: Iterable[_T]) -> Iterable[_T]:
    """Return ``given`` unchanged; raise for a single item.

    Type checkers accept a string as an iterable of strings, namely of its letters.
    """
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise BadOptionError(f"{what} must be a list; for a single one write {what}=[{given!r}]")
    return given


_Fits = Callable[[Any], bool]


def _whole(value: Any) -> bool:
    return type(value) is int  # excludes True and False


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
        "a stage such as stagewire_apt.stages.Z8 (bench files and the command line accept its name)",
    ),
    "travel": (_none_or(_whole), "a whole number"),
    "position": (_none_or(_whole), "a whole number"),
}
"""For each setting, a check of its type and a description of the expected value."""

_OPTIONS: Final[Mapping[str, tuple[_Fits, str]]] = {
    "seed": (_whole, "a whole number"),
    "model": (_none_or(_is(str)), "a string such as 'KDC101'"),
    "serial_number": (_none_or(_whole), "a whole number of eight digits"),
    "hardware_type": (_none_or(_whole), "a whole number"),
    "stage_id": (_none_or(_whole), "a whole number"),
    "line": (_is(LinkKind), "LinkKind.USB or LinkKind.RS232"),
    "quirks": (_all(AbstractSet, _is(str)), "a set of names"),
    "answer_unsupported": (_is(bool), "True or False"),
    "channels": (_all(tuple, _is(Settings)), "a tuple of Settings"),
    "empty_bays": (_all(AbstractSet, _whole), "a set of whole numbers, which count bays from 1"),
    "strategies": (_texts_by_name, "a mapping such as {'power_on_mode': 'low'}"),
}
"""The same for each option."""


def _check(given: object, kinds: Mapping[str, tuple[_Fits, str]]) -> None:
    for name, (fits, expected) in kinds.items():
        value = getattr(given, name)
        if not fits(value):
            raise BadOptionError(f"{name}: expected {expected}, not {value!r}")
