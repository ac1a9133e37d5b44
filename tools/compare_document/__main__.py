"""Compare the transcription of Issue 37 (``printed/`` of the overlay) with the text of the document.

``python tools/compare_document [TEXT]`` reads headings, byte tables, field tables, values, lists, the index,
conversion factors and examples from the text and compares each with the transcription. It prints the
differences that ``read_by_eye.yaml`` does not list, and how many places it compared. Chapters that are not
transcribed are counted.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).parents[1]))

from compare_document import checks, layout
from compare_document.comparison import BY_EYE, ROOT, Comparison, Transcription, load, resolve

TEXT: Final = ROOT.parent / "shared" / "documents" / "thorlabs_apt_issue_37.txt"


def main() -> int:
    """Print the differences and the figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("text", type=Path, nargs="?", default=TEXT, help="text of Issue 37")
    text = parser.parse_args().text
    if not text.is_file():
        parser.error(f"cannot find the text of the document at {text}: give its path")
    comparison = checks.compare(layout.read(text), Transcription.load())
    wrong = resolve(comparison, load(BY_EYE)["places"])
    for line in wrong:
        print(line)
    print(figures(comparison))
    return 1 if wrong else 0


def figures(comparison: Comparison) -> str:
    """Return the numbers of compared places, and of messages in chapters that are not transcribed."""
    rows: list[tuple[str, ...]] = [(" read", "equal", "by eye")]
    for what, count in sorted(comparison.read.items()):
        equal = comparison.equal[what]
        rows.append((f"{count:5}", f"{equal:5}", f"{count - equal:6}", what))
    return "\n".join("  ".join(row).rstrip() for row in [*rows, *missing_chapters(comparison)])


def missing_chapters(comparison: Comparison) -> Iterator[tuple[str]]:
    """Yield a line for the lists, the index and each chapter with parts that are not transcribed."""
    document = comparison.document
    printed = {entry["line"] for entry in comparison.transcription.lists["lists"].values()}
    rows = [rows for line, (_, rows) in document.lists.items() if line not in printed]
    yield (f"not transcribed: {len(rows)} lists of messages, {sum(map(len, rows))} rows",)
    last = comparison.transcription.contents["rows"][-1]["line"]
    rest = sum(row.line > last for row in document.index)
    yield (f"not transcribed: {rest} rows of the index",)
    for pages, title in document.chapters():
        if pages not in comparison.transcribed:
            headings = sum(heading.page in pages for heading in document.headings)
            tables = sum(table.page in pages for table in document.tables)
            examples = sum(example.page in pages for example in document.examples)
            counts = f"{headings} headings, {tables} byte tables, {examples} examples"
            yield (f"not transcribed: {title}, {counts}",)


if __name__ == "__main__":
    sys.exit(main())
