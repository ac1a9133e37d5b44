"""Write the parameters with which the vendor's program drives a stage, when the user asks for it."""

from __future__ import annotations

from typing import Any

from stagewire._devices.arguments import fields_of
from stagewire._devices.asynchronous.calls import change, check_limits, query
from stagewire._devices.asynchronous.readiness import advise
from stagewire._devices.asynchronous.transport import Endpoint
from stagewire._devices.readiness import faults_in, needs_of
from stagewire._devices.tables import Given, ParameterSet
from stagewire._devices.unit import Need
from stagewire._devices.values import Values
from stagewire.errors import NotReadyError, UnknownScaleError, UnsupportedError
from stagewire.quantities import Stage


async def apply_defaults(endpoint: Endpoint, timeout: float | None) -> tuple[Values[Any], ...]:
    """Write the parameters of the stage on a channel, and return the sets that were written.

    All values are converted and checked before the first set is written.
    """
    what = f"{endpoint.name}: apply_stage_defaults"
    stage = endpoint.scales().stage
    if stage is None:
        raise UnsupportedError(f"{what}: no stage is known; pass stage= to open")
    if not stage.defaults:
        raise UnsupportedError(
            f"{what}: the registry has no default parameters of {stage.name}; set them with the set_ methods"
        )
    tables = endpoint.connection.facts.writers()
    chosen: list[tuple[ParameterSet[Any], dict[str, object]]] = []
    for name, values in stage.defaults.items():
        if name in endpoint.connection.unit.messages:
            table = tables[name]
            given = dict(_keyword(endpoint, table, field, value) for field, value in values.items())
            assert table.set is not None  # it is found by this message
            fields = fields_of(what, table.given, given, endpoint.scales(), of=table.set, some=True)
            check_limits(endpoint, what, table.given, fields)
            chosen.append((table, given))
    await _refuse_unusable(endpoint, what, stage, timeout)
    return tuple([await change(endpoint, table, timeout, given) for table, given in chosen])


async def _refuse_unusable(
    endpoint: Endpoint, what: str, stage: Stage, timeout: float | None
) -> None:
    """Raise an error if the controller would still hold values that cannot work.

    The registry may lack a value that motions need: one of the vendor that exceeds the limit of the stage.
    The value that the controller holds is then kept.

    Raise :class:`~stagewire.errors.NotReadyError`.
    """
    refused: list[str] = []
    causes: list[str] = []
    for need in needs_of(endpoint.connection.unit):
        values = stage.defaults.get(need.table.set.layout.message) if need.table.set else None
        kept = tuple(field for field in need.fields if field not in (values or ()))
        if values is None or not kept:
            continue
        read = (await query(endpoint, need.table, timeout, {})).message
        faults = faults_in(endpoint.connection.unit, Need(need.table, kept), read)
        if faults:
            refused.append(f"{'; '.join(faults)}: {advise(endpoint, need.table.name, faults)}")
            causes += faults
    if refused:
        raise NotReadyError(
            f"{what}: nothing was written, because nothing could move with these values, which the "
            f"registry does not have for {stage.name}: {'; '.join(refused)}",
            tuple(causes),
        )


def _keyword(
    endpoint: Endpoint, table: ParameterSet[Any], field: str, value: str
) -> tuple[str, object]:
    """Return the keyword and the value with which a call sets a field, in the unit of the stage."""
    [entry] = [entry for entry in table.given if entry.field == field]
    if not entry.ways:
        return entry.keyword, value
    return _way(endpoint, entry), value


def _way(endpoint: Endpoint, entry: Given) -> str:
    """Return the keyword in the unit of the stage."""
    unit = endpoint.scales().unit_of(entry.quantity)
    for keyword, way_unit, _ in entry.ways:
        if way_unit == unit:
            return keyword
    raise UnknownScaleError(f"{endpoint.name}: {entry.field} has no keyword in {unit}")
