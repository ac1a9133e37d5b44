"""Faults as text, for command lines and benches: ``to_host drop frame every=10``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from stagewire_virtual.errors import FaultError
from stagewire_virtual.faults.fault import DIRECTIONS, Fault
from stagewire_virtual.faults.keys import KEYS, Action, Piece, one_of
from stagewire_virtual.options import several

__all__ = ["parse_fault", "parse_faults"]

_ACTIONS = {action.value: action for action in Action}
_PIECES = {piece.value: piece for piece in Piece}


def parse_fault(text: str) -> Fault:
    """Return the fault that a text describes: ``DIRECTION ACTION [byte|frame] [KEY=VALUE …]``.

    ``stick`` has no direction. ``str`` of a fault is such a text. Raises
    :class:`~stagewire_virtual.errors.FaultError`, which says what was expected.
    """
    try:
        return _parse(text.split())
    except FaultError as error:
        shown = text if len(text) <= 100 else f"{text[:100]}…"
        raise FaultError(f"fault {shown!r}: {error}") from None


def parse_faults(faults: Iterable[Fault | str]) -> tuple[Fault, ...]:
    """Return the faults that are given as text or as values.

    Raises :class:`~stagewire_virtual.errors.VirtualError` for what is neither, and for one alone.
    """
    made: list[Fault] = []
    for fault in several("faults", faults):
        if not isinstance(fault, (Fault, str)):
            raise FaultError(f"a fault is a text or a Fault, not {fault!r}")
        made.append(parse_fault(fault) if isinstance(fault, str) else fault)
    return tuple(made)


def _parse(words: list[str]) -> Fault:
    known = (*DIRECTIONS, Action.STICK.value)
    first = words[0] if words else ""
    if first not in known:
        raise FaultError(f"it begins with no direction {one_of(first, known)}")
    values: dict[str, Any] = {}
    if first in DIRECTIONS:
        values["direction"] = DIRECTIONS[first]
        del words[0]
    action = words.pop(0) if words else ""
    if action not in _ACTIONS:
        raise FaultError(f"there is no action {one_of(action, _ACTIONS)}")
    if words and words[0] in _PIECES:
        values["piece"] = _PIECES[words.pop(0)]
    for word in words:
        name, equals, value = word.partition("=")
        if not equals:
            raise FaultError(f"{word!r} is neither byte or frame, before all keys, nor KEY=VALUE")
        key = KEYS.get(name)
        if key is None:
            raise FaultError(f"there is no key {one_of(name, KEYS)}")
        if key.attribute in values:
            raise FaultError(f"{name} is there twice")
        try:
            values[key.attribute] = key.read(value)
        except (ValueError, KeyError):
            shown = value if len(value) <= 40 else f"{value[:40]}…"
            raise FaultError(f"{name} takes {key.takes}, not {shown!r}") from None
    return Fault(action=_ACTIONS[action], **values)
