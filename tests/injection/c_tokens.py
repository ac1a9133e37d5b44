"""C as a compiler sees it: its tokens, without comments and without what stands in literals."""

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
    """Return the tokens of a file without comments; of literals that follow each other, one empty one.

    Lines matter to directives alone, so that empty ones are left out.
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
    """Yield what stands in a file that is neither text nor plain C."""
    for kind, text in _tokens(source):
        if kind == "comment" and text.find("/*", 2) != -1:
            yield f"a comment in a comment: {text}"
        elif kind not in ("comment", "literal") and sentinel in text:
            yield f"{text!r} is neither text nor comment"
        elif kind == "literal" and not text.isascii():
            yield f"{text} is not ASCII"


def _tokens(source: str) -> Iterator[tuple[str, str]]:
    """Yield kind and text of each token, as a compiler has them: trigraphs first, then joined lines."""
    source = _TRIGRAPH.sub(lambda found: _TRIGRAPHS[found[1]], source).replace("\\\n", "")
    at = 0
    while at < len(source):
        found = _TOKEN.match(source, at)
        if found is None:
            line = source.count("\n", 0, at) + 1
            raise SyntaxError(f"no C in line {line}: {source[at : at + 40]!r}")
        yield str(found.lastgroup), found[0]
        at = found.end()
