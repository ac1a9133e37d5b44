"""What a registry says of a controller whose serial number, or name, is known."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire.errors import UnusableProtocolError
from stagewire.protocol import Protocol, available_protocols, load_protocol

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Any

__all__ = ["Known", "by_name", "by_serial_number", "every_unit", "protocols"]

_OWN_DIGITS = 6
"""The last digits of a serial number count the units; what stands before them is the prefix."""


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


def protocols() -> Iterator[Protocol]:
    """Yield the protocols that are installed and can be used."""
    for name in available_protocols():
        try:
            yield load_protocol(name)
        except UnusableProtocolError:  # somebody else's package; the others go on working
            continue


def every_unit() -> dict[str, Known]:
    """Return all units of all protocols, by name."""
    return {
        name: Known(name, protocol, name, note=facts["title"])
        for protocol in protocols()
        for name, facts in _units(protocol).items()
    }


def by_name(protocol: Protocol, name: str) -> Known | None:
    """Return what a model number, or a name in any case, stands for; None where nobody knows it."""
    wanted = name.upper()
    if wanted in (units := _units(protocol)):
        return Known(wanted, protocol, wanted, note=units[wanted]["title"])
    for entry in protocol.registry().get("known_prefixes", {}).values():
        if entry["unit"].upper() == wanted:
            return _known(protocol, entry)
    return None


def by_serial_number(protocol: Protocol, serial_number: str) -> list[Known]:
    """Return everything that a serial number may be the number of, by its prefix; often one thing alone.

    Two units may share a prefix, as the BBD102 and the BBD103 do.
    """
    prefix = serial_number[:-_OWN_DIGITS]
    if not prefix or not (serial_number.isascii() and serial_number.isdigit()):
        return []
    found = [
        Known(name, protocol, name, note=facts["title"])
        for name, facts in _units(protocol).items()
        if facts.get("usb_prefix") == int(prefix)
    ]
    entry = protocol.registry().get("known_prefixes", {}).get(prefix)
    return found if found or entry is None else [_known(protocol, entry)]


def _known(protocol: Protocol, entry: Mapping[str, Any]) -> Known:
    """Return what the registry lists beside the document: a later unit, or the prefix of a documented one."""
    name = entry["unit"]
    facts = _units(protocol).get(name)
    if facts is not None:
        return Known(name, protocol, name, note=facts["title"])
    return Known(name, protocol, entry.get("like"), documented=False, note=entry.get("note", ""))


def _units(protocol: Protocol) -> dict[str, Mapping[str, Any]]:
    return {facts["name"]: facts for facts in protocol.registry().get("units", ())}


def _document(protocol: Protocol) -> str:
    document = protocol.registry().get("document", {})
    issue = document.get("issue")
    return f"Issue {issue}" if issue else document.get("title", "the document")
