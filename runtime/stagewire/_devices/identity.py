"""Whether the controller at the other end is the one that was named, by its serial number and its model.

A controller that is newer than the document is used as the unit whose messages it takes, with its own scales.
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
    owners,
    reported_by,
)
from stagewire._devices.connection import Connection
from stagewire._devices.unit import Alias
from stagewire._devices.values import Values
from stagewire.errors import WrongUnitError

_log = logging.getLogger("stagewire")


def check_identity(connection: Connection[Any], info: Values[Any]) -> None:
    """Note what a controller says that it is, and which scales hold on it.

    Raises :class:`~stagewire.errors.WrongUnitError` for another controller than was named, and
    :class:`~stagewire.errors.UnknownScaleError` where a travel was given that cannot be checked on it.
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
    before = connection.serial_number
    if before is not None and number != before:
        raise WrongUnitError(
            f"{connection.url} has the serial number {number} now, and had {before} when it was opened: this "
            "is another controller. Check the port, or open that controller as a device of its own"
        )
    connection.serial_number = number
    known = connection.facts.candidates()
    if not any(one.prefixes for one in known):  # a registry that says nothing of serial numbers
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
            f"{_described(number, _model(info))}; check the port, or leave model= out"
        )
    connection.identified(names)
    for alias in connection.aliases:
        _log.warning("%s: %s", connection.url, _described_alias(alias))


def _refusal(
    connection: Connection[Any],
    known: Sequence[Candidate],
    found: Sequence[Candidate],
    number: int,
    model: str,
) -> str:
    """Say why a controller is not used as the unit that was named, and what to do."""
    unit = connection.unit.name
    reports = f"it reports {_described(number, model)}"
    of_prefix, of_model = owners(known, number), reported_by(known, model)
    if found:
        why = f"{reports}, which are those of {_listed(connection, found)}"
        classes = sorted({one.unit for one in found if one.unit is not None})
        advice = f"open it as {' or '.join(classes)}" if classes else "no class fits it"
    elif of_prefix:
        belongs = _listed(connection, of_model) if of_model else "no unit that is known"
        owner = _listed(connection, of_prefix)
        why = f"{reports}; the number is that of {owner}, the model that of {belongs}"
        advice = "open it by the name on its label"
    else:
        why = f"{reports}; no unit is known whose serial numbers begin with {number // DIGITS}"
        advice = "see the label of the controller"
    return (
        f"{connection.url} is not a {unit}: {why}; {advice}, or give identify=False to use it as a {unit} "
        f"without asking, with the scales of a {unit}"
    )


def _described(number: int, model: str) -> str:
    return f"the serial number {number} and {f'the model {model!r}' if model else 'no model'}"


def _listed(connection: Connection[Any], found: Sequence[Candidate]) -> str:
    """Name units, and say of newer ones what they are."""
    aliases = connection.facts.aliases
    return " or ".join(
        f"{one.name} ({aliases[one.name].title})" if one.name in aliases else one.name
        for one in found
    )


def _model(info: Values[Any]) -> str:
    return clean_model(getattr(info.message, "model_number", ""))


def _described_alias(alias: Alias) -> str:
    """Say what a newer controller is, and where its messages and its scales come from."""
    source = f" ({alias.source})" if alias.source else ""
    scales = "; ".join(f"{group}, {source}" for group, source in alias.scales.items())
    return (
        f"{alias.name}: {alias.title}, newer than the document; messages of {alias.like} apply where they "
        f"are the same{source}; scales: {scales or 'none is known'}"
    )


def described_identity(connection: Connection[Any]) -> list[str]:
    """Say what a controller says that it is, line by line."""
    info = connection.info
    if info is None:
        if connection.facts.identity is None:
            return []
        lines = ["it was not asked what it is"]
    else:
        lines = _reported(info)
    if len(connection.names) > 1:
        lines.append(f"it may be {' or '.join(connection.names)}: give model= to say which")
    return lines + [_described_alias(alias) for alias in connection.aliases]


def _reported(info: Values[Any]) -> list[str]:
    message = info.message
    number, model = getattr(message, "serial_number", None), _model(info)
    parts = [] if number is None else [f"serial number {number}"]
    if model:
        parts.append(f"model {model}")
    version = getattr(message, "software_version", None)
    if isinstance(version, bytes):  # minor, interim, major; the fourth is unused
        parts.append(f"firmware {'.'.join(str(part) for part in reversed(version[:3]))}")
    return [", ".join(parts)] if parts else []
