"""Cases as plain text, for terminals and viewers of JUnit: findings, bytes, rules, dialogue, command.

Expected and received bytes are printed one below the other, with marks below the differences. Bytes of equal
number are compared one by one. Otherwise, equal bytes at both ends are aligned, and missing or surplus
bytes appear as ``--`` between them. All reports share the words for verdicts, grades and numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from stagewire_conformance.notation import spaced
from stagewire_conformance.reports.model import (
    Case,
    Finding,
    Grade,
    PageReference,
    Rule,
    Sheet,
    Transmission,
    Verdict,
)

_BYTES_IN_A_ROW = 8
_NOTHING = "--"
_ALIKE_SHOWN = 2
"""Rows without a difference that are shown in full."""


@dataclass(frozen=True, slots=True)
class Row:
    """Some bytes of both.

    :param offset: of the first, from the beginning of what was wanted or came, gaps counted.
    :param cells: wanted and came, each as two hex digits or ``--``.
    """

    offset: int
    cells: tuple[tuple[str, str], ...]

    @property
    def differs(self) -> bool:
        """Whether any byte does."""
        return any(wanted != came for wanted, came in self.cells)


def rows(wanted: bytes, came: bytes) -> list[Row]:
    """Return both in rows of eight bytes."""
    pairs = list(zip(*_padded(wanted, came), strict=True))
    return [
        Row(offset, tuple(pairs[offset : offset + _BYTES_IN_A_ROW]))
        for offset in range(0, len(pairs), _BYTES_IN_A_ROW)
    ]


def pieces(wanted: bytes, came: bytes) -> list[list[tuple[str, bool]]]:
    """Return both as lines, each in pieces of text that differ or not; ``^^`` stands below what differs.

    Of several rows that are alike only their number of bytes is told.
    """
    lines = []
    for differs, grouped in groupby(rows(wanted, came), key=lambda row: row.differs):
        group = list(grouped)
        if not differs and len(group) > _ALIKE_SHOWN:
            number = sum(len(row.cells) for row in group)
            lines.append([(f"{f'both   {group[0].offset:3}':<12}… {number} bytes alike …", False)])
            continue
        for row in group:
            lines += _lines(row)
    return lines


def _lines(row: Row) -> list[list[tuple[str, bool]]]:
    lines = []
    differing = [one != other for one, other in row.cells]
    for place, label in enumerate((f"wanted {row.offset:3}", "came")):
        cells = [(cell[place], differs) for cell, differs in zip(row.cells, differing, strict=True)]
        spaced = [part for cell in cells for part in ((" ", False), cell)][1:]
        lines.append([(f"{label:<12}", False), *spaced])
    if row.differs:
        marks = " ".join("^^" if differs else "  " for differs in differing)
        lines.append([(f"{'':<12}{marks}".rstrip(), False)])
    return lines


def as_text(wanted: bytes, came: bytes) -> list[str]:
    """Return the same as lines of text."""
    return ["".join(text for text, _ in line) for line in pieces(wanted, came)]


def _padded(wanted: bytes, came: bytes) -> tuple[list[str], list[str]]:
    """Return both as cells, of equal number."""
    shorter, longer = sorted((wanted, came), key=len)
    ahead = 0
    while ahead < len(shorter) and shorter[ahead] == longer[ahead]:
        ahead += 1
    behind = 0
    while behind < len(shorter) - ahead and shorter[-1 - behind] == longer[-1 - behind]:
        behind += 1
    gap = [_NOTHING] * (len(longer) - len(shorter))
    cells = [f"{byte:02X}" for byte in shorter]
    place = len(shorter) - behind
    filled = [*cells[:place], *gap, *cells[place:]]
    full = [f"{byte:02X}" for byte in longer]
    return (filled, full) if shorter is wanted else (full, filled)


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


def where(places: Iterable[PageReference]) -> str:
    """Return places of a document in a few words: ``page 9, 30``."""
    kinds: dict[str, list[str]] = {}
    for place in places:
        kind, _, name = place.name.partition(" ")
        kinds.setdefault(kind, []).append(name)
    return "; ".join(f"{kind} {', '.join(names)}".strip() for kind, names in kinds.items())


_MOST_LINES = 48
"""Pieces of a dialogue that are shown at a terminal."""
_HEADER = 6
"""Bytes from which on a message begins with its id; replies without a frame are shorter."""
_MOST_RULES = 5
"""Rules of a case that are quoted; of the others there are the names."""
_MOST_WORDS = 110
"""Characters of a rule that are shown; the page of the document has the rest."""
_MOST_BYTES = 96
"""Bytes of one piece that are shown."""


def case_text(sheet: Sheet, case: Case) -> Iterator[str]:
    """Yield what there is to say of a case, without its title and its result."""
    for finding in case.findings:
        yield from _finding(finding)
    rules = [sheet.rules[name] for name in case.rules if name in sheet.rules]
    for rule in rules[:_MOST_RULES]:
        yield from _rule(sheet, rule)
    if rules[_MOST_RULES:]:
        yield f"and {counted(len(rules) - _MOST_RULES, 'rule')} more: " + listed(
            (rule.id for rule in rules[_MOST_RULES:]), 12
        )
    if case.lines:
        yield "what was said:"
        yield from (f"  {line}" for line in dialogue(case.lines, _MOST_LINES))
    for text in case.restored:
        yield f"restored: {safe(text)}"
    if case.repeat:
        yield f"again: {safe(case.repeat)}"


def _rule(sheet: Sheet, rule: Rule) -> Iterator[str]:
    """Yield a rule with its page and the beginning of its words, and its errata."""
    says = safe(rule.says)
    shown = says if len(says) <= _MOST_WORDS else f"{says[: _MOST_WORDS - 1]}…"
    yield f"rule {rule.id} ({rule.strength}, {safe(rule.place.name)}): {shown}"
    yield from (f"  erratum {name}" for name in rule.errata if name in sheet.errata)


def dialogue(lines: Sequence[Transmission], most: int) -> Iterator[str]:
    """Yield a dialogue, a line each: when, which way, bytes, words.

    :param most: how many pieces at most; what is left out stands in the middle, as a number.
    """
    for line in shortened(lines, most):
        if isinstance(line, int):
            yield f"… {line:,} more …"
            continue
        mark = ">" if line.sent else "<"
        text = f"  # {safe(line.text)}" if line.text else ""
        yield f"{line.time:9.3f} {mark} {bytes_of(line.raw)}{text}"


def shortened(lines: Sequence[Transmission], most: int) -> list[Transmission | int]:
    """Return a dialogue with at most so many lines; a number stands where as many were left out.

    What is left out first are signs of life, then what is said again and again, such as questions while
    something moves, and at last the middle.
    """
    if len(lines) <= most:
        return list(lines)
    kept = [line for line in lines if not line.minor]
    if len(kept) <= most:
        return list(kept)
    folded = _folded(kept)
    if len(folded) <= most:
        return folded
    ahead, behind = most - most // 3, most // 3
    middle = folded[ahead : len(folded) - behind]
    left_out = sum(each if isinstance(each, int) else 1 for each in middle)
    return [*folded[:ahead], left_out, *folded[len(folded) - behind :]]


def _folded(lines: Sequence[Transmission]) -> list[Transmission | int]:
    """Return a dialogue in which of what is repeated the first and the last are left."""
    kinds = [_kind(line) for line in lines]
    folded: list[Transmission | int] = []
    for at, line in enumerate(lines):
        again = kinds[at] in kinds[max(0, at - 2) : at] and kinds[at] in kinds[at + 1 : at + 3]
        if not again:
            folded.append(line)
        elif folded and isinstance(folded[-1], int):
            folded[-1] += 1
        else:
            folded.append(1)
    return folded


def _kind(line: Transmission) -> tuple[bool, bytes, int]:
    """Return what makes two lines the same for a reader: what is sent, and the message that comes."""
    if line.sent or len(line.raw) < _HEADER:
        return line.sent, line.raw if line.sent else b"", len(line.raw)
    return False, line.raw[:2], len(line.raw)


def bytes_of(raw: bytes) -> str:
    """Return bytes in hex; of many, the first."""
    more = f" … ({len(raw):,} bytes)" if len(raw) > _MOST_BYTES else ""
    return spaced(raw[:_MOST_BYTES]) + more


def _finding(finding: Finding) -> Iterator[str]:
    yield safe(finding.text)
    wanted, came = finding.wanted, finding.came
    if isinstance(wanted, bytes) and isinstance(came, bytes):
        yield from (f"  {line}" for line in as_text(wanted, came))
        return
    for name, one in (("wanted", wanted), ("came", came)):
        if one is not None:
            shown = bytes_of(one) or "nothing" if isinstance(one, bytes) else safe(one)
            yield f"  {name:<6} {shown}"
