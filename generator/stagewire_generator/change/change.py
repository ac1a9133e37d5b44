"""A change between two registries, and how grave it is."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

__all__ = ["Change", "ChangeClass", "worst"]


class ChangeClass(enum.IntEnum):
    """How grave a change is; the graver one is the greater."""

    DOC = 1
    """Texts, pages, errata, examples; no program notices."""
    SOURCE = 2
    """Generated names or types change; the bytes do not."""
    WIRE = 3
    """Bytes change or become ambiguous, or are refused where they were sent."""


@dataclass(frozen=True, slots=True)
class Change:
    """One difference between two registries.

    :param kind: slug of the kind, a key of ``KINDS``.
    :param level: the class, which follows from the kind.
    :param where: what it is about, from the outermost in: ``{"message": …, "form": …, "field": …}``.
        Where something was renamed, its new name.
    :param old: as a person reads it; None where there was nothing.
    :param new: as a person reads it; None where there is nothing any more.
    :param text: what it means, in a sentence.
    :param overlay: the overlay of the protocol that changes so; "" for the protocol itself.
    """

    kind: str
    level: ChangeClass
    protocol: str
    where: Mapping[str, str]
    old: str | None
    new: str | None
    text: str
    overlay: str = ""

    @property
    def title(self) -> str:
        """What changes: ``PROTOCOL``, or ``PROTOCOL/OVERLAY``."""
        return f"{self.protocol}/{self.overlay}" if self.overlay else self.protocol


def worst(changes: Iterable[Change]) -> ChangeClass | None:
    """Return the gravest class among the changes; None if there are none."""
    return max((change.level for change in changes), default=None)
