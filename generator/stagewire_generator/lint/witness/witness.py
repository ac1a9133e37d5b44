"""What the document prints, held against what the registry encodes, place by place.

Every difference has a place name that an erratum can claim, such as ``table/MOT_REQ_AVMODES/id``. Two kinds
of difference are so common that they are one place each: ``names/blanks`` (underscores that the scan lost)
and ``headers/bar`` (the ``d|`` of a data frame that it shows as ``d``). A document of commands without a
header has chapters of its own, and places such as ``command/START_MOTOR/hex``; what its words mean is
told by a vocabulary in one of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from stagewire_generator.framing import FRAMINGS, part
from stagewire_generator.lint.witness.chapters import CompareTables, compare_section
from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.lint.witness.vocabulary import Vocabulary
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import Document


@dataclass(frozen=True, slots=True)
class Witness:
    """How the document of a protocol is compared, by its framing.

    :param chapters: chapters that have a form of their own -> what compares them.
    :param sections: whether every other chapter has a section for each message.
    :param tables: compares the byte tables in such a section; None where there can be none.
    """

    chapters: Mapping[str, Callable[[Comparison], None]]
    sections: bool = False
    tables: CompareTables | None = None


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
    witness: Witness = part(protocol.framing["kind"], "witness")
    named = {chapter for kind in FRAMINGS for chapter in part(kind, "witness").chapters}
    for document in printed:
        comparison.document = document
        chapter = document.data["chapter"]
        if witness.sections and chapter not in named:
            for name, entry in document.data["messages"].items():
                compare_section(comparison, name, entry, witness.tables)
        elif chapter not in witness.chapters:  # that of a document of the other kind
            comparison.unknown.append((document.place("chapter"), chapter))
    for document in printed:
        compare = witness.chapters.get(document.data["chapter"])
        if compare:
            comparison.document = document
            compare(comparison)
    return comparison
