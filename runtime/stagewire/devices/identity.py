"""Whether the controller at the other end is the one that was named, by its serial number.

The first two of its eight digits tell the unit. Units of one family share prefixes, and for some the document
gives none: what cannot be told is let pass. A unit that is newer than the document is named as what it is.
"""

from __future__ import annotations

import logging
from typing import Any, Final

from stagewire.devices.connection import Connection
from stagewire.devices.unit import Facts, Unit
from stagewire.devices.values import Values
from stagewire.errors import WrongUnitError

__all__ = ["check_identity", "described_identity"]

_log = logging.getLogger("stagewire")

_DIGITS: Final = 1_000_000
"""A serial number is a prefix of two digits, which tells the unit, and six more."""


def check_identity(connection: Connection, info: Values[Any]) -> None:
    """Note what a controller says that it is.

    Raises :class:`~stagewire.errors.WrongUnitError` for another one than was named.
    """
    connection.info = info
    number = getattr(info.message, "serial_number", None)
    if number is None:
        return
    wanted = connection.choices.serial_number
    if wanted is not None and number != wanted:
        raise WrongUnitError(
            f"{connection.url} has the serial number {number}, not {wanted}; nothing else was asked of it"
        )
    facts, unit, prefix = connection.facts, connection.unit, number // _DIGITS
    known = facts.prefixes.get(prefix)
    if known is not None and known.unit != unit.name and known.unit not in facts.units:
        if known.like != unit.name:
            raise WrongUnitError(_wrong(connection, number, known.unit, known.note, known.like))
        connection.known_as = known
        _log.warning("%s", described_newer(connection))
        return
    owners = _owners(facts, prefix)
    if owners and not any(_alike(unit, owner) for owner in owners):
        names = " or ".join(owner.name for owner in owners)
        raise WrongUnitError(_wrong(connection, number, names, "", owners[0].name))


def _owners(facts: Facts, prefix: int) -> list[Unit]:
    """Return the units whose serial numbers begin so."""
    known = facts.prefixes.get(prefix)
    return [
        unit
        for unit in facts.units.values()
        if prefix in (unit.usb_prefix, unit.card_usb_prefix)
        or (known is not None and known.unit == unit.name)
    ]


def _alike(unit: Unit, owner: Unit) -> bool:
    """Say whether a prefix of one unit may be that of another."""
    if unit is owner:
        return True
    if unit.usb_prefix is not None or unit.kind != owner.kind:
        return False
    return unit.family == owner.family or (unit.status, unit.stages) == (owner.status, owner.stages)


def _wrong(connection: Connection, number: int, names: str, note: str, like: str) -> str:
    note = f" ({note})" if note else ""
    advice = f"open it as {like}" if like else "no class is for it"
    return (
        f"{connection.url} is no {connection.unit.name}: the serial number {number} is that of "
        f"{names}{note}; {advice}, or give identify=False to use it all the same"
    )


def described_newer(connection: Connection) -> str:
    """Say what a controller is that the document does not know."""
    known = connection.known_as
    assert known is not None
    return f"{known.unit}: {known.note}; messages of {known.like} apply where they are the same"


def described_identity(connection: Connection) -> list[str]:
    """Say what a controller says that it is, line by line."""
    info = connection.info
    if info is None:
        return [] if connection.facts.identity is None else ["it was not asked what it is"]
    message = info.message
    parts = []
    for name, title in (("serial_number", "serial number"), ("model_number", "model")):
        value = getattr(message, name, None)
        if value is not None:
            parts.append(f"{title} {str(value).strip()}")
    version = getattr(message, "software_version", None)
    if isinstance(version, bytes):  # minor, interim, major; the fourth is unused
        parts.append(f"firmware {'.'.join(str(part) for part in reversed(version[:3]))}")
    lines = [", ".join(parts)] if parts else []
    if connection.known_as is not None:
        lines.append(described_newer(connection))
    return lines
