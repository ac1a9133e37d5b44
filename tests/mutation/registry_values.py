"""A value in a file of the registry that a test changes for a moment."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from stagewire_generator.strict_yaml import Document, KeyPath


@dataclass(frozen=True)
class RegistryValue:
    """A value, or the name of an entry.

    :param path: the path of the value, or of the entry.
    """

    document: Document
    path: KeyPath

    def __str__(self) -> str:
        return "/".join(map(str, self.path))

    @property
    def holder(self) -> Any:
        """The object or list that has the value."""
        node = self.document.data
        for step in self.path[:-1]:
            node = node[step]
        return node

    @property
    def siblings(self) -> list[Any]:
        """Everything in the holder, in order."""
        return list(self.holder.items() if isinstance(self.holder, dict) else self.holder)

    @contextmanager
    def restored(self) -> Iterator[None]:
        """Restore the holder at the end of the context."""
        before = self.siblings
        try:
            yield
        finally:
            self.holder.clear()
            (self.holder.update if isinstance(self.holder, dict) else self.holder.extend)(before)
