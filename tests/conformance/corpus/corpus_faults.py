"""Faults planted in the firmware of the corpus: each is a subclass of a correct controller."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from inspect import cleandoc
from typing import Any

from corpus_lines import Maker


@dataclass(frozen=True)
class Fault:
    """A fault.

    :param name: the name of its class.
    :param text: a description; the first sentence is the fault.
    :param make: makes the faulty controller.
    :param rules: the rules that it breaks; a finding must name one of them.
    :param dynamic: whether it concerns motion rather than bytes.
    """

    name: str
    text: str
    make: Maker
    rules: frozenset[str]
    dynamic: bool


class Faults(list[Fault]):
    """The faults of a controller."""

    def breaks(self, *rules: str, dynamic: bool = False) -> Callable[[type[Any]], type[Any]]:
        """Add a class to the list; its docstring describes the fault."""

        def add(made: type[Any]) -> type[Any]:
            self.append(
                Fault(made.__name__, cleandoc(made.__doc__ or ""), made, frozenset(rules), dynamic)
            )
            return made

        return add

    def moves(self, *rules: str) -> Callable[[type[Any]], type[Any]]:
        """Add a class with a fault of motion."""
        return self.breaks(*rules, dynamic=True)
