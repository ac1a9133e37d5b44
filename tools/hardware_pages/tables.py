"""Tables of units and stages in Markdown, from the registry and the list of pages."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from stagewire_generator.model import Json, Message, Protocol
from stagewire_generator.model_evidence import ordered
from stagewire_generator.model_scales import Conflict, Factor, Limit, Stage

_SITE = "https://github.com/stagewire/stagewire/blob/main/docs/hardware"
_TRIAL = "hardware_trial"
_CLASSES = {
    "hardware_trial": "tried on hardware",
    "hardware_frames": "frames recorded by others",
    "vendor_program": "vendor's program",
    "independent_driver": "public drivers",
}
"""Class of evidence -> its words in a table; the plural covers one driver as well."""
_DEGREES = {"mm": "mm", "deg": "degrees", "mm/s": "mm/s", "deg/s": "degrees/s"}


@dataclass(frozen=True, slots=True)
class Page:
    """A page of ``docs/hardware/``, and the units that it describes."""

    file: str
    title: str
    units: Sequence[str]
    stages: Sequence[str]  # those that README.md names
    calls: Mapping[str, str]  # method -> word

    @classmethod
    def of(cls, entry: Mapping[str, Any], calls: Mapping[str, str]) -> Page:
        """Return the page of an entry in ``pages.toml``, with the usual calls if it has none."""
        return cls(**{"calls": calls, **entry})


class Units:
    """The units of one page, with the part of the registry that describes them.

    :raises ValueError: if the registry lacks a unit or a stage of the page.
    """

    def __init__(self, page: Page, protocol: Protocol) -> None:
        """Find the units, their aliases and their messages."""
        self.page = page
        self.protocol = protocol
        units = protocol.units["units"]
        unknown = sorted({*page.units} - units.keys())
        if unknown:
            raise ValueError(f"{page.file}: the registry has no unit {', '.join(unknown)}")
        self.entries: dict[str, Json] = {name: units[name] for name in page.units}
        self.aliases: dict[str, str] = {
            name: entry["like"]
            for name, entry in protocol.units.get("aliases", {}).items()
            if entry.get("like") in self.entries
        }
        self._stages = {stage.name: stage for stage in protocol.stages}
        known = {name for unit in self.entries.values() for name in unit.get("stages", ())}
        if strange := sorted({*page.stages} - known):
            raise ValueError(
                f"{page.file}: unknown stage for the units of this page: {', '.join(strange)}"
            )

    # The row of README.md.

    def row(self) -> str:
        """Return the row of the page in README.md."""
        names = [f"`{name}`" for name in self.entries]
        names += [f"{name} (`{unit}`)" for name, unit in self.aliases.items()]
        cells = [
            f"[{self.page.title}]({_SITE}/{self.page.file})",
            ", ".join(names),
            ", ".join(_catalogue_name(self._stages[name]) for name in self.page.stages),
            self._works(),
            f"{self._pages(self.entries)}; {self._evidence(self.entries)}",
        ]
        return f"| {' | '.join(cells)} |"

    def _works(self) -> str:
        """Return what every unit can do: its calls, its units of measurement and its status."""
        methods = [self._methods(unit) for unit in self.entries.values()]
        common = set.intersection(*methods)
        parts = [", ".join(word for call, word in self.page.calls.items() if call in common)]
        if "stop" in common:
            parts[0] += ", stop"
        scales = [*self._units_of_measurement()]
        parts += [" or ".join(scales)] if scales else []
        return "; ".join(parts)

    def _messages(self, unit: Json) -> Iterator[Message]:
        names = self.protocol.messages_of(unit)
        return (message for message in self.protocol.messages if message.name in names)

    def _methods(self, unit: Json) -> set[str]:
        """Return the names of the methods of a unit, by the words of its messages."""
        return {
            message.call.get("name") or "_".join(w for w in message.words if w != message.group)
            for message in self._messages(unit)
        }

    def _units_of_measurement(self) -> Iterator[str]:
        """Yield ``mm`` and ``degrees``, as far as a stage of the units has a scale in them."""
        for unit, rotary in (("mm", False), ("degrees", True)):
            stages = [stage for stage in self.stages() if stage.rotary == rotary]
            scales = [scale for stage in stages for scale in self._positions(stage).values()]
            if scales:
                known = any(isinstance(scale, Factor) for scale in scales)
                yield unit if known else f"{unit}, after you choose a source of the scale"

    def _pages(self, names: Iterable[str]) -> str:
        """Return the documents and pages that describe units."""
        found: dict[str, set[int]] = {}
        for name in names:
            unit = self.entries[name]
            lists = [self.protocol.units["lists"][key] for key in self.protocol.lists_of(unit)]
            for overlay, page in (
                (entry.get("overlay", ""), entry["page"]) for entry in (unit, *lists)
            ):
                document = self.protocol.document_name(overlay) or "Its document"
                word = "section" if "sections" in self.protocol.document_of(overlay) else "p."
                found.setdefault(f"{document}, {word}", set()).add(page)
        return "; ".join(f"{place} {_ranges(pages)}" for place, pages in sorted(found.items()))

    def _evidence(self, names: Collection[str]) -> str:
        """Return the classes of the evidence of units, and whether this project has tried them."""
        evidence = self.protocol.evidence
        by_class: dict[str, list[str]] = {}
        for name in names:
            for kind in evidence.classes("units", name):
                by_class.setdefault(kind, []).append(name)
        some = {
            kind: f" ({', '.join(found)})"
            for kind, found in by_class.items()
            if len(found) < len(names)
        }
        words = [_CLASSES[kind] + some.get(kind, "") for kind in ordered(by_class)]
        if _TRIAL not in by_class:
            words.append("not yet tried on hardware")
        return "; ".join(words)

    # The tables of the page.

    def unit_rows(self) -> Iterator[str]:
        """Yield a row for each unit of the page, and each newer unit with its messages."""
        for name, unit in self.entries.items():
            cells = [
                f"{name}: {unit['title']}",
                f"`{name}`",
                ", ".join(self._prefixes(name)) or "unknown",
                self._address(unit),
                self._pages([name]),
                self._evidence([name]),
            ]
            yield f"| {' | '.join(cells)} |"
        for name, like in self.aliases.items():
            title = self.protocol.units["aliases"][name]["title"]
            yield (
                f"| {name}: {title} | `{like}` | {', '.join(self._prefixes(name)) or 'unknown'} |"
                f" as {like} | none | public drivers; not yet tried on hardware |"
            )

    def _prefixes(self, name: str) -> list[str]:
        units = self.protocol.units
        own = (
            [units["units"][name]["usb_prefix"]]
            if "usb_prefix" in units["units"].get(name, {})
            else []
        )
        known = [
            int(prefix)
            for prefix, entry in units.get("known_prefixes", {}).items()
            if name in (entry["unit"], *entry.get("shared_with", ()))
        ]
        return [str(prefix) for prefix in sorted({*own, *known})]

    def _address(self, unit: Json) -> str:
        """Return the addresses of a unit, with those of its bays."""
        addresses = self.protocol.units.get("addresses", {})
        if "address" not in unit:
            return "none"
        first = addresses.get("bays", {}).get("first", 0)
        if unit["address"] == "rack":
            bays = ", ".join(f"0x{first + bay:02X}" for bay in range(unit["bays"]))
            return f"0x{addresses['motherboard']['value']:02X}; bays {bays}"
        if unit["address"] == "bay":
            return f"its bay, from 0x{first:02X}"
        own, found = addresses[unit["address"]]["value"], unit.get("also_at", {})
        used = found.get("preferred", own)
        text = f"0x{used:02X}"
        others = [f"0x{value:02X}" for value in (own, *found.get("addresses", ())) if value != used]
        return f"{text} (also {', '.join(others)})" if others else text

    def stages(self) -> list[Stage]:
        """Return the stages of all units, in the order of the registry."""
        names = {name: 0 for unit in self.entries.values() for name in unit.get("stages", ())}
        return [self._stages[name] for name in names]

    def stage_rows(self) -> Iterator[str]:
        """Yield a row for each stage of the units of the page."""
        for stage in self.stages():
            names = [name for name in stage.catalogue[:1] if name != stage.name]
            cells = [
                f"`{stage.name}`",
                *(names or [""]),
                self._scale(stage),
                _limit(stage, "travel"),
                _limit(stage, "max_velocity"),
            ]
            yield f"| {' | '.join(cells)} |"

    def _positions(self, stage: Stage) -> dict[str, Factor | Conflict]:
        """Return the scale of the position of a stage on each unit of the page that has one."""
        found: dict[str, Factor | Conflict] = {}
        for controller in self.protocol.controllers:
            scale = stage.scales.get(controller.name, {}).get("position")
            for name in controller.units:
                if name in self.entries and isinstance(scale, Factor | Conflict):
                    found[name] = scale
        return found

    def _scale(self, stage: Stage) -> str:
        """Return the counts per mm or degree; with the units if they differ."""
        by_text: dict[str, list[str]] = {}
        positions = self._positions(stage)
        for name in self.entries:
            if name in positions:
                by_text.setdefault(_counts(positions[name]), []).append(name)
        if len(by_text) == 1:
            return next(iter(by_text))
        return (
            "; ".join(f"{text} ({', '.join(names)})" for text, names in by_text.items())
            or "unknown"
        )


def _catalogue_name(stage: Stage) -> str:
    """Return the name of a stage that its owner knows."""
    return stage.catalogue[0] if stage.catalogue else stage.name


def _counts(scale: Factor | Conflict) -> str:
    if isinstance(scale, Conflict):
        choices = (
            f"`{source}` {_decimal(f.counts_per_unit)}" for source, f in scale.factors.items()
        )
        return " or ".join(choices)
    return _decimal(scale.counts_per_unit)


def _limit(stage: Stage, name: str) -> str:
    limit = stage.limits.get(name)
    if not isinstance(limit, Limit):
        return "unknown"
    if limit.value is None:
        return "endless"
    return f"{_decimal(limit.value)} {_DEGREES[limit.unit]}"


def _decimal(value: Fraction) -> str:
    """Return a number with at most three decimals."""
    text = f"{float(round(value, 3)):,.3f}"
    return text.rstrip("0").rstrip(".")


def _ranges(pages: Iterable[int]) -> str:
    """Return page numbers, those that follow one another as a range."""
    runs: list[list[int]] = []
    for page in sorted(pages):
        if runs and page == runs[-1][-1] + 1:
            runs[-1].append(page)
        else:
            runs.append([page])
    return ", ".join(f"{run[0]}–{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
