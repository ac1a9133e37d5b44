"""Names in C: what stands in front of them, and what becomes of a path."""

from __future__ import annotations

import re
from dataclasses import dataclass

from stagewire_generator.model import Enumeration, FlagTable, Layout, Message, Protocol
from stagewire_generator.naming import c_layouts, c_prefix, c_table

__all__ = ["Names", "names_of"]


@dataclass(frozen=True, slots=True)
class Names:
    """The names of one package.

    :param package: the folder.
    :param prefix: what types and functions begin with, without the underscore.
    """

    package: str
    prefix: str

    @property
    def macro_prefix(self) -> str:
        """What macros begin with, without the underscore."""
        return self.prefix.upper()

    def layout(self, message: Message, layout: Layout) -> str:
        """Return the type of a layout; its functions begin with this name."""
        return f"{self.prefix}_{c_layouts(message)[layout.form]}"

    def macro(self, name: str) -> str:
        """Return what the macros of something begin with."""
        return f"{self.macro_prefix}_{name.upper()}"

    def table(self, table: Enumeration | FlagTable) -> str:
        """Return the type of an enumeration, or what the macros of a flag table are called after."""
        return f"{self.prefix}_{c_table(table)}"

    def guard(self, path: str) -> str:
        """Return the include guard of a file, by its path in the folder of the package.

        No macro of a package begins with these words, whatever its spec names.
        """
        return re.sub(r"\W", "_", f"stagewire/{self.prefix}/{path}").upper()


def names_of(protocol: Protocol) -> Names:
    """Return the names of the package of a protocol."""
    return Names(protocol.package, c_prefix(protocol.package))
