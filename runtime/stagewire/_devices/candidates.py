"""Which units a controller may be, by its serial number and the model that it reports.

One rule, for devices that are opened and for controllers that are discovered. The prefix of the serial number
names the units that share it; the reported model chooses among them. A serial number and a model that do not
belong together name nobody.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

DIGITS: Final = 1_000_000
"""A serial number is a prefix, and six more digits."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A unit of a document, or an alias: a unit that is newer than the document.

    :param name: such as ``BSC203``.
    :param unit: the unit whose messages it takes, itself or another one; None where none is known.
    :param prefixes: of its serial numbers; empty where none is known.
    :param reported_as: models that it reports besides its name.
    :param kinships: facts such as its family; two units that have one in common may share prefixes.
    """

    name: str
    unit: str | None
    prefixes: tuple[int, ...] = ()
    reported_as: tuple[str, ...] = ()
    kinships: tuple[object, ...] = ()

    def reports(self, model: str) -> bool:
        """Say whether it is known to report a model."""
        return model == self.name or model in self.reported_as

    def may_share_prefixes_of(self, owners: Sequence[Candidate]) -> bool:
        """Say whether its own prefix is unknown, and may be that of a documented unit among these."""
        return not self.prefixes and any(
            owner.name == owner.unit and not set(self.kinships).isdisjoint(owner.kinships)
            for owner in owners
        )


def clean_model(model: str | bytes) -> str:
    """Return a model as it is compared: up to the first NUL, without blanks around it."""
    text = model.decode("latin-1") if isinstance(model, bytes) else model
    return text.partition("\0")[0].strip()


def owners(known: Iterable[Candidate], serial_number: int) -> list[Candidate]:
    """Return everything whose serial numbers are known to begin as this one."""
    return [one for one in known if serial_number // DIGITS in one.prefixes]


def reported_by(known: Iterable[Candidate], model: str) -> list[Candidate]:
    """Return everything that is known to report a model."""
    return [one for one in known if one.reports(model)]


def candidates(known: Sequence[Candidate], serial_number: int, model: str) -> list[Candidate]:
    """Return everything that a controller may be; nothing where its number and model contradict each other.

    :param known: every unit and alias of the protocol.
    :param model: as :func:`clean_model` returns it; empty where the controller reports none.

    Nothing is returned for a prefix that nobody has either, unless the model is that of a unit whose prefix
    is unknown. A unit of another prefix that takes the same messages, by its model, contradicts nothing and
    decides nothing: the controller may be that unit or one of the prefix.
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
    if agreed:
        sharing = [one for one in agreed if one in of_prefix]
        return sharing or agreed
    units = {one.unit for one in of_prefix} - {None}
    alike = [one for one in of_model if one.unit in units]
    return of_prefix + alike if alike else []
