"""Find the units that a controller may be, from its serial number and the model that it reports.

The same rule is used for opening and for discovery. The prefix of the serial number selects the units that
share it, and the reported model chooses among them. A serial number and a model that contradict each other
match no unit.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

DIGITS: Final = 1_000_000
"""A serial number is a prefix followed by six digits."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A unit of a document, or an alias: a unit that is newer than the document.

    :param name: name, such as ``BSC203``.
    :param unit: unit whose messages it supports, possibly itself; None if unknown.
    :param prefixes: prefixes of its serial numbers; empty if unknown.
    :param reported_as: models that it may report, in addition to its name.
    :param kinships: facts such as its family; units with a fact in common may share prefixes.
    :param alike: prefixes that it shares with units that report the same model.
    """

    name: str
    unit: str | None
    prefixes: tuple[int, ...] = ()
    reported_as: tuple[str, ...] = ()
    kinships: tuple[object, ...] = ()
    alike: tuple[int, ...] = ()

    def reports(self, model: str) -> bool:
        """Return whether it is known to report a model."""
        return model == self.name or model in self.reported_as

    def may_share_prefixes_of(self, owners: Sequence[Candidate]) -> bool:
        """Return whether its prefix is unknown and may be that of a documented unit among ``owners``."""
        return not self.prefixes and any(
            owner.name == owner.unit and not set(self.kinships).isdisjoint(owner.kinships)
            for owner in owners
        )


def clean_model(model: str | bytes) -> str:
    """Return a model for comparison: up to the first NUL, without surrounding blanks."""
    text = model.decode("latin-1") if isinstance(model, bytes) else model
    return text.partition("\0")[0].strip()


def owners(known: Iterable[Candidate], serial_number: int) -> list[Candidate]:
    """Return the candidates that are known to have this prefix of serial numbers."""
    return [one for one in known if serial_number // DIGITS in one.prefixes]


class Rack(Protocol):
    """Facts about the serial numbers of a unit."""

    @property
    def name(self) -> str:
        """Name of the unit."""

    @property
    def usb_prefix(self) -> int | None:
        """Prefix of the number on its USB plug; None if it is unknown."""

    @property
    def card_usb_prefix(self) -> int | None:
        """Prefix of the numbers of its cards; None if it is unknown."""


def of_a_card(serial_number: int, units: Iterable[Rack]) -> str | None:
    """Return that a serial number is that of a card in a rack, and what to do; None for other numbers."""
    prefix = serial_number // DIGITS
    racks = [unit for unit in units if unit.card_usb_prefix == prefix != unit.usb_prefix]
    if not racks:
        return None
    names = " or ".join(rack.name for rack in racks)
    begins = " or ".join(sorted({str(rack.usb_prefix) for rack in racks if rack.usb_prefix}))
    number = f", which begins with {begins}" if begins else ""
    return (
        f"{serial_number} is the serial number of a card in a bay of a {names}. A card has no USB port of "
        f"its own: open the rack by its own serial number{number}, and use bay(1) for the first bay"
    )


def reported_by(known: Iterable[Candidate], model: str) -> list[Candidate]:
    """Return the candidates that are known to report a model."""
    return [one for one in known if one.reports(model)]


def candidates(known: Sequence[Candidate], serial_number: int, model: str) -> list[Candidate]:
    """Return everything that a controller may be; empty if its number and model contradict each other.

    :param known: every unit and alias of the protocol.
    :param model: result of :func:`clean_model`; empty if the controller reports none.

    An unknown prefix matches only a model whose unit has no known prefix. If the model is that of a unit with
    another prefix but the same messages, the controller may be this unit or one with the prefix.
    """
    of_prefix = owners(known, serial_number)
    if not model:
        return of_prefix + [one for one in known if one.may_share_prefixes_of(of_prefix)]
    of_model = reported_by(known, model)
    agreed = [
        one
        for one in of_model
        if one in of_prefix
        or one.may_share_prefixes_of(of_prefix)
        or not (one.prefixes or of_prefix)
    ]
    prefix = serial_number // DIGITS
    if any(one in of_prefix and prefix in one.alike for one in agreed):
        return of_prefix  # the model does not tell them apart
    if agreed:
        sharing = [one for one in agreed if one in of_prefix]
        return sharing or agreed
    units = {one.unit for one in of_prefix} - {None}
    alike = [one for one in of_model if one.unit in units]
    return of_prefix + alike if alike else []
