"""Check the identity of a connected controller by its serial number and its model.

A controller that is newer than the document is used as the unit whose messages it supports, but with its own
scales.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

from stagewire._devices.candidates import (
    DIGITS,
    Candidate,
    candidates,
    clean_model,
    of_a_card,
    owners,
    reported_by,
)
from stagewire._devices.connection import Connection
from stagewire._devices.unit import Alias, Facts, Unit, Unsupported
from stagewire._devices.values import Values
from stagewire._links.usb import plug_number
from stagewire.errors import WrongUnitError

_log = logging.getLogger("stagewire")


def check_identity(connection: Connection[Any], info: Values[Any]) -> None:
    """Store the identity that a controller reported, and select its scales.

    Raise :class:`~stagewire.errors.WrongUnitError` for a controller other than the named one, and
    :class:`~stagewire.errors.UnknownScaleError` for a given travel that cannot be checked on it.
    """
    connection.info = info
    number = getattr(info.message, "serial_number", None)
    if number is None:
        return
    wanted = connection.choices.serial_number
    if wanted is not None and number != wanted:
        raise WrongUnitError(
            f"{connection.url} has serial number {number}, not {wanted}; nothing else was sent to it"
        )
    before = connection.serial_number
    if before is not None and number != before:
        raise WrongUnitError(
            f"{connection.url} now has serial number {number}, but {before} when it was opened: this is "
            "another controller. Check the port, or open this controller as a separate device"
        )
    connection.serial_number = number
    known = connection.facts.candidates()
    if not any(one.prefixes for one in known):  # the registry does not list serial numbers
        return
    found = candidates(known, number, _model(info))
    fitting = [one for one in found if one.unit == connection.unit.name]
    if not fitting:
        raise WrongUnitError(_refusal(connection, known, found, number, _model(info)))
    wanted_model = connection.choices.model
    names = tuple(one.name for one in fitting if wanted_model in (None, one.name))
    if not names:
        raise WrongUnitError(
            f"{connection.url} is {' or '.join(one.name for one in fitting)}, not {wanted_model}: it reports "
            f"{_described(number, _model(info))}; check the port, or open it without model="
        )
    connection.identified(names)
    for alias in connection.aliases:
        _log.warning("%s: %s", connection.url, _described_alias(alias))


def check_number(facts: Facts, unit: Unit, url: str, wanted: int | None) -> None:
    """Check a serial number before the line is opened, because a wrong address can freeze a controller.

    :param wanted: number that the user gave; None: that of the USB plug, if the URL has one.

    Raise :class:`~stagewire.errors.WrongUnitError` for the number of another unit, or of a card in a bay.
    """
    number = plug_number(url) if wanted is None else wanted
    if number is None or unit.kind == "bay":  # the plug is that of the rack
        return
    known = facts.candidates()
    if (why := of_a_card(number, facts.units.values())) is not None:
        raise WrongUnitError(f"{url}: {why}")
    of_prefix = owners(known, number)
    if of_prefix and unit.name not in {one.unit for one in candidates(known, number, "")}:
        names = " or ".join(one.name for one in of_prefix)
        classes = sorted({one.unit for one in of_prefix if one.unit is not None})
        reasons = [
            facts.unsupported[one.name] for one in of_prefix if one.name in facts.unsupported
        ]
        advice = f"open it as {' or '.join(classes)}" if classes else "no class supports it"
        advice += "".join(f"; {one.name}: {one.reason.rstrip('.')}" for one in reasons)
        raise WrongUnitError(
            f"{url} is not a {unit.name}: the serial number {number} belongs to a {names}; {advice}. Nothing "
            "was sent to it"
        )


def unanswered(connection: Connection[Any], error: Exception) -> str:
    """Return why nothing answered the identity request, and what to do."""
    unit, asked = connection.unit, connection.addresses[0]
    bay = " and its bay (bay=)" if unit.kind == "bay" else ""
    others = [f"{other:#04x}" for other in (unit.address, *unit.also_at) if other != asked]
    advice = ""
    if unit.kind == "generic_usb" and others:
        advice = (
            f". Only {asked:#04x} was asked, because a request to a wrong address can freeze a "
            f"controller until it is unplugged. Sources also reach a {unit.name} at "
            f"{' or '.join(others)}: pass one of them as address= to choose it"
        )
    return (
        f"no {unit.name} answers at {connection.url}: {error}. Check that it is switched on and that "
        f"this is its port{bay}, or pass identify=False to open it without this check{advice}"
    )


def _refusal(
    connection: Connection[Any],
    known: Sequence[Candidate],
    found: Sequence[Candidate],
    number: int,
    model: str,
) -> str:
    """Return why a controller is not accepted as the named unit, and what to do."""
    unit = connection.unit.name
    reports = f"it reports {_described(number, model)}"
    of_prefix, of_model = owners(known, number), reported_by(known, model)
    if found:
        why = f"{reports}, as {_listed(connection, found)} does"
        classes = sorted({one.unit for one in found if one.unit is not None})
        reasons = [connection.facts.unsupported.get(one.name) for one in found]
        advice = f"open it as {' or '.join(classes)}" if classes else "no class supports it"
        advice += "".join(f"; {one.name}: {one.reason.rstrip('.')}" for one in reasons if one)
    elif of_prefix:
        belongs = _listed(connection, of_model) if of_model else "no known unit"
        owner = _listed(connection, of_prefix)
        why = f"{reports}; the number belongs to {owner}, but the model to {belongs}"
        advice = "open it by the name on its label"
    else:
        why = f"{reports}; no known unit has serial numbers that begin with {number // DIGITS}"
        advice = "check the label of the controller"
    return (
        f"{connection.url} is not a {unit}: {why}; {advice}, or pass identify=False to use it as a {unit} "
        f"without this check, with the scales of a {unit}"
    )


def _described(number: int, model: str) -> str:
    return f"serial number {number} and {f'model {model!r}' if model else 'no model'}"


def _listed(connection: Connection[Any], found: Sequence[Candidate]) -> str:
    """Return the names of units, with titles for those newer than the document, or not supported."""
    facts = connection.facts
    aliases: dict[str, Alias | Unsupported] = {**facts.aliases, **facts.unsupported}
    return " or ".join(
        f"{one.name} ({aliases[one.name].title})" if one.name in aliases else one.name
        for one in found
    )


def _model(info: Values[Any]) -> str:
    return clean_model(getattr(info.message, "model_number", ""))


def _described_alias(alias: Alias) -> str:
    """Return what a newer controller is, and where its messages and scales come from."""
    source = f" ({alias.source})" if alias.source else ""
    scales = "; ".join(f"{group}, {source}" for group, source in alias.scales.items())
    return (
        f"{alias.name}: {alias.title}, newer than the document; uses the messages of {alias.like}, which may "
        f"differ{source}; scales: {scales or 'unknown'}"
    )


def described_identity(connection: Connection[Any]) -> list[str]:
    """Return the lines of a description of the identity of a controller."""
    info = connection.info
    if info is None:
        if connection.facts.identity is None:
            return []
        lines = ["identity not read"]
    else:
        lines = _reported(info)
    if len(connection.names) > 1:
        lines.append(f"may be {' or '.join(connection.names)}: pass model= to open to choose one")
    return lines + [_described_alias(alias) for alias in connection.aliases]


def firmware_of(info: Values[Any] | None) -> tuple[int, ...] | None:
    """Return the version of the firmware that a controller reported; None if it is unknown."""
    version = getattr(info.message, "software_version", None) if info is not None else None
    if not isinstance(version, bytes):
        return None
    return tuple(reversed(version[:3]))  # minor, interim, major; the fourth is unused


def _reported(info: Values[Any]) -> list[str]:
    message = info.message
    number, model = getattr(message, "serial_number", None), _model(info)
    parts = [] if number is None else [f"serial number {number}"]
    if model:
        parts.append(f"model {model}")
    version = firmware_of(info)
    if version is not None:
        parts.append(f"firmware {'.'.join(map(str, version))}")
    return [", ".join(parts)] if parts else []
