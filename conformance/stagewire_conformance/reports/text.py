"""Cases as plain text, for terminals and JUnit viewers: findings, bytes, rules, dialogue, command.

Expected and received bytes are printed one below the other, with marks below the differences. If their
numbers are equal, they are compared one by one. Otherwise, equal bytes at both ends are aligned, and missing
or surplus bytes appear as ``--`` between them. All reports use the same words for verdicts, grades and
numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from stagewire_conformance.notation import spaced
from stagewire_conformance.reports.model import (
    Case,
    Finding,
    Grade,
    Message,
    Omission,
    PageReference,
    Rule,
    Sheet,
    Transmission,
    Verdict,
)

_BYTES_IN_A_ROW = 8
_NOTHING = "--"
_ALIKE_SHOWN = 2
"""The maximum number of rows without a difference that are shown in full."""


@dataclass(frozen=True, slots=True)
class Row:
    """A row of expected and received bytes.

    :param offset: of the first byte, including gaps.
    :param cells: pairs of expected and received bytes, each as two hex digits or ``--``.
    """

    offset: int
    cells: tuple[tuple[str, str], ...]

    @property
    def differs(self) -> bool:
        """Whether any byte differs."""
        return any(wanted != came for wanted, came in self.cells)


def rows(wanted: bytes, came: bytes) -> list[Row]:
    """Return both in rows of eight bytes."""
    pairs = list(zip(*_padded(wanted, came), strict=True))
    return [
        Row(offset, tuple(pairs[offset : offset + _BYTES_IN_A_ROW]))
        for offset in range(0, len(pairs), _BYTES_IN_A_ROW)
    ]


def pieces(wanted: bytes, came: bytes) -> list[list[tuple[str, bool]]]:
    """Return both as lines of pieces that differ or not, with ``^^`` below each difference.

    Many equal rows are replaced by their number of bytes.
    """
    lines = []
    for differs, grouped in groupby(rows(wanted, came), key=lambda row: row.differs):
        group = list(grouped)
        if not differs and len(group) > _ALIKE_SHOWN:
            number = sum(len(row.cells) for row in group)
            lines.append(
                [(f"{f'both     {group[0].offset:3}':<14}… {number} equal bytes …", False)]
            )
            continue
        for row in group:
            lines += _lines(row)
    return lines


def _lines(row: Row) -> list[list[tuple[str, bool]]]:
    lines = []
    differing = [one != other for one, other in row.cells]
    for place, label in enumerate((f"expected {row.offset:3}", "received")):
        cells = [(cell[place], differs) for cell, differs in zip(row.cells, differing, strict=True)]
        spaced = [part for cell in cells for part in ((" ", False), cell)][1:]
        lines.append([(f"{label:<14}", False), *spaced])
    if row.differs:
        marks = " ".join("^^" if differs else "  " for differs in differing)
        lines.append([(f"{'':<14}{marks}".rstrip(), False)])
    return lines


def as_text(wanted: bytes, came: bytes) -> list[str]:
    """Return the same as lines of text."""
    return ["".join(text for text, _ in line) for line in pieces(wanted, came)]


def _padded(wanted: bytes, came: bytes) -> tuple[list[str], list[str]]:
    """Return both as cells, padded to equal length."""
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


def not_at_rest(sheet: Sheet) -> list[str]:
    """Return a warning for each part that may still be moving after the run."""
    return [f"NOT AT REST: {text}. Make sure that it cannot do harm." for text in sheet.adrift]


MEANING = {
    "PASS": "the controller does what the document requires",
    "NON-STRICT": "it departs from a recommendation or from usual behaviour, or departs as other "
    "controllers do; hosts can work with it",
    "FRAGILE": "it does not cope with damaged input; no rule demands it, and it is not part of the verdict",
    "FAIL": "it violates a requirement of the document",
    "INFO": "measured or observed, but this run cannot decide whether it is correct",
    "SKIP": "omitted, because the PICS declares it as unsupported",
    "NOT RUN": "omitted: not allowed, not possible, or dependent on a defect that another check reports",
}
"""The meanings of the results of a check."""

MILDER = (
    "NON-STRICT, although the rule says must: hosts can work with this departure, or other controllers "
    "share it"
)
"""An explanation of a result that is milder than its rule."""

_VERDICTS = {
    Verdict.FAILED: "does not conform",
    Verdict.UNFINISHED: "the run did not finish",
    Verdict.NON_STRICT: "departures that hosts can work with",
    Verdict.PARTIAL: "no failures in what was run",
    Verdict.PASSED: "no failures",
}
_MOST_GAPS = 6
"""The maximum number of reasons in the sentence about a partial run."""
GRADES = {
    Grade.FAILED: "failed",
    Grade.DEVIATES: "non-strict",
    Grade.FRAGILE: "fragile (not part of the verdict)",
    Grade.PASSED: "passed",
    Grade.NOTED: "for information",
    Grade.SKIPPED: "skipped",
    Grade.NOT_RUN: "not run",
}


def safe(text: str) -> str:
    """Return text from outside with all invisible characters escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def counted(number: int, thing: str, things: str = "") -> str:
    """Return ``1 check``, ``2 checks``."""
    return f"{number:,} {thing if number == 1 else things or f'{thing}s'}"


def listed(names: Iterable[str], most: int = 6) -> str:
    """Return the first names, separated by commas, and the number of the others."""
    every = list(names)
    more = f" and {len(every) - most} more" if len(every) > most else ""
    return ", ".join(every[:most]) + more


def sentence(sheet: Sheet) -> str:
    """Return the verdict, the figures, what is missing, and the unused permissions in one sentence."""
    figures = numbers(sheet.counts()) or "nothing was run"
    extent = [] if sheet.complete else [f"partial run: {listed(gaps(sheet), _MOST_GAPS)}"]
    return "; ".join([f"{_VERDICTS[sheet.verdict]}: {figures}", *extent, *sheet.missed])


def gaps(sheet: Sheet) -> Iterator[str]:
    """Yield each reason why a run is partial, with the number of cases, such as ``3 not selected``."""
    for gap in sheet.gaps:
        number = f"{gap.cases:,} " if gap.cases else ""
        after = "not run: " if gap.cases and gap.omission in _WITHOUT_VERB else ""
        yield f"{number}{after}{gap.why}"


_WITHOUT_VERB = (
    Omission.IMPOSSIBLE,
    Omission.NOT_IMPLEMENTED,
    Omission.CAUSE,
    Omission.INTERRUPTED,
    Omission.ENDED,
)
"""Reasons that do not themselves say that a case was not run."""


def numbers(counts: Mapping[Grade, int]) -> str:
    """Return the number of cases by grade, in words."""
    return ", ".join(f"{counts[grade]:,} {word}" for grade, word in GRADES.items() if counts[grade])


def where(places: Iterable[PageReference]) -> str:
    """Return references to documents in short form: ``page 9, 30``, or with the name of each document."""
    kinds: dict[str, list[str]] = {}
    for place in places:
        kind, _, name = place.name.removeprefix(place.document).lstrip(", ").partition(" ")
        kinds.setdefault(", ".join(filter(None, (place.document, kind))), []).append(name)
    return "; ".join(f"{kind} {', '.join(names)}".strip() for kind, names in kinds.items())


_NAMES = re.compile(r"\b[A-Z][A-Z0-9_]+\b")
"""A name of a message in a sentence."""
_MOST_LINES = 48
"""The maximum number of lines of a dialogue at a terminal."""
_HEADER = 6
"""The minimum length of a framed message, which begins with its id. Replies without a frame are shorter."""
_MOST_BYTES = 96
"""The maximum number of bytes shown of one piece."""


def case_text(sheet: Sheet, case: Case) -> Iterator[str]:
    """Yield the description of a case, without its title and its result."""
    for finding in case.findings:
        yield from _finding(finding)
    for rule in broken_rules(sheet, case):
        yield from _rule(sheet, rule)
    if is_milder_than_its_rule(sheet, case):
        yield MILDER
    for message in named_messages(sheet, case):
        yield f"message {message.name} ({where(message.places)})"
    if dependents := sheet.dependents(case):
        yield f"not run because of this: {listed(each.id for each in dependents)}"
    if case.lines:
        yield "dialogue:"
        yield from (f"  {line}" for line in dialogue(case.lines, _MOST_LINES))
    for text in case.restored:
        yield f"restored: {safe(text)}"
    if case.repeat:
        yield f"repeat with: {safe(case.repeat)}"


def broken_rules(sheet: Sheet, case: Case) -> list[Rule]:
    """Return the rules that the findings of a case name, each once."""
    names = dict.fromkeys(finding.rule for finding in case.findings)
    return [sheet.rules[name] for name in names if name in sheet.rules]


def named_messages(sheet: Sheet, case: Case) -> list[Message]:
    """Return the documented messages that the findings about rules name: a rule may be a general one."""
    texts = " ".join(finding.text for finding in case.findings if finding.rule)
    names = dict.fromkeys(_NAMES.findall(texts))
    return [each for each in sheet.messages if each.name in names and each.places]


def is_milder_than_its_rule(sheet: Sheet, case: Case) -> bool:
    """Return whether a case is NON-STRICT although a rule that it names says must."""
    strengths = {rule.strength for rule in broken_rules(sheet, case)}
    return case.grade is Grade.DEVIATES and "must" in strengths


def _rule(sheet: Sheet, rule: Rule) -> Iterator[str]:
    """Yield a rule with its page, and its errata."""
    yield f"rule {rule.id} ({rule.strength}, {safe(rule.place.name)}): {safe(rule.states)}"
    yield from (f"  erratum {name}" for name in rule.errata if name in sheet.errata)


def dialogue(lines: Sequence[Transmission], most: int) -> Iterator[str]:
    """Yield a dialogue, one line per piece: time, direction, bytes, description.

    :param most: the maximum number of pieces. The number of omitted pieces is shown in the middle.
    """
    for line in shortened(lines, most):
        if isinstance(line, int):
            yield f"… {line:,} more …"
            continue
        mark = ">" if line.sent else "<"
        text = f"  # {safe(line.text)}" if line.text else ""
        yield f"{line.time:9.3f} {mark} {bytes_of(line.raw)}{text}"


def shortened(lines: Sequence[Transmission], most: int) -> list[Transmission | int]:
    """Return a dialogue with at most ``most`` lines. A number replaces the omitted lines.

    Keep-alive messages are omitted first, then repetitions such as requests during a motion, and finally the
    middle.
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
    """Return a dialogue in which only the first and the last line of a repetition are kept."""
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
    """Return a key that is equal for similar lines: the sent bytes, or the id of a received message."""
    if line.sent or len(line.raw) < _HEADER:
        return line.sent, line.raw if line.sent else b"", len(line.raw)
    return False, line.raw[:2], len(line.raw)


def bytes_of(raw: bytes) -> str:
    """Return bytes in hex, shortened if there are many."""
    more = f" … ({len(raw):,} bytes)" if len(raw) > _MOST_BYTES else ""
    return spaced(raw[:_MOST_BYTES]) + more


def _finding(finding: Finding) -> Iterator[str]:
    named = f" [{finding.rule}]" if finding.rule else ""
    yield f"{safe(finding.text)}{named}"
    wanted, came = finding.wanted, finding.came
    if isinstance(wanted, bytes) and isinstance(came, bytes):
        yield from (f"  {line}" for line in as_text(wanted, came))
        return
    for name, one in (("expected", wanted), ("received", came)):
        if one is not None:
            shown = bytes_of(one) or "nothing" if isinstance(one, bytes) else safe(one)
            yield f"  {name:<8} {shown}"
