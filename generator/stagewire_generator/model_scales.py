"""The part of the resolved registry with scales: quantities, and stages on controllers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from stagewire_generator.diagnostics import Place

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Factor:
    """An exact scale; the key gives its direction, as in the registry and its JSON."""

    key: str  # counts_per_mm, us_per_count ...
    value: Fraction
    printed: str
    source: str
    page: int | None
    note: str = ""
    overlay: str = field(default="", compare=False)  # whose document has the page

    @property
    def counts_per_unit(self) -> Fraction:
        """Counts per unit, in either direction of the key."""
        return 1 / self.value if self.key.endswith("_per_count") else self.value


@dataclass(frozen=True, slots=True)
class Conflict:
    """Scales of sources that contradict each other; the user chooses one."""

    factors: Mapping[str, Factor]  # source -> its factor


@dataclass(frozen=True, slots=True)
class Quantity:
    """A unit and the rule that converts counts to it."""

    name: str
    unit: str
    page: int
    summary: str
    factor: Factor | None
    rule: Json  # such as {"by": "stage"}; {} if there is a factor
    place: Place
    overlay: str = ""
    rotary_unit: str = ""  # its unit on a rotary stage

    @property
    def by_unit(self) -> Mapping[str, Factor]:
        """Unit -> its scale, if the scale depends on the unit."""
        units = self.rule.get("units", {})
        return {name: scale for name, scale in units.items() if isinstance(scale, Factor)}

    def unit_on(self, stage: Stage) -> str:
        """Return the unit of the quantity on a stage; empty if it has none there."""
        return self.rotary_unit if stage.rotary else self.unit


@dataclass(frozen=True, slots=True)
class Controller:
    """A group of units that have the same scales for a stage."""

    name: str
    units: tuple[str, ...]
    place: Place
    overlay: str = ""
    aliases: Mapping[str, str] = field(default_factory=dict)  # newer unit -> source of its scales
    page: int | None = None

    @property
    def members(self) -> tuple[str, ...]:
        """All units of the group, including those newer than the document."""
        return (*self.units, *self.aliases)


@dataclass(frozen=True, slots=True)
class Limit:
    """A limit that a stage must not exceed."""

    value: Fraction | None  # None: the travel is endless
    unit: str  # mm | mm/s | mm/s^2, or the same with deg; empty if the travel is endless
    source: str
    page: int | None
    note: str = ""
    overlay: str = field(default="", compare=False)  # whose document has the page


@dataclass(frozen=True, slots=True)
class StageId:
    """The number of a stage in a field of a message."""

    id: int
    source: str
    page: int | None
    overlay: str = field(default="", compare=False)  # whose document has the page


@dataclass(frozen=True, slots=True)
class Stage:
    """A stage: its exact factors for each controller, and its limits; a text states why one is unknown.

    If sources contradict each other, a scale is a conflict.
    """

    name: str
    title: str
    page: int
    scales: Mapping[str, Mapping[str, Factor | Conflict | str]]
    place: Place
    overlay: str = ""
    limits: Mapping[str, Limit | str] = field(default_factory=dict)
    catalogue: tuple[str, ...] = ()  # names in the catalogue of the vendor
    rotary: bool = False
    axis: str = ""  # of a device with several axes, each a stage of its own
    ids: Mapping[str, StageId] = field(default_factory=dict)  # MESSAGE.field -> its number there
    defaults: Mapping[str, Mapping[str, str]] = field(
        default_factory=dict
    )  # MESSAGE -> field -> value
    defaults_source: str = ""
    defaults_note: str = ""
