"""Which thing of the old side is which of the new: by name, or, under another name, by what it is."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

__all__ = ["Pairs", "pair"]

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Pairs(Generic[T]):
    """Things that are on both sides, and on one only; each in the order of its side."""

    kept: tuple[tuple[T, T], ...]
    renamed: Mapping[str, str]  # old name -> new name
    added: tuple[T, ...]
    removed: tuple[T, ...]
    reordered: bool  # whether those that are kept follow one another otherwise


def pair(
    old: Mapping[str, T], new: Mapping[str, T], signature: Callable[[T], Hashable | None]
) -> Pairs[T]:
    """Pair the things of both sides.

    A thing whose name is gone is the one with the same ``signature`` whose name is new, when there is exactly
    one of each; a signature of None is like no other.
    """
    gone = _by_signature({name: t for name, t in old.items() if name not in new}, signature)
    come = _by_signature({name: t for name, t in new.items() if name not in old}, signature)
    renamed = {
        names[0]: come[key][0]
        for key, names in gone.items()
        if len(names) == 1 and len(come.get(key, ())) == 1
    }
    names = [renamed.get(name, name) for name in old if name in new or name in renamed]
    found = set(names)
    return Pairs(
        kept=tuple(
            (t, new[renamed.get(n, n)]) for n, t in old.items() if renamed.get(n, n) in found
        ),
        renamed=renamed,
        added=tuple(thing for name, thing in new.items() if name not in found),
        removed=tuple(t for name, t in old.items() if name not in new and name not in renamed),
        reordered=names != [name for name in new if name in found],
    )


def _by_signature(
    things: Mapping[str, T], signature: Callable[[T], Hashable | None]
) -> dict[Hashable, list[str]]:
    found: dict[Hashable, list[str]] = {}
    for name, thing in things.items():
        key = signature(thing)
        if key is not None:
            found.setdefault(key, []).append(name)
    return found
