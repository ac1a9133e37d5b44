"""Look up controllers in the registries, by serial number or name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from stagewire._codec.protocol import Protocol, usable_protocols
from stagewire._devices.candidates import (
    Candidate,
    candidates,
    clean_model,
    of_a_card,
    owners,
)

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any


class _Numbers(NamedTuple):
    """The prefixes of the serial numbers of a unit, and of its cards."""

    name: str
    usb_prefix: int | None
    card_usb_prefix: int | None


_KINSHIPS = (("address", "family"), ("address", "status", "stages"))
"""Facts that units with the same prefix may have in common; for an alias only the first, its family."""


@dataclass(frozen=True, slots=True)
class Known:
    """A unit or alias that a controller may be.

    :param name: name, such as ``TDC001``.
    :param protocol: its protocol.
    :param unit: unit of the registry whose messages it supports; None if none is known.
    :param documented: whether the document contains it.
    :param note: title or note in the registry.
    :param reason: why it is not supported; empty if it is, or if no reason is known.
    """

    name: str
    protocol: Protocol
    unit: str | None
    documented: bool = True
    note: str = ""
    reason: str = ""

    @property
    def facts(self) -> Mapping[str, Any] | None:
        """The registry entry of the unit whose messages it supports."""
        return None if self.unit is None else _units(self.protocol).get(self.unit)

    def __str__(self) -> str:
        if self.reason:
            return f"{self.name} ({self.note}): not supported: {self.reason}"
        if self.documented:
            return f"{self.name}: {self.note}" if self.note else self.name
        document = f"not in {_document(self.protocol)}"
        if self.unit is not None:
            return f"{self.name}: {document}; uses the messages of {self.unit}, which may differ"
        return f"{self.name}: {document}; the registry has no messages for it ({self.note})"


def every_unit() -> dict[str, Known]:
    """Return all units of all protocols, by name."""
    return {
        name: Known(name, protocol, name, note=facts["title"])
        for protocol in usable_protocols()
        for name, facts in _units(protocol).items()
    }


def by_name(protocol: Protocol, name: str) -> Known | None:
    """Return the unit or alias with a name or model number, in any case; None if it is unknown."""
    wanted = name.upper()
    if wanted in (units := _units(protocol)):
        return Known(wanted, protocol, wanted, note=units[wanted]["title"])
    others = (*_aliases(protocol), *_unsupported(protocol))
    return next((_known(protocol, name) for name in others if name.upper() == wanted), None)


def by_serial_number(protocol: Protocol, serial_number: str) -> list[Known]:
    """Return the units and aliases that a serial number may belong to, by its prefix.

    Often there is only one, but units may share a prefix, such as the BBD102 and the BBD103.
    """
    if not (serial_number.isascii() and serial_number.isdigit()):
        return []
    found = owners(_candidates(protocol, "usb_prefix"), int(serial_number))
    return [_known(protocol, one.name) for one in found]


def by_identity(protocol: Protocol, serial_number: int, model: str | bytes) -> list[Known]:
    """Return the units and aliases that a controller may be, by its serial number and reported model.

    The list is empty if these contradict each other, or if the prefix is unknown.
    """
    known = _candidates(protocol, "usb_prefix", "card_usb_prefix")
    found = candidates(known, serial_number, clean_model(model))
    return [_known(protocol, one.name) for one in found]


def card_of(protocol: Protocol, serial_number: str) -> str | None:
    """Return that a serial number is that of a card in a rack, and what to do; None for other numbers."""
    if not (serial_number.isascii() and serial_number.isdigit()):
        return None
    return of_a_card(
        int(serial_number),
        [
            _Numbers(name, facts.get("usb_prefix"), facts.get("card_usb_prefix"))
            for name, facts in _units(protocol).items()
        ],
    )


def _known(protocol: Protocol, name: str) -> Known:
    """Return a unit or alias by its exact name."""
    facts = _units(protocol).get(name)
    if facts is not None:
        return Known(name, protocol, name, note=facts["title"])
    if (entry := _unsupported(protocol).get(name)) is not None:
        title, reason = entry["title"], entry["reason"]
        return Known(name, protocol, None, documented=False, note=title, reason=reason)
    alias = _aliases(protocol)[name]
    note = alias.get("title") or alias.get("note", "")
    return Known(name, protocol, alias.get("like"), documented=False, note=note)


def _candidates(protocol: Protocol, *prefixes: str) -> list[Candidate]:
    """Return every unit, alias and unsupported unit of a protocol.

    :param prefixes: keys of the prefixes of serial numbers in a unit.
    """
    units, found = _units(protocol), []
    entries = protocol.registry().get("known_prefixes", {})
    alike = {
        int(prefix)
        for prefix, shared in entries.items()
        if shared.get("distinguished_by", "model") != "model"
    }
    everything = (*units.items(), *_aliases(protocol).items(), *_unsupported(protocol).items())
    for name, entry in everything:
        unit = name if name in units else entry.get("like")
        facts = units.get(unit or "", {})
        printed = {entry[key] for key in prefixes if key in entry}
        printed |= {*entry.get("prefixes", ())}
        known = {
            int(prefix)
            for prefix, shared in entries.items()
            if name in (shared["unit"], *shared.get("shared_with", ()))
        }
        kinships = tuple(
            tuple(str(facts.get(key)) for key in keys)
            for keys in (_KINSHIPS if name in units else _KINSHIPS[:1])
        )
        found.append(
            Candidate(
                name,
                unit,
                tuple(printed | known),
                tuple(entry.get("reported_as", ())),
                kinships if facts else (),
                tuple(alike & (printed | known)),
            )
        )
    return found


def _aliases(protocol: Protocol) -> dict[str, Mapping[str, Any]]:
    """Return the units that are newer than the document, by name."""
    aliases: dict[str, Mapping[str, Any]] = dict(protocol.registry().get("aliases", {}))
    for entry in (
        protocol.registry().get("known_prefixes", {}).values()
    ):  # packages generated earlier
        if entry["unit"] not in {*_units(protocol), *_unsupported(protocol)}:
            aliases.setdefault(entry["unit"], entry)
    return aliases


def _unsupported(protocol: Protocol) -> dict[str, Mapping[str, Any]]:
    """Return the units that are known but cannot be used, by name."""
    return dict(protocol.registry().get("unsupported", {}))


def _units(protocol: Protocol) -> dict[str, Mapping[str, Any]]:
    return {facts["name"]: facts for facts in protocol.registry().get("units", ())}


def _document(protocol: Protocol) -> str:
    document = protocol.registry().get("document", {})
    issue = document.get("issue")
    return f"Issue {issue}" if issue else document.get("title", "the document")
