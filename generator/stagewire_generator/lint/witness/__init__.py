"""What the document prints, held against what the registry encodes, place by place.

Every difference has a place name that an erratum can claim, such as ``table/MOT_REQ_AVMODES/id``. Two kinds
of difference are so common that they are one place each: ``names/blanks`` (underscores that the scan lost)
and ``headers/bar`` (the ``d|`` of a data frame that it shows as ``d``). A document of commands without a
header has chapters of its own, and places such as ``command/START_MOTOR/hex``; what its words mean is
told by a vocabulary in one of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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

# Chapters that have a form of their own, by the kind of the framing
_OF_MESSAGES = {
    "contents": compare_contents,
    "summary": compare_summary,
    "lists": compare_lists,
}
_CHAPTERS = {
    "header": _OF_MESSAGES,
    "packet": _OF_MESSAGES,
    "slots": {
        "document": compare_document,
        "setup": compare_setup,
        "format": compare_format,
        "commands": compare_commands,
        "wording": compare_wording,
    },
}

_WITH_SECTIONS = ("header", "packet")  # every other chapter has a section for each message


def compare_witness(
    protocol: Protocol, printed: Sequence[Document], overlay: str = ""
) -> Comparison:
    """Compare all files of the witness with the registry; sections first, as lists refer to them.

    :param overlay: whose document it is that prints this; without it that of the protocol itself.
    """
    if overlay:
        # What holds for versions of the firmware has pages of the other document, too
        protocol = replace(protocol, document=protocol.document_of(overlay), firmware=())
    words = [d.data["vocabulary"] for d in printed if "vocabulary" in d.data]
    vocabulary = Vocabulary.of(words[0]) if words else None
    comparison = Comparison(protocol, Document("printed", {}, {}, overlay), vocabulary)
    kind = protocol.framing["kind"]
    named = {chapter for chapters in _CHAPTERS.values() for chapter in chapters}
    for document in printed:
        comparison.document = document
        chapter = document.data["chapter"]
        if kind in _WITH_SECTIONS and chapter not in named:
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
