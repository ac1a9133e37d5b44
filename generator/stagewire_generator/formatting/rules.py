"""What is made canonical before a file is laid out: the order of keys, quotes and the spelling of numbers."""

from __future__ import annotations

from stagewire_generator.formatting.shape import Shape
from stagewire_generator.formatting.spelling import needs_quotes, spell, spell_key
from stagewire_generator.formatting.tree import Collection, Entry, Node

__all__ = ["canonicalise"]


def canonicalise(node: Node, shape: Shape, *, keep_quotes: bool = False) -> None:
    """Change a tree in place.

    :param shape: what the schema says of this node.
    :param keep_quotes: leave the quotes where they are not needed.
    """
    if not isinstance(node, Collection):
        spell(node, in_hex=shape.in_hex, keep_quotes=keep_quotes)
        return
    if node.mapping:
        node.entries = _ordered(node.entries, shape)
        keep_quotes = False
    else:  # the items of a list look alike: all of them keep their quotes, or none
        keep_quotes = keep_quotes or any(map(needs_quotes, node.scalars()))
    for entry in node.entries:
        key = entry.key
        if key is not None:
            spell_key(key)
        inner = shape.inside(key.value if key else None)
        canonicalise(entry.value, inner, keep_quotes=keep_quotes)


def _ordered(entries: list[Entry], shape: Shape) -> list[Entry]:
    """Return entries in the order of the schema; one that it does not know stays behind its neighbour."""
    places: list[tuple[int, Entry]] = []
    place = -1
    for entry in entries:
        if entry.key is not None:
            place = shape.order.get(entry.key.value, place)
        places.append((place, entry))
    return [entry for _, entry in sorted(places, key=lambda pair: pair[0])]
