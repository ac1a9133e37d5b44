"""Words that every report has alike: what a verdict and a grade mean, numbers of things, safe text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from stagewire_conformance.reports.model import Grade, Place, Sheet, Verdict

__all__ = ["GRADES", "MEANING", "counted", "listed", "numbers", "safe", "sentence", "where"]

MEANING = {
    "PASS": "the controller does what the document demands",
    "NON-STRICT": "it departs from what the document advises, or is usual; hosts can live with it",
    "FAIL": "it does not do what the document demands",
    "INFO": "looked at, without a bound that could be held to it here",
    "SKIP": "left out, because the PICS says that the controller has not got it",
    "NOT RUN": "left out, because it was not allowed or not possible in this run",
}
"""The results of a check of a controller."""

_VERDICTS = {
    Verdict.FAILED: "does not conform",
    Verdict.UNFINISHED: "the run did not come to its end",
    Verdict.NON_STRICT: "conforms, with departures from what the document advises",
    Verdict.PASSED: "all that was run passed",
}
GRADES = {
    Grade.FAILED: "failed",
    Grade.DEVIATES: "non-strict",
    Grade.PASSED: "passed",
    Grade.NOTED: "for information",
    Grade.SKIPPED: "skipped",
    Grade.NOT_RUN: "not run",
}


def safe(text: str) -> str:
    """Return text from outside with everything escaped that is no visible character."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def counted(number: int, thing: str, things: str = "") -> str:
    """Return ``1 check``, ``2 checks``."""
    return f"{number:,} {thing if number == 1 else things or f'{thing}s'}"


def listed(names: Iterable[str], most: int = 6) -> str:
    """Return names in a sentence, and how many there are beyond the first few."""
    every = list(names)
    more = f" and {len(every) - most} more" if len(every) > most else ""
    return ", ".join(every[:most]) + more


def sentence(sheet: Sheet) -> str:
    """Return in one sentence what the run comes to, the figures, and what did not come about."""
    figures = numbers(sheet.counts()) or "nothing was run"
    return "; ".join([f"{_VERDICTS[sheet.verdict]}: {figures}", *sheet.missed])


def numbers(counts: Mapping[Grade, int]) -> str:
    """Return how many cases have which grade, in words."""
    return ", ".join(f"{counts[grade]:,} {word}" for grade, word in GRADES.items() if counts[grade])


def where(places: Iterable[Place]) -> str:
    """Return places of a document in a few words: ``page 9, 30``."""
    kinds: dict[str, list[str]] = {}
    for place in places:
        kind, _, name = place.name.partition(" ")
        kinds.setdefault(kind, []).append(name)
    return "; ".join(f"{kind} {', '.join(names)}".strip() for kind, names in kinds.items())
