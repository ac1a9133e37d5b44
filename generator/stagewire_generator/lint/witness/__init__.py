"""What the document prints, held against what the registry encodes, place by place.

Every difference has a place name that an erratum can claim, such as ``table/MOT_REQ_AVMODES/id``. Two kinds
of difference are so common that they are one place each: ``names/blanks`` (underscores that the scan lost)
and ``headers/bar`` (the ``d|`` of a data frame that it shows as ``d``). A document of commands without a
header has chapters of its own, and places such as ``command/START_MOTOR/hex``; what its words mean is
told by a vocabulary in one of them.
"""

from __future__ import annotations

from collections.abc import Sequence

from stagewire_generator.lint.witness.chapters import compare_section
from stagewire_generator.lint.witness.commands import compare_commands
from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.lint.witness.lists import (
    compare_contents,
    compare_lists,
    compare_summary,
)
from stagewire_generator.lint.witness.slots import (
    compare_document,
    compare_format,
    compare_setup,
    compare_wording,
)
from stagewire_generator.lint.witness.vocabulary import Vocabulary
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import Document

__all__ = ["Comparison", "compare_witness"]

# Chapters that have a form of their own. Where messages have a header, every other has their sections.
_CHAPTERS = {
    "header": {
        "contents": compare_contents,
        "summary": compare_summary,
        "lists": compare_lists,
    },
    "slots": {
        "document": compare_document,
        "setup": compare_setup,
        "format": compare_format,
        "commands": compare_commands,
        "wording": compare_wording,
    },
}


def compare_witness(protocol: Protocol, printed: Sequence[Document]) -> Comparison:
    """Compare all files of the witness with the registry; sections first, as lists refer to them."""
    words = [d.data["vocabulary"] for d in printed if "vocabulary" in d.data]
    vocabulary = Vocabulary.of(words[0]) if words else None
    comparison = Comparison(protocol, Document("printed", {}, {}), vocabulary)
    kind = protocol.framing["kind"]
    named = {chapter for chapters in _CHAPTERS.values() for chapter in chapters}
    for document in printed:
        comparison.document = document
        chapter = document.data["chapter"]
        if kind == "header" and chapter not in named:
            for name, entry in document.data["messages"].items():
                compare_section(comparison, name, entry)
        elif chapter not in _CHAPTERS[kind]:  # that of a document of the other kind
            comparison.unknown.append((document.place("chapter"), chapter))
    for document in printed:
        compare = _CHAPTERS[kind].get(document.data["chapter"])
        if compare:
            comparison.document = document
            compare(comparison)
    return comparison
