"""C source text for views: names, comments, values and rows of tables."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.model_fields import Enumeration, Field, FlagTable
from stagewire_generator.naming import c_layouts, c_prefix, c_table
from stagewire_generator.targets.documentation import (
    DIRECTIONS,
    Markup,
    errata_of,
    erratum_text,
    field_facts,
    message_paragraphs,
    sentence,
    shown_id,
    where,
)
from stagewire_generator.targets.templates import wrapped


class Names(NamedTuple):
    """The names of a package.

    :param package: name of its directory.
    :param prefix: prefix of types and functions, without the underscore.
    """

    package: str
    prefix: str

    @property
    def macro_prefix(self) -> str:
        """Prefix of macros, without the underscore."""
        return self.prefix.upper()

    def layout(self, message: Message, layout: Layout) -> str:
        """Return the type of a layout, which is also the prefix of its functions."""
        return f"{self.prefix}_{c_layouts(message)[layout.form]}"

    def macro(self, name: str) -> str:
        """Return a name as a macro, or as the prefix of macros."""
        return f"{self.macro_prefix}_{name.upper()}"

    def table(self, table: Enumeration | FlagTable) -> str:
        """Return the type of an enumeration, or the prefix of the macros of a flag table."""
        return f"{self.prefix}_{c_table(table)}"

    def guard(self, path: str) -> str:
        """Return the include guard of a file from its path in the directory of the package.

        No other macro of a package can have this prefix.
        """
        return re.sub(r"\W", "_", f"stagewire/{self.prefix}/{path}").upper()


def names_of(protocol: Protocol) -> Names:
    """Return the names of the package of a protocol."""
    return Names(protocol.package, c_prefix(protocol.package))


WIDTH = 100

_ENDS = re.compile(r"\*(?=/)|/(?=\*)|\?(?=\?)")  # the end or beginning of a comment, a trigraph
_COMMANDS = re.compile(r"[\\@]|[<&#%](?=[\w/!:#])")  # characters that Doxygen interprets
# Escapes in a string; includes the question mark, because two of them can begin a trigraph.
_ESCAPED = {
    **{ord(char): f"\\{char}" for char in '"\\?'},
    **{byte: f"\\{byte:03o}" for byte in (*range(0x20), *range(0x7F, 0x100))},
}
_LEAST_INT, _GREATEST_INT = -0x7FFF, 0x7FFF  # the range of int on every platform
_LEAST_LONG = -0x80000000
_LEAST_LONG_LONG = -0x8000000000000000


def plain(text: str) -> str:
    """Escape a text for a comment and for Doxygen; runs of white space become single spaces."""
    text = " ".join(text.split())
    return _COMMANDS.sub(
        lambda found: f"\\{found[0]}", _ENDS.sub(lambda found: f"{found[0]} ", text)
    )


def comment(paragraphs: Iterable[str], indent: int = 0) -> str:
    """Return a Doxygen comment with these paragraphs, escaped; empty ones are left out.

    A short comment is on one line. The first line is not indented: the template does that.
    """
    lines = _wrapped(paragraphs, indent)
    if len(lines) == 1:
        line = f"/** {lines[0]} */"
        if indent + len(line) <= WIDTH:
            return line
    pad = " " * indent
    body = "\n".join(f"{pad} * {line}".rstrip() for line in lines)
    return f"/**\n{body}\n{pad} */"


def comment_lines(paragraphs: Iterable[str]) -> tuple[str, ...]:
    """Return the inner lines of ``comment``, for a comment with more text."""
    return tuple(f" * {line}".rstrip() for line in _wrapped(paragraphs, 0))


def _wrapped(paragraphs: Iterable[str], indent: int) -> list[str]:
    """Return the lines of escaped paragraphs, separated by empty lines."""
    lines: list[str] = []
    for text in filter(None, paragraphs):
        lines += [""] if lines else []
        lines += wrapped(plain(text), WIDTH - indent - len(" * "))
    return lines


def string(text: str) -> str:
    """Return a string literal with the text in UTF-8."""
    return octets(text.encode("utf-8"))


def octets(raw: bytes) -> str:
    """Return a string literal with these bytes."""
    return f'"{raw.decode("latin-1").translate(_ESCAPED)}"'


def bits_of(field: Field) -> int:
    """Return the width of the type of an integer in bits: a power of two."""
    return max(8, 1 << (8 * field.format.size - 1).bit_length())


def integer(value: int, size: int, signed: bool) -> str:
    """Return a literal of the type for integers of this size in bytes."""
    if not signed:
        return unsigned(value, size)
    if _LEAST_INT <= value <= _GREATEST_INT:
        return str(value)
    kind = "INT32_C" if size <= 4 else "INT64_C"
    if value in (_LEAST_LONG, _LEAST_LONG_LONG):  # its magnitude does not fit the type
        return f"(-{kind}({-value - 1}) - 1)"
    return f"{kind}({value})" if value >= 0 else f"-{kind}({-value})"


def unsigned(value: int, size: int, digits: int = 0) -> str:
    """Return a literal of an unsigned type; in hex if a number of digits is given."""
    number = f"0x{value:0{digits}X}" if digits else str(value)
    if size <= 2:
        return f"{number}U"
    return f"UINT32_C({number})" if size <= 4 else f"UINT64_C({number})"


def call(
    head: str, arguments: Sequence[str], tail: str = "", indent: int = 0, before: int = 0
) -> str:
    """Return ``head(arguments)tail``.

    If it does not fit on one line, the arguments go on the next line, or on one line each. The first line
    is not indented: the template does that.

    :param before: the width of what the template has between the indentation and the call.
    """
    inside = ", ".join(arguments)
    line = f"{head}({inside}){tail}"
    if indent + before + len(line) <= WIDTH:
        return line
    pad = " " * (indent + 4)
    line = f"{pad}{inside}){tail}"
    if len(line) > WIDTH:
        line = ",\n".join(pad + argument for argument in arguments) + f"){tail}"
    return f"{head}(\n{line}"


def definition(name: str, value: str) -> str:
    """Return the definition of a macro, on several lines if it is long."""
    line = f"#define {name} {value}"
    if len(line) <= WIDTH:
        return line
    return " \\\n    ".join([f"#define {name}", *wrapped(value, WIDTH - len("     \\"))])


def markup_of(names: Names) -> Markup:
    """Return the markup of comments, which write names as the code does."""

    def table(table: Enumeration | FlagTable) -> str:
        name = names.table(table)
        if isinstance(table, FlagTable):
            return f"bits {name.upper()}_..."
        return f"see enum {name}"

    return Markup(name=str, table=table)


def message_doc(
    names: Names, protocol: Protocol, message: Message, layout: Layout | None, size: str
) -> str:
    """Return the comment on the type of a layout.

    :param layout: None if the message has none.
    :param size: its length in words.
    """
    markup = markup_of(names)
    named = f"{message.name} ({shown_id(protocol, message)})"
    found = where(protocol, message.pages, message.overlay)
    facts = f"{named}, {DIRECTIONS[message.direction]}, {size}; {found}."
    return comment([
        *message_paragraphs(protocol, message, layout, markup, facts),
        *(erratum_text(erratum, markup) for erratum in errata_of(protocol, message.errata)),
    ])  # fmt: skip


def field_doc(names: Names, field: Field) -> str:
    """Return the comment on a struct member."""
    return comment([sentence(field_facts(field, markup_of(names)))], 4)


class EntryView(NamedTuple):
    """A row of a table: its initialiser, and the name of its message as a literal."""

    code: str
    name: str
