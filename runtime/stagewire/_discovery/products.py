"""What a registry says of a controller whose serial number, or name, is known."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire._codec.protocol import Protocol, usable_protocols
from stagewire._devices.candidates import Candidate, candidates, clean_model, owners

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any


_KINSHIPS = (("address", "family"), ("address", "status", "stages"))
"""Facts that two units of one prefix may have in common; an alias shares prefixes of its family alone."""


@dataclass(frozen=True, slots=True)
class Known:
    """One thing that a controller may be.

    :param name: such as ``TDC001``.
    :param protocol: the protocol that it speaks.
    :param unit: the unit of the registry whose messages it takes; None where none is known to fit.
    :param documented: whether the document names it.
    :param note: what the registry says of it.
    """

    name: str
    protocol: Protocol
    unit: str | None
    documented: bool = True
    note: str = ""

    @property
    def facts(self) -> Mapping[str, Any] | None:
        """The registry's entry of the unit whose messages it takes."""
        return None if self.unit is None else _units(self.protocol).get(self.unit)

    def __str__(self) -> str:
        if self.documented:
            return f"{self.name}: {self.note}" if self.note else self.name
        document = f"not in {_document(self.protocol)}"
        if self.unit is not None:
            return f"{self.name}: known, {document}; messages of {self.unit} apply where they are the same"
        return f"{self.name}: known, {document}; the registry has no messages for it ({self.note})"


def every_unit() -> dict[str, Known]:
    """Return all units of all protocols, by name."""
    return {
        name: Known(name, protocol, name, note=facts["title"])
        for protocol in usable_protocols()
        for name, facts in _units(protocol).items()
    }


def by_name(protocol: Protocol, name: str) -> Known | None:
    """Return what a model number, or a name in any case, stands for; None where nobody knows it."""
    wanted = name.upper()
    if wanted in (units := _units(protocol)):
        return Known(wanted, protocol, wanted, note=units[wanted]["title"])
    return next(
        (_known(protocol, name) for name in _aliases(protocol) if name.upper() == wanted), None
    )


def by_serial_number(protocol: Protocol, serial_number: str) -> list[Known]:
    """Return everything that a serial number may be the number of, by its prefix; often one thing alone.

    Two units may share a prefix, as the BBD102 and the BBD103 do.
    """
    if not (serial_number.isascii() and serial_number.isdigit()):
        return []
    found = owners(_candidates(protocol, "usb_prefix"), int(serial_number))
    return [_known(protocol, one.name) for one in found]


def by_identity(protocol: Protocol, serial_number: int, model: str | bytes) -> list[Known]:
    """Return everything that a controller may be, by its serial number and the model that it reports.

    Nothing is returned where they contradict each other, or where nobody knows the prefix.
    """
    known = _candidates(protocol, "usb_prefix", "card_usb_prefix")
    found = candidates(known, serial_number, clean_model(model))
    return [_known(protocol, one.name) for one in found]


def _known(protocol: Protocol, name: str) -> Known:
    """Return a unit of the document, or one that is newer."""
    facts = _units(protocol).get(name)
    if facts is not None:
        return Known(name, protocol, name, note=facts["title"])
    alias = _aliases(protocol)[name]
    note = alias.get("title") or alias.get("note", "")
    return Known(name, protocol, alias.get("like"), documented=False, note=note)


def _candidates(protocol: Protocol, *prefixes: str) -> list[Candidate]:
    """Return every unit and alias of a protocol.

    :param prefixes: the keys of units that have prefixes of their serial numbers.
    """
    units, found = _units(protocol), []
    entries = protocol.registry().get("known_prefixes", {})
    for name, entry in (*units.items(), *_aliases(protocol).items()):
        unit = name if name in units else entry.get("like")
        facts = units.get(unit or "", {})
        printed = {entry[key] for key in prefixes if key in entry}
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
            )
        )
    return found


def _aliases(protocol: Protocol) -> dict[str, Mapping[str, Any]]:
    """Return the units that are newer than the document, by name."""
    aliases: dict[str, Mapping[str, Any]] = dict(protocol.registry().get("aliases", {}))
    for entry in protocol.registry().get("known_prefixes", {}).values():  # of packages made earlier
        if entry["unit"] not in _units(protocol):
            aliases.setdefault(entry["unit"], entry)
    return aliases


def _units(protocol: Protocol) -> dict[str, Mapping[str, Any]]:
    return {facts["name"]: facts for facts in protocol.registry().get("units", ())}


def _document(protocol: Protocol) -> str:
    document = protocol.registry().get("document", {})
    issue = document.get("issue")
    return f"Issue {issue}" if issue else document.get("title", "the document")
