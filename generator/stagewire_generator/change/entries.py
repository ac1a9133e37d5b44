"""The entries of the tables of attributes: how a change of an attribute is compared and named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Names:
    """Names of other things; renaming one of them is not a change here."""

    kind: str
    of: str  # an attribute of Matches: message, enumeration, stage ...


@dataclass(frozen=True, slots=True)
class Sequence:
    """A list whose order matters."""

    kind: str


@dataclass(frozen=True, slots=True)
class Entries:
    """Named entries in plain data."""

    noun: str
    added: str
    removed: str


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """Compared by a separate function, because the result depends on more than the two values."""

    module: str


@dataclass(frozen=True, slots=True)
class Ignored:
    """Not compared; with the reason."""

    why: str


@dataclass(frozen=True, slots=True)
class Data:
    """Plain data: path -> entry, where ``*`` matches any name."""

    table: Mapping[str, str | Names | Sequence | Entries]


Attribute: TypeAlias = str | Names | Sequence | Elsewhere | Ignored | Data
