"""What a device says of itself when it is printed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire._devices.connection import Connection, Name, Place
from stagewire._devices.identity import described_identity

__all__ = ["description"]

_KINDS: Final = {"rack": ("bay", "bays"), "line": ("axis", "axes")}


def description(connection: Connection) -> str:
    """Return several lines: unit, identity, and of each channel its stage, limits and scales."""
    return "\n".join(_lines(connection))


def _lines(connection: Connection) -> Iterator[str]:
    unit = connection.unit
    yield f"{unit.name}: {unit.title}, at {connection.url}"
    for line in described_identity(connection):
        yield f"  {line}"
    alike: dict[tuple[str, ...], list[str]] = {}
    for place, name in connection.places.items():
        alike.setdefault(_channel(connection, place), []).append(_name(name))
    kind, kinds = _KINDS.get(unit.kind, ("channel", "channels"))
    for lines, names in alike.items():
        yield f"  {kind if len(names) == 1 else kinds} {', '.join(names)}: {lines[0]}"
        for line in lines[1:]:
            yield f"    {line}"


def _name(name: Name) -> str:
    return f"{name[0]} channel {name[1]}" if isinstance(name, tuple) else str(name)


def _channel(connection: Connection, place: Place) -> tuple[str, ...]:
    """Name the stage of a channel, then each of its limits and scales."""
    scales, unit = connection.scales(place), connection.unit
    limits = connection.stated_limits(place).described(unit.settable, scales)
    stage = scales.stage
    name = "no stage"
    if stage is not None:
        name = f"stage {stage.name}{' (yours)' if stage.by_user else ''}"
    return name, *limits, *scales.described(unit.quantities)
