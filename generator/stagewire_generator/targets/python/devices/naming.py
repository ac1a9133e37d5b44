"""Names of methods, of their arguments, and of classes: the document's words, and no two alike."""

from __future__ import annotations

import keyword
from collections import Counter
from collections.abc import Collection, Iterable, Sequence

from stagewire_generator.model import Message

__all__ = [
    "ARGUMENTS",
    "METHODS",
    "apart",
    "can_begin",
    "short_words",
    "unit_words",
    "verbless",
]

_SYMBOLS = {"V": "volts", "N": "newtons"}
# What every device class has from the runtime, and what the modules of generated parts import.
METHODS = frozenset(keyword.kwlist) | frozenset({
    "axis", "axis_class", "bay", "bay_class", "bays", "channel", "channel_class", "channels", "close",
    "e", "f", "facts", "info", "is_moving", "low_level", "mode", "mro", "open", "reconnect", "scales",
    "serial_number", "session", "subscribe", "t", "text", "unit", "url", "v", "values"
})  # fmt: skip
# What an argument of a method, or an attribute of the values that it returns, cannot be called.
ARGUMENTS = frozenset(keyword.kwlist) | frozenset({
    "counts", "e", "exact", "f", "known", "m", "message", "mro", "names", "scales", "self", "t", "told",
    "timeout", "v"
})  # fmt: skip


def unit_words(unit: str) -> str:
    """Return a unit as the end of a name: ``mm_per_s2`` for ``mm/s^2``, ``volts`` for ``V``."""
    parts = [part.replace("^", "") for part in unit.split("/")]
    return "_per_".join(_SYMBOLS.get(part, part.lower()) for part in parts)


def short_words(message: Message) -> tuple[str, ...]:
    """Return the words of a message in small letters, without that of its group."""
    words = tuple(word.lower() for word in message.words)
    return words[1:] if message.group and can_begin(words[1:]) else words


def verbless(words: tuple[str, ...]) -> tuple[str, ...]:
    """Return words without the verb that asks or answers, if others are left."""
    return words[1:] if words[0] in ("get", "req", "read") and can_begin(words[1:]) else words


def can_begin(words: Sequence[str]) -> bool:
    """Whether a name can begin with these words: there are some, and no digit is in front."""
    return bool(words) and words[0][0].isalpha()


def apart(things: Iterable[Sequence[str]], taken: Collection[str], word: str) -> list[str]:
    """Return a name for each thing: no two alike, and none of them taken.

    :param things: the names that each may have, the best first. Of two that are alike both go on to
        their next, if they have one.
    :param word: stands behind a name for which there is no next.
    """
    choices = [list(names) for names in things]
    while True:
        count = Counter(names[0] for names in choices)
        alike = [
            names
            for names in choices
            if len(names) > 1 and (count[names[0]] > 1 or names[0] in taken)
        ]
        if not alike:
            break
        for names in alike:
            del names[0]
    used = set(taken)
    for names in choices:
        while names[0] in used:
            names[0] = f"{names[0]}_{word}"
        used.add(names[0])
    return [names[0] for names in choices]
