"""A check, and the kind that it belongs to; :mod:`stagewire_conformance.device` says how one is written."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial

__all__ = ["Check", "Kind", "Need"]


class Need(StrEnum):
    """What a check does beyond asking, so that it runs only where that was allowed."""

    SETTINGS = "settings"
    MOTION = "motion"
    EEPROM = "eeprom"


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A family of checks: one row of the table of what the suite looks at.

    :param name: such as ``answers``; the ids of its checks begin with it.
    :param title: one sentence that holds for a controller that passes.
    :param rules: the rules of the protocol that it holds a controller to, by their slugs.
    :param make: makes its checks of what is declared and of what is allowed. Their ids depend on what is
        declared alone.
    """

    name: str
    title: str
    rules: tuple[str, ...]
    make: Callable[[Declared, Permissions], Iterable[Check]]


@dataclass(frozen=True, kw_only=True)
class Check:
    """One thing that a controller has to do, and how it is seen.

    :param id: ``KIND[/PLACE][/MESSAGE][/…]``, such as ``answers/0x50/MOT_REQ_VELPARAMS/1``; the same in every
        run, and unique in it.
    :param title: what the controller has to do, in one sentence.
    :param messages: the messages that it covers.
    :param run: looks at it, and says to the trial what it finds.
    :param needs: what has to be allowed.
    :param does: of one with needs: what will be done, in plain words, said before the run.
    :param seconds: about how long it takes.
    :param rules: the rules that it is about; left empty, :func:`.plan` takes those of its kind that are about
        its messages or about none.
    :param skip: why it is skipped, which only the PICS can say; empty: it is not.
    :param lacks: why what was allowed is not enough, so that it is not run; empty: it is.
    :param kind: set by :func:`.plan`.
    """

    id: str
    title: str
    messages: tuple[str, ...]
    run: Callable[[Trial], None]
    needs: frozenset[Need] = frozenset()
    does: str = ""
    seconds: float = 0.1
    rules: tuple[str, ...] = ()
    skip: str = ""
    lacks: str = ""
    kind: Kind | None = field(default=None, repr=False, compare=False)

    @property
    def held_to(self) -> tuple[str, ...]:
        """The rules that the controller is held to, by their slugs."""
        return self.rules or (self.kind.rules if self.kind else ())
