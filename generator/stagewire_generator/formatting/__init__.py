"""Format the YAML of a spec in canonical form, keeping all comments (``docs/how-to/formatting.md``).

``find`` lists the files in a directory, and ``format_file`` formats one of them. ``tree`` parses a file,
``rules`` makes its keys, quotes and numbers canonical according to its schema, and ``layout`` prints the
tree. ``canonical`` does all of this for one text, and verifies that the result has the same meaning.
"""

from stagewire_generator.formatting.files import (
    NotFormattedError,
    Outcome,
    canonical,
    find,
    format_file,
)

__all__ = ["NotFormattedError", "Outcome", "canonical", "find", "format_file"]
