"""C as text: names, comments, values, and rows of tables, as the views hand them to the templates."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from stagewire_generator.model import Enumeration, Field, FlagTable, Layout, Message, Protocol
from stagewire_generator.naming import c_layouts, c_prefix, c_table
from stagewire_generator.targets import documentation
from stagewire_generator.targets.documentation import (
    DIRECTIONS,
    Markup,
    errata_of,
    erratum_text,
    field_facts,
    message_paragraphs,
)
from stagewire_generator.targets.templates import wrapped


@dataclass(frozen=True, slots=True)
class Names:
    """The names of one package.

    :param package: the folder.
    :param prefix: what types and functions begin with, without the underscore.
    """

    package: str
    prefix: str

    @property
    def macro_prefix(self) -> str:
        """What macros begin with, without the underscore."""
        return self.prefix.upper()

    def layout(self, message: Message, layout: Layout) -> str:
        """Return the type of a layout; its functions begin with this name."""
        return f"{self.prefix}_{c_layouts(message)[layout.form]}"

    def macro(self, name: str) -> str:
        """Return what the macros of something begin with."""
        return f"{self.macro_prefix}_{name.upper()}"

    def table(self, table: Enumeration | FlagTable) -> str:
        """Return the type of an enumeration, or what the macros of a flag table are called after."""
        return f"{self.prefix}_{c_table(table)}"

    def guard(self, path: str) -> str:
        """Return the include guard of a file, by its path in the folder of the package.

        No macro of a package begins with these words, whatever its spec names.
        """
        return re.sub(r"\W", "_", f"stagewire/{self.prefix}/{path}").upper()


def names_of(protocol: Protocol) -> Names:
    """Return the names of the package of a protocol."""
    return Names(protocol.package, c_prefix(protocol.package))


WIDTH = 100

_ENDS = re.compile(r"\*(?=/)|/(?=\*)|\?(?=\?)")  # the end of a comment, the beginning, a trigraph
_COMMANDS = re.compile(r"[\\@]|[<&#%](?=[\w/!:#])")  # what Doxygen would make something of
# In a string; of a question mark, because two of them could begin a trigraph.
_ESCAPED = {
    **{ord(char): f"\\{char}" for char in '"\\?'},
    **{byte: f"\\{byte:03o}" for byte in (*range(0x20), *range(0x7F, 0x100))},
}
_LEAST_INT, _GREATEST_INT = -0x7FFF, 0x7FFF  # what every int holds
_LEAST_LONG = -0x80000000
_LEAST_LONG_LONG = -0x8000000000000000


def plain(text: str) -> str:
    """Escape a text for the inside of a comment, and for Doxygen; its blanks become single ones."""
    text = " ".join(text.split())
    return _COMMANDS.sub(
        lambda found: f"\\{found[0]}", _ENDS.sub(lambda found: f"{found[0]} ", text)
    )


def comment(paragraphs: Iterable[str], indent: int = 0) -> str:
    """Return a comment of Doxygen with these texts, which are escaped; empty ones are left out.

    It stands on one line if it fits. The first line carries no indentation (the template has it).
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
    """Return what ``comment`` would, without its first and last line, for a comment that says more."""
    return tuple(f" * {line}".rstrip() for line in _wrapped(paragraphs, 0))


def _wrapped(paragraphs: Iterable[str], indent: int) -> list[str]:
    """Return the lines of escaped paragraphs, with an empty one between two."""
    lines: list[str] = []
    for text in filter(None, paragraphs):
        lines += [""] if lines else []
        lines += wrapped(plain(text), WIDTH - indent - len(" * "))
    return lines


def string(text: str) -> str:
    """Return a string literal: its bytes are those of the text as UTF-8."""
    return octets(text.encode("utf-8"))


def octets(raw: bytes) -> str:
    """Return a string literal of these bytes."""
    return f'"{raw.decode("latin-1").translate(_ESCAPED)}"'


def integer(value: int, size: int, signed: bool) -> str:
    """Return a literal of the type that holds integers of so many bytes."""
    if not signed:
        return unsigned(value, size)
    if _LEAST_INT <= value <= _GREATEST_INT:
        return str(value)
    kind = "INT32_C" if size <= 4 else "INT64_C"
    if value in (_LEAST_LONG, _LEAST_LONG_LONG):  # its number without the sign is none
        return f"(-{kind}({-value - 1}) - 1)"
    return f"{kind}({value})" if value >= 0 else f"-{kind}({-value})"


def unsigned(value: int, size: int, digits: int = 0) -> str:
    """Return a literal of an unsigned type; in hex with so many digits if any are asked for."""
    number = f"0x{value:0{digits}X}" if digits else str(value)
    if size <= 2:
        return f"{number}U"
    return f"UINT32_C({number})" if size <= 4 else f"UINT64_C({number})"


def call(head: str, arguments: Sequence[str], tail: str = "", indent: int = 0) -> str:
    """Return ``head(arguments)tail``: on one line if it fits, else the arguments on the next or each on one.

    The first line carries no indentation (the template has it).
    """
    inside = ", ".join(arguments)
    line = f"{head}({inside}){tail}"
    if indent + len(line) <= WIDTH:
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
    """Return how the comments of a package write names: as its code does."""

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

    :param layout: None where the message has none.
    :param size: how long it is, in words.
    """
    markup = markup_of(names)
    id = f"0x{message.id:0{protocol.id_digits}X}"
    first = f"{message.name} ({id}), {DIRECTIONS[message.direction]}, {size}"
    if not message.overlay:
        first += f"; {where(protocol, message.pages)}"
    return comment([
        f"{first}.",
        *message_paragraphs(protocol, message, layout, markup),
        *(erratum_text(erratum, markup) for erratum in errata_of(protocol, message.errata)),
    ])  # fmt: skip


def field_doc(names: Names, field: Field) -> str:
    """Return the comment on a member."""
    return comment([documentation.sentence(field_facts(field, markup_of(names)))], 4)


def where(protocol: Protocol, pages: Sequence[int], overlay: str = "") -> str:
    """Return where in the document something stands, as a comment names it."""
    return documentation.where(protocol, pages, Markup(str, lambda table: table.name), overlay)


@dataclass(frozen=True, slots=True)
class EntryView:
    """One row: its initialiser, and the name of its message as a literal."""

    code: str
    name: str
