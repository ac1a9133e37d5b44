"""Counts of what the properties met.

A run that never received a frame finds no fault either; these counts show the difference.
"""

from __future__ import annotations

from collections.abc import MutableSequence
from enum import IntEnum


class Seen(IntEnum):
    """Events and refusals that are counted, with their index in the tally."""

    MESSAGE = 0
    UNDOCUMENTED = 1
    UNKNOWN = 2
    BAD_LENGTH = 3
    GARBAGE = 4
    EXTRA = 5
    PENDING = 6
    ABANDONED = 7
    WHOLE_FIRST = 8
    DECODED = 9
    UNDECIDED = 10
    TRUNCATED = 11
    TRAILING = 12
    WRONG_LENGTH = 13
    UNKNOWN_MESSAGE = 14
    BUILT = 15
    NOT_BUILT = 16
    COMMAND = 17
    SETUP_COMMAND = 18
    IGNORED_BYTES = 19
    UNKNOWN_COMMAND = 20
    BAD_COMMAND = 21
    COMMAND_GARBAGE = 22
    COMMAND_PENDING = 23
    COMMAND_REFUSED = 24
    OUT_OF_RANGE = 25
    LOOKS_LIKE_SETUP = 26
    REPLY = 27
    LATE_REPLY = 28
    ARRAY = 29
    WRONG_COUNT = 30
    BUILT_ARRAY = 31


SEEN = tuple(member.name.lower() for member in Seen)

_tally: MutableSequence[int] = [0] * len(SEEN)


def count_in(tally: MutableSequence[int]) -> None:
    """Count in ``tally`` from now on. It has one integer for each name of :data:`SEEN`."""
    global _tally
    _tally = tally


def count(what: Seen, number: int = 1) -> None:
    """Count one occurrence, or several."""
    _tally[what] += number
