"""Help maintainers who have the vendors' documents: ``python tests/spec/document COMMAND``.

``sentences DOCUMENT PAGE`` prints the sentences of a page, each with the reference to enter in ``rules.yaml``
or ``not_rules.yaml``. A mark shows a normative sentence. ``runs`` lists the long runs of words that files of
this repository share with a document.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1] / "support")]


def main() -> int:
    parser = argparse.ArgumentParser(prog="python tests/spec/document", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("sentences", help="print the sentences of a page with references")
    one.add_argument("document", choices=("thorlabs_apt", "thorlabs_apt_issue_37", "asi_ms2000"))
    one.add_argument("page", type=int, help="number of the page or section")
    commands.add_parser("runs", help="list long runs of words of the documents in this repository")
    arguments = parser.parse_args()
    if arguments.command == "runs":
        return print_runs()
    return print_sentences(arguments.document, arguments.page)


def print_sentences(name: str, page: int) -> int:
    from document import flow, layout_sentences, sentences, text

    path = text.find(name)
    if path is None:
        print(f"the text of the document is not available (see {text.VARIABLE})", file=sys.stderr)
        return 1
    if name == "thorlabs_apt_issue_37":
        for at, number, short, words in layout_sentences.LayoutSentences(path).on(page):
            mark = "*" if flow.NORMATIVE.search(words) else " "
            print(mark, f"{{page: {at}, number: {number}, digest: {short!r}}} {words!r}")
        return 0
    for one in sentences.read(name, text.Document.read(path)).on(page):
        print("*" if flow.NORMATIVE.search(one.sentence.text) else " ", one)
    return 0


def print_runs() -> int:
    from document import runs

    found = [run for run in runs.in_repository() if not runs.is_listed(run)]
    for run in found:
        print(run)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
