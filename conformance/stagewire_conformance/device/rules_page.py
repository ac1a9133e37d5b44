"""Makes ``docs/conformance-rules.md`` from the rules of the registry and the kinds of checks.

``python -m stagewire_conformance.device.rules_page FILE`` writes it.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

from stagewire.protocols import Protocol, load_protocol
from stagewire_conformance.device.rules import Coverage, coverage

__all__ = ["page"]

_PROTOCOLS = ("thorlabs_apt", "asi_ms2000")
_MOST_SAID = 110  # characters of a quotation

_HEAD = """\
<!-- Made by `python -m stagewire_conformance.device.rules_page docs/conformance-rules.md` -->
# Rules, and what sees them

Every must and should of the documents, with the kinds of checks of `stagewire conformance device` that hold a
controller to it, or the reason why none can: its waiver. A must has one or the other, never both. `must` is
what a document states as a fact or a duty, `should` what it calls usual, typical or recommended. "Host" marks
rules that bind the program at the other end.

The rules are `spec/<protocol>/rules.yaml`, with the document's words in full; here is where they begin.
`stagewire conformance rules` prints this table, with `--json` everything.
`stagewire conformance device URL --unit UNIT --only KIND` runs the checks of one kind.
"""


def page() -> str:
    """Return the whole page, as Markdown: a table a protocol."""
    return "\n".join([_HEAD, *(_part(load_protocol(name)) for name in _PROTOCOLS)])


def _part(protocol: Protocol) -> str:
    rows = coverage(protocol)
    registry = protocol.registry()
    first = "section" if "sections" in registry["document"] else "page"
    table = [
        f"| {first} | rule | | what the document says | seen by, or why by none |",
        "|---|---|---|---|---|",
    ]
    return "\n".join([f"## {registry['title']}", "", _counted(rows), "", *table, *_rows(rows), ""])


def _counted(rows: Sequence[Coverage]) -> str:
    musts = [row for row in rows if row.strength == "must"]
    checked = sum(bool(row.checks) for row in musts)
    return (
        f"{len(rows)} rules, {len(musts)} of them musts: {checked} have checks, "
        f"{len(musts) - checked} have waivers."
    )


def _rows(rows: Sequence[Coverage]) -> Iterator[str]:
    for row in rows:
        strength = row.strength + (", host" if row.subject == "host" else "")
        seen = ", ".join(f"`{name}`" for name in row.checks) or _cell(row.waiver)
        where = row.where.partition(" ")[2]
        yield f"| {where} | {row.rule} | {strength} | {_cell(_beginning(row.says))} | {seen} |"


def _beginning(text: str) -> str:
    return textwrap.shorten(text, _MOST_SAID, placeholder=" …")


def _cell(text: str) -> str:
    """Return text that a cell of a table shows as it is."""
    for mark in "\\|<>*_`[]":
        text = text.replace(mark, f"\\{mark}")
    return text


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8", newline="\n")
