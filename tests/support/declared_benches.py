"""A controller as its vendor declares it, with everything allowed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import allowances
from stagewire_conformance.device.check import Check
from stagewire_conformance.device.declaration import Declaration, declare
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.pics import Pics
from stagewire_conformance.device.plans import plan


@dataclass(frozen=True)
class DeclaredBench:
    """The declaration of a controller, and what follows from it.

    :param pics: its declaration.
    :param motion: the range of ``--allow-motion``.
    """

    pics: Pics
    motion: str

    @cached_property
    def declared(self) -> Declaration:
        """The declared controller."""
        return declare(self.pics)

    @cached_property
    def allowed(self) -> Permissions:
        """All permissions, within the range."""
        return allowances.everything(Range.parse(self.motion))

    @cached_property
    def checks(self) -> list[Check]:
        """All checks of the unit."""
        return plan(self.declared, self.allowed)
