"""The canonical form of the YAML of a spec, which keeps every comment (``docs/how-to/formatting.md``).

``find`` lists the files of a folder, ``format_file`` formats one of them. ``tree`` parses a file, ``rules``
makes its keys, quotes and numbers canonical by its schema, and ``layout`` prints the tree. ``canonical`` does
all of this for one text, and proves that the result has the same meaning.
"""

from stagewire_generator.formatting.files import (
    NotFormattedError,
    Outcome,
    canonical,
    find,
    format_file,
)

__all__ = ["NotFormattedError", "Outcome", "canonical", "find", "format_file"]
