"""A case in plain lines, for terminals and viewers of JUnit: findings, bytes, rules, dialogue, command."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stagewire_conformance.hexes import spaced
from stagewire_conformance.reports.differences import as_text
from stagewire_conformance.reports.model import Case, Finding, Line, Rule, Sheet
from stagewire_conformance.reports.wording import counted, listed, safe

__all__ = ["bytes_of", "case_text", "dialogue", "shortened"]

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


def dialogue(lines: Sequence[Line], most: int) -> Iterator[str]:
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


def shortened(lines: Sequence[Line], most: int) -> list[Line | int]:
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


def _folded(lines: Sequence[Line]) -> list[Line | int]:
    """Return a dialogue in which of what is repeated the first and the last are left."""
    kinds = [_kind(line) for line in lines]
    folded: list[Line | int] = []
    for at, line in enumerate(lines):
        again = kinds[at] in kinds[max(0, at - 2) : at] and kinds[at] in kinds[at + 1 : at + 3]
        if not again:
            folded.append(line)
        elif folded and isinstance(folded[-1], int):
            folded[-1] += 1
        else:
            folded.append(1)
    return folded


def _kind(line: Line) -> tuple[bool, bytes, int]:
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
