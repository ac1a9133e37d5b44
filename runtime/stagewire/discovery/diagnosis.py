"""One thing that was looked at, how grave it is, and what to do about it."""

from __future__ import annotations

import enum
from dataclasses import dataclass

__all__ = ["Diagnosis", "Verdict"]


class Verdict(enum.Enum):
    """How grave a diagnosis is."""

    FINE = "fine"
    NOTE = "note"
    WRONG = "wrong"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """One thing that was looked at.

    :param verdict: how grave it is.
    :param about: a port, a URL, or what else it is about.
    :param text: what is so.
    :param advice: what to do; empty where nothing is to be done.
    """

    verdict: Verdict
    about: str
    text: str
    advice: str = ""
