"""What the document prints, held against what the registry encodes, place by place.

Every difference has a place name that an erratum can claim, such as ``table/MOT_REQ_AVMODES/id``. Two kinds
of difference are so common that they are one place each: ``names/blanks`` (underscores that the scan lost)
and ``headers/bar`` (the ``d|`` of a data frame that it shows as ``d``).
"""

from __future__ import annotations

from collections.abc import Sequence

from stagewire_generator.lint.witness.chapters import compare_section
from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.lint.witness.lists import (
    compare_contents,
    compare_lists,
    compare_summary,
)
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import Document

__all__ = ["Comparison", "compare_witness"]

_LISTS = {
    "contents": compare_contents,
    "summary": compare_summary,
    "lists": compare_lists,
}


def compare_witness(protocol: Protocol, printed: Sequence[Document]) -> Comparison:
    """Compare all files of the witness with the registry; chapters first, as lists refer to them."""
    comparison = Comparison(protocol, Document("printed", {}, {}))
    for document in printed:
        if document.data["chapter"] not in _LISTS:
            comparison.document = document
            for name, entry in document.data["messages"].items():
                compare_section(comparison, name, entry)
    for document in printed:
        compare = _LISTS.get(document.data["chapter"])
        if compare:
            comparison.document = document
            compare(comparison)
    return comparison
