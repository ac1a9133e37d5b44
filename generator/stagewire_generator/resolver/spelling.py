"""Names taken apart: the group in front, and the words as the document spells them."""

from __future__ import annotations

from stagewire_generator.diagnostics import Place
from stagewire_generator.model import Json
from stagewire_generator.resolver.tables import Tables

__all__ = ["joined", "spelled_words", "spelling_of", "split_group"]


def split_group(tables: Tables, name: str) -> tuple[str, str]:
    """Return the group that a name begins with, or an empty text, and the rest of the name."""
    group, _, rest = name.partition("_")
    return (group, rest) if group in tables.head.data.get("groups", ()) else ("", name)


def spelling_of(entry: Json, rest: str) -> str:
    """Return the words of a name without its group: as the entry spells them, or divided by underscores."""
    spelling: str = entry.get("spelling", rest.lower().replace("_", " "))
    return spelling


def joined(group: str, verb: str, spelling: str) -> tuple[str, ...]:
    """Return the words of a name: its group, SET, REQ or GET, and what the entry spells."""
    return tuple(w for w in (group.lower(), verb, *spelling.split()) if w)


def spelled_words(
    tables: Tables, group: str, spelling: str, name: str, place: Place
) -> tuple[str, ...]:
    """Return the words of a name as it stands in a file; a diagnostic where, joined, they do not give it."""
    words = joined(group, "", spelling)
    if not _spell(words, name):
        first, _, rest = name.partition("_")
        hint = ""
        if not group and rest and _spell(words, rest):
            hint = (
                f"list {first} under `groups`, in protocol.yaml or overlay.yaml, or spell it, too"
            )
        tables.diagnostics.add(place, "SW024", f"{' '.join(words)} does not spell {name}", hint)
    return words


def _spell(words: tuple[str, ...], name: str) -> bool:
    return "".join(words) == name.lower().replace("_", "")
