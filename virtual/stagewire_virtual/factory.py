"""Factories of virtual controllers: ``stagewire_virtual.TDC001`` is called with the options of the unit.

A :class:`Blueprint` has everything that a virtual controller is made from, except its clock. ``_KINDS`` has
the instrument class of each protocol that supports virtual controllers.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from stagewire_virtual.asi_ms2000.instrument import Ms2000Instrument
from stagewire_virtual.clock import Clock
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.errors import BadOptionError, UnknownUnitError, VirtualError
from stagewire_virtual.faults.fault import Fault, parse_faults
from stagewire_virtual.faults.link import FaultyLink
from stagewire_virtual.instrument import Instrument, Unit, all_units, find_unit
from stagewire_virtual.options import LinkKind, Options, Settings, parse_link_kind, several
from stagewire_virtual.replay import load_replay
from stagewire_virtual.thorlabs_apt.instrument import AptInstrument, rack_of
from stagewire_virtual.thorlabs_apt.rack import RACK

if TYPE_CHECKING:
    from stagewire import Stage
    from stagewire_virtual.clock import SteppedClock

_KINDS: Final[dict[str, type[Ms2000Instrument] | type[AptInstrument]]] = {
    "asi_ms2000": Ms2000Instrument,
    "thorlabs_apt": AptInstrument,
}

_DEFAULT: Final = Options()


def make_instrument(unit: Unit, clock: Clock, options: Options = _DEFAULT) -> Instrument:
    """Make the virtual controller of a unit.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an option that the unit does not support, and
    :class:`~stagewire_virtual.errors.VirtualError` if the unit cannot be simulated yet, or its protocol has
    no virtual controllers.
    """
    if reason := why_not(unit):
        raise VirtualError(reason)
    return _KINDS[unit.protocol.name](unit, clock, options)


def why_not(unit: Unit) -> str:
    """Return why a unit has no virtual controller; empty if it has one."""
    kind = _KINDS.get(unit.protocol.name)
    if kind is None:
        return (
            f"{unit.name} uses {unit.protocol.name}, which has no virtual controllers "
            f"(supported protocols: {', '.join(_KINDS)})"
        )
    return kind.why_not(unit)


def simulated_units() -> dict[str, Unit]:
    """Return the units of all installed protocols that can be simulated, by name."""
    return dict(_simulated())


@functools.cache
def _simulated() -> Mapping[str, Unit]:
    return {name: unit for name, unit in all_units().items() if not why_not(unit)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Blueprint:
    """A unit or a rack of modules, with its options.

    :param unit: the unit to make; None for a rack of modules.
    :param bays: the module in each bay of a rack of modules; None is an empty bay.
    :param options: the options of the unit.
    :param faults: the faults on its line.
    """

    unit: Unit | None
    bays: tuple[Unit | None, ...] = ()
    options: Options = field(default_factory=Options)
    faults: tuple[Fault, ...] = ()

    def make(self, clock: Clock) -> Instrument | FaultyLink:
        """Make a controller; with faults, wrapped in a :class:`FaultyLink`.

        Raises :class:`~stagewire_virtual.errors.VirtualError` for an option that the unit does not support.
        """
        instrument: Instrument
        if self.unit is None:
            instrument = rack_of(self.bays, clock, self.options)
        else:
            instrument = make_instrument(self.unit, clock, self.options)
        if not self.faults:
            return instrument
        return FaultyLink(instrument, self.faults, self.options.seed)


@dataclass(frozen=True, slots=True)
class Factory:
    """A callable that makes virtual controllers of one unit."""

    unit: Unit

    def __call__(
        self,
        *,
        stage: Stage | None = None,
        travel: int | None = None,
        position: int | None = None,
        channels: Sequence[Settings] = (),
        seed: int = 0,
        model: str | None = None,
        serial_number: int | None = None,
        hardware_type: int | None = None,
        stage_id: int | None = None,
        line: LinkKind | str = LinkKind.USB,
        quirks: Iterable[str] = (),
        answer_unsupported: bool = False,
        empty_bays: Iterable[int] = (),
        strategies: Mapping[str, str] | None = None,
        clock: SteppedClock | None = None,
        faults: Iterable[Fault | str] = (),
    ) -> VirtualController:
        """Make a virtual controller in memory.

        :param stage: the stage on every channel. ``travel`` and ``position`` also apply to every channel; see
            :class:`~stagewire_virtual.options.Settings`.
        :param channels: the settings of each channel, if the channels differ.
        :param clock: the clock, which the test advances; a new one by default.
        :param faults: the faults on the line; see :func:`~stagewire_virtual.faults.fault.parse_fault`.

        :class:`~stagewire_virtual.options.Options` describes all other parameters. Raises
        :class:`~stagewire_virtual.errors.VirtualError` for an option that the unit does not support.
        """
        settings = Settings(stage=stage, travel=travel, position=position)
        if settings != Settings():
            if channels:
                raise BadOptionError(
                    "give either stage, travel and position for every channel, or channels; not both"
                )
            channels = (settings,)
        options = Options(
            seed=seed,
            model=model,
            serial_number=serial_number,
            hardware_type=hardware_type,
            stage_id=stage_id,
            line=parse_link_kind(line),
            quirks=frozenset(several("quirks", quirks)),
            answer_unsupported=answer_unsupported,
            channels=tuple(several("channels", channels)),
            empty_bays=frozenset(several("empty_bays", empty_bays)),
            strategies={} if strategies is None else strategies,
        )
        blueprint = Blueprint(unit=self.unit, options=options, faults=parse_faults(faults))
        return VirtualController(blueprint.make, clock, self.unit.name)


def factory_of(name: str) -> Factory:
    """Return the factory of a unit by its exact name, for the attribute lookup of a module.

    Raises :class:`AttributeError` for an unknown unit, and for one that cannot be simulated yet.
    """
    unit = all_units().get(name)
    if unit is None:
        raise AttributeError(str(UnknownUnitError(name, sorted(_simulated()))), name=name)
    if reason := why_not(unit):
        raise AttributeError(reason, name=name)
    return Factory(unit)


def rack(
    *bays: str | None,
    channels: Sequence[Settings] = (),
    seed: int = 0,
    model: str | None = None,
    serial_number: int | None = None,
    hardware_type: int | None = None,
    stage_id: int | None = None,
    line: LinkKind | str = LinkKind.USB,
    quirks: Iterable[str] = (),
    answer_unsupported: bool = False,
    clock: SteppedClock | None = None,
    faults: Iterable[Fault | str] = (),
) -> VirtualController:
    """Make a rack of modules in memory: ``rack("MST601", None, "MPZ601")``.

    :param bays: the name of the module in each bay; None is an empty bay.
    :param channels: the settings of all channels, bay by bay; the last entry also applies to all further
        channels.

    :class:`Factory` describes all other parameters. Raises :class:`~stagewire_virtual.errors.VirtualError`
    for a unit that is not a module, and for an option that the rack does not support.
    """
    for bay in bays:
        if not isinstance(bay, str | None):
            raise BadOptionError(
                f'a bay must be the name of a module or None, as in rack("MST601", None), not {bay!r}'
            )
    modules = tuple(find_unit(name) if name else None for name in bays)
    options = Options(
        seed=seed,
        model=model,
        serial_number=serial_number,
        hardware_type=hardware_type,
        stage_id=stage_id,
        line=parse_link_kind(line),
        quirks=frozenset(several("quirks", quirks)),
        answer_unsupported=answer_unsupported,
        channels=tuple(several("channels", channels)),
    )
    blueprint = Blueprint(unit=None, bays=modules, options=options, faults=parse_faults(faults))
    return VirtualController(blueprint.make, clock, RACK)


def replay_of(
    capture: str | Path, *, lenient: bool = False, clock: SteppedClock | None = None
) -> VirtualController:
    """Play back the controller's side of a recorded session in memory; see :mod:`stagewire_virtual.replay`.

    :param lenient: if a request differs from the next recorded one, continue at its next occurrence in the
        recording.

    Raises :class:`~stagewire.errors.StagewireError` if the file is not a capture, and :class:`OSError` if it
    cannot be read.
    """
    path = Path(capture)
    return VirtualController(
        lambda time: load_replay(path, time, lenient=lenient), clock, path.name
    )
