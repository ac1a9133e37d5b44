"""What a bench is when it has been read."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_virtual.blueprint import Blueprint
from stagewire_virtual.clock import Clock
from stagewire_virtual.serving.link import Observer, ServedLink
from stagewire_virtual.serving.places import Place

__all__ = ["Bench", "BenchUnit"]


@dataclass(frozen=True, slots=True)
class BenchUnit:
    """One controller of a bench.

    :param blueprint: what to make.
    :param place: where to serve it.
    :param label: for people.
    """

    blueprint: Blueprint
    place: Place
    label: str

    def link(self, clock: Clock, observer: Observer | None = None) -> ServedLink:
        """Make the controller and its link, to be opened by a server."""
        return self.place.link(self.blueprint.make(clock), label=self.label, observer=observer)


@dataclass(frozen=True, slots=True)
class Bench:
    """Controllers that are served together, in the order of their description."""

    units: tuple[BenchUnit, ...]
