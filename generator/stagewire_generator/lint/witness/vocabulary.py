"""How a document of commands says what the comparison asks for: its words, units and notations.

They differ from vendor to vendor, so they are data of the witness: ``vocabulary`` in its chapter ``format``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from stagewire_generator.model import Json

__all__ = ["Vocabulary", "amount"]

_PLACEHOLDER = re.compile(r"\{[a-zA-Z0-9:]+\}")


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """The words of one document; without any, nothing that it says in words is understood.

    :param slots: slot -> a word that what is printed of it must have.
    :param whole_slot: a word that tells a range of the size slot from that of the sizes in use.
    :param no_size: what stands for the size of a command that leaves the slot out.
    :param axis: the word behind the name of an axis.
    :param cleared: words that are said of a bit that is 0.
    :param signs: words that say whether a number may be negative.
    :param units: unit as printed -> what one count is, as :func:`amount` writes it.
    :param notations: table -> column -> how it writes a byte, with placeholders in braces.
    """

    slots: Mapping[str, str] = field(default_factory=dict)
    whole_slot: str = ""
    no_size: str = ""
    axis: str = ""
    cleared: frozenset[str] = frozenset()
    signs: Mapping[str, bool] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    notations: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    @classmethod
    def of(cls, data: Json) -> Vocabulary:
        """Make it from its entry in the witness."""
        signs = dict.fromkeys(data["unsigned"], False) | dict.fromkeys(data["signed"], True)
        return cls(
            slots=data["slots"],
            whole_slot=data["whole_slot"],
            no_size=data["no_size"],
            axis=data["axis"],
            cleared=frozenset(data["cleared"]),
            signs=signs,
            units={u["printed"]: amount(Fraction(u["factor"]), u["unit"]) for u in data["units"]},
            notations=data["notations"],
        )

    def signed(self, text: str) -> bool | str:
        """Read the words that say whether a number may be negative; others stay as they are."""
        return self.signs.get(text, text)

    def unit(self, text: str) -> str:
        """Read a unit as the amount that one count is; others stay as they are."""
        return self.units.get(text, text)

    def written(self, table: str, column: str, byte: int, prefix: int = 0, key: str = "") -> str:
        """Return how a column of a table writes a byte.

        :param prefix: the byte before it.
        :param key: what is typed for it.
        """
        known = {"{key}": key}
        for name, value in (("byte", byte), ("prefix", prefix)):
            known |= {f"{{{name}}}": f"{value}", f"{{{name}:02}}": f"{value:02}"}
            known[f"{{{name}:02X}}"] = f"{value:02X}"
        notation = self.notations.get(table, {}).get(column, "")
        return _PLACEHOLDER.sub(lambda found: known.get(found[0], found[0]), notation)


def amount(factor: Fraction, unit: str) -> str:
    """Return what one count is: ``1/10 um``."""
    return f"{factor} {unit}"
