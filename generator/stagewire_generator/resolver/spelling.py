"""Names taken apart: the group in front, and the words as the document spells them."""

from __future__ import annotations

from stagewire_generator.diagnostics import Place
from stagewire_generator.resolver.tables import Tables

__all__ = ["spelled_words", "split_group"]


def split_group(tables: Tables, name: str) -> tuple[str, str]:
    """Return the group that a name begins with, or an empty text, and the rest of the name."""
    group, _, rest = name.partition("_")
    return (group, rest) if group in tables.head.data.get("groups", ()) else ("", name)


def spelled_words(
    tables: Tables, group: str, verb: str, spelling: str, name: str, place: Place
) -> tuple[str, ...]:
    """Return the words of a name; a diagnostic where, joined, they do not give it."""
    words = tuple(w for w in (group.lower(), verb, *spelling.split()) if w)
    if "".join(words) != name.lower().replace("_", ""):
        tables.diagnostics.add(place, "SW024", f"{' '.join(words)} does not spell {name}")
    return words
