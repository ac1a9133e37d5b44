"""A tokeniser for C that skips comments and the content of literals."""

from __future__ import annotations

import re
from collections.abc import Iterator

_TRIGRAPHS = dict(zip("=/'()!<>-", "#\\^[]|{}~", strict=True))
_TRIGRAPH = re.compile(r"\?\?([=/'()!<>-])")
_TOKEN = re.compile(
    r"(?P<comment>/\*.*?\*/|//[^\n]*)"
    r'|(?P<literal>"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\')'
    r"|(?P<word>[A-Za-z_]\w*)"
    r"|(?P<number>\.?[0-9](?:[eEpP][+-]|[\w.])*)"
    r"|(?P<line>\n)"
    r"|(?P<space>[ \t]+)"
    r"|(?P<mark><<=|>>=|\.\.\.|->|\+\+|--|<<|>>|[<>=!]=|&&|\|\||[-+*/%&|^]=|##"
    r"|[-+*/%&|^~!<>=?:;,.(){}\[\]#\\])",
    re.DOTALL | re.ASCII,
)


def blanked_c(source: str) -> list[str]:
    """Return the tokens of a file without comments, with one empty literal for consecutive literals.

    Lines matter only to directives, so empty lines are omitted.
    """
    tokens: list[str] = []
    for kind, text in _tokens(source):
        if kind in ("comment", "space"):
            continue
        token = text[0] * 2 if kind == "literal" else text
        if token not in ("\n", '""') or tokens[-1:] != [token]:
            tokens.append(token)
    return tokens


def faults_of_c(source: str, sentinel: str) -> Iterator[str]:
    """Yield the problems of a C file: nested comments, payloads in code, literals that are not ASCII."""
    for kind, text in _tokens(source):
        if kind == "comment" and text.find("/*", 2) != -1:
            yield f"nested comment: {text}"
        elif kind not in ("comment", "literal") and sentinel in text:
            yield f"{text!r} is outside literals and comments"
        elif kind == "literal" and not text.isascii():
            yield f"{text} is not ASCII"


def _tokens(source: str) -> Iterator[tuple[str, str]]:
    """Yield the kind and text of each token, after trigraphs are replaced and lines joined."""
    source = _TRIGRAPH.sub(lambda found: _TRIGRAPHS[found[1]], source).replace("\\\n", "")
    at = 0
    while at < len(source):
        found = _TOKEN.match(source, at)
        if found is None:
            line = source.count("\n", 0, at) + 1
            raise SyntaxError(f"invalid C in line {line}: {source[at : at + 40]!r}")
        yield str(found.lastgroup), found[0]
        at = found.end()
