"""The canonical form of the YAML of a spec, which keeps every comment (``docs/formatting.md``).

``find`` gives the files of a folder, ``format_file`` formats one of them. A file is read to a tree
(``reading``, ``comments``), its keys, quotes and numbers are made canonical (``rules``, ``spelling``) by what
its schema says (``place``, ``shape``), and the tree is laid out (``layout``). ``form`` does all of this for
one text, and proves that what it made says the same.
"""

from stagewire_generator.formatting.files import Outcome, find, format_file
from stagewire_generator.formatting.form import NotFormattedError, canonical

__all__ = ["NotFormattedError", "Outcome", "canonical", "find", "format_file"]
