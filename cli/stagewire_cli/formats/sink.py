"""Where rows go: what CSV and Parquet have in common."""

from __future__ import annotations

import abc
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

__all__ = ["Column", "Sink"]


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a table.

    :param name: its heading.
    :param type: ``uint8`` to ``int64``, ``string`` or ``binary``, as Parquet and NumPy say.
    """

    name: str
    type: str


class Sink(abc.ABC):
    """A table that is written from the top down.

    ``batch`` is how many rows it is given at once; ``live`` whether it takes fewer, so that what comes
    slowly is seen as it comes.
    """

    batch = 4096
    live = True

    @abc.abstractmethod
    def write(self, values: Sequence[Sequence[Any]]) -> None:
        """Add rows, column by column; None stands for what a row has not."""

    @abc.abstractmethod
    def flush(self) -> None:
        """Hand on what has been written so far."""

    @abc.abstractmethod
    def close(self) -> None:
        """Write what ends the table."""

    @abc.abstractmethod
    def abandon(self) -> None:
        """Let go of a table that will not be finished."""
