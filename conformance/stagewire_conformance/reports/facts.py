"""What is worth knowing of a run against a controller: who it is, what was declared and allowed."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.places import Place
from stagewire_conformance.device.report import Report
from stagewire_conformance.reports.model import Fact

__all__ = ["allowed_words", "facts"]


def facts(report: Report) -> tuple[Fact, ...]:
    """Return the facts of a run, in the order in which they are told."""
    return tuple(_facts(report))


def allowed_words(report: Report) -> str:
    """Return in words what the run was allowed to do."""
    allowed = report.allowed
    more = [
        *(["change settings, and restore them"] if allowed.settings else []),
        *([f"move within {allowed.motion}"] if allowed.motion else []),
        *(["write the EEPROM"] if allowed.eeprom else []),
    ]
    return "; ".join(["ask", *more]) if more else "ask, and nothing else"


def _facts(report: Report) -> Iterator[Fact]:
    declared = report.declared
    yield Fact(key="unit", label="Unit", value=declared.unit.name)
    if declared.unit.title:
        yield Fact(key="unit_title", label="Which is", value=declared.unit.title)
    yield Fact(key="url", label="Line", value=report.url)
    for name, value in report.identification.items():
        said = f"It says: {name.replace('_', ' ')}"
        yield Fact(key=f"identification_{name}", label=said, value=value)
    yield Fact(key="declared_by", label="Declared by", value=_declared_by(declared))
    for place in declared.places:
        yield Fact(key=f"place_{place.name}", label=f"At {place.name}", value=_place(place))
    yield Fact(key="line", label="Taken to be on", value=declared.pics.line)
    if declared.firmware:
        yield Fact(key="firmware", label="Firmware", value=declared.firmware)
    yield Fact(key="allowed", label="Allowed", value=allowed_words(report))
    yield Fact(
        key="jitter_ms", label="Lateness of this computer, ms", value=round(report.jitter * 1e3, 3)
    )


def _declared_by(declared: Declared) -> str:
    return "its PICS" if declared.pics.digest else "nobody: taken as the document has it"


def _place(place: Place) -> str:
    """Return in words what is at an address or axis."""
    if place.is_motherboard:
        return "motherboard"
    controllers = {each.scales.controller for each in place.fitted.values()} - {place.unit.name}
    parts = [
        place.unit.name,
        *(f"identified as {controller}" for controller in sorted(controllers)),
    ]
    for channel, fitted in place.fitted.items():
        name = "" if channel is None else f"channel {channel}: "
        stage = fitted.stage.name if fitted.stage else "no stage declared, counts only"
        travel = f", travel {fitted.travel} counts" if fitted.travel else ""
        parts.append(f"{name}{stage}{travel}")
    return "; ".join(parts)
