"""The prose of the checkout: pages, docstrings, comments, messages, and texts in the registry."""

from __future__ import annotations

import ast
import io
import re
import subprocess
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import yaml

from checkout import ROOT

CODE = "X"
"""Replacement for a code span, an expression or a placeholder in a passage."""

_SHORTEST = 3
"""A string with fewer words is a name or a unit, not a sentence."""

_SPAN = re.compile(r"(`+)(?!`).*?(?<!`)\1(?!`)", re.S)
_FIELD = re.compile(
    r":(?:param|raises|returns?|type|yields|ivar)\b[^:]*:|@(?:param(?:\[[\w,]*\])?|ref|p|see) \S+|@\w+"
)
_ROLE = re.compile(r":\w+:(?=`)")
_SPACE = re.compile(r"\s+")
_WRITTEN_WORD = re.compile(r"[(\"']?[^\W\d_]+[-'’]?[^\W\d_]*[.,:;!?)\"']*")
_WORD = re.compile(r"[^\W\d_]{2,}")
_FENCE = re.compile(r"^( *)(`{3,})(\w*)[^\n]*\n(.*?)^\1\2 *$", re.M | re.S)
_QUOTE = re.compile(r"^ *>.*$", re.M)
_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_TAG = re.compile(r"<!--.*?-->|<[^<>]+>", re.S)
_ITEM = re.compile(r"^ *(?:[-*+]|\d+\.|#+) +", re.M)
_C_COMMENT = re.compile(r"/\*(.*?)\*/|//([^\n]*)", re.S)
_HASH_COMMENT = re.compile(r"(?:^|(?<=\s))#+(?: |$)([^\n]*)", re.M)
_JINJA_COMMENT = re.compile(r"\{#-?(.*?)-?#\}", re.S)
_JINJA = re.compile(r"\{\{.*?\}\}|\{%.*?%\}", re.S)

VENDORS = {"says", "printed", "encoded", "spelling", "data", "stream", "arithmetic", "detail"}
"""Keys of the registry whose values are a document's words or bytes."""

_BAD = {f"tests/style/{name}" for name in ("patterns.yaml", "old_sentences.yaml")}

_HASH = {".yml", ".yaml", ".toml", ".cmake", ".sh", ".rules", ".cfg"}
_C = {".c", ".h", ".mjs", ".cjs", ".js", ".ld"}


@dataclass(frozen=True)
class Passage:
    """A piece of prose: its file, first line, kind and text."""

    path: str
    line: int
    kind: str
    text: str

    @property
    def words(self) -> int:
        """The number of words."""
        return len(_WORD.findall(self.text))


def plain(text: str) -> str:
    """Return a text on one line, with code spans replaced by ``X``."""
    return _SPACE.sub(" ", _SPAN.sub(CODE, _ROLE.sub("", _FIELD.sub("", text)))).strip()


def _sentence_like(text: str) -> bool:
    words = text.split()
    found = sum(bool(_WRITTEN_WORD.fullmatch(word)) for word in words)
    return found >= _SHORTEST and 2 * found > len(words)


def docstrings(source: str) -> Iterator[tuple[int, str]]:
    """Yield all docstrings of a module, including those of attributes, with their lines."""
    for node in ast.walk(ast.parse(source)):
        body = getattr(node, "body", None)
        for child in body if isinstance(body, list) else ():
            match child:
                case ast.Expr(value=ast.Constant(value=str(text), lineno=line)):
                    yield line, text


def paragraphs(line: int, text: str) -> Iterator[tuple[int, str]]:
    """Yield the paragraphs and list items of a text, with their lines."""
    start, gathered = line, list[str]()
    for number, row in enumerate(text.splitlines(), line):
        item = re.match(r"\s*(?:[-*] |:\w+[^:]*:|>>> |\.\. )", row)
        if not row.strip() or item:
            if gathered:
                yield start, "\n".join(gathered)
            gathered = []
        if row.strip():
            if not gathered:
                start = number
            gathered.append(re.sub(r"^\s*[-*] ", "", row))
    if gathered:
        yield start, "\n".join(gathered)


def _of_python(source: str, messages: bool) -> Iterator[tuple[int, str, str]]:
    tree = ast.parse(source)
    documented = set()
    for line, text in docstrings(source):
        documented.add(line)
        for at, paragraph in paragraphs(line, text):
            if not paragraph.lstrip().startswith((">>> ", ".. ")):
                yield at, "docstring", paragraph
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name.startswith(
            "test_"
        ):
            yield (
                node.lineno,
                "name",
                node.name.removeprefix("test_").replace("_", " ").capitalize(),
            )
    yield from _comments(source)
    if messages:
        yield from _messages(tree, documented)


def _comments(source: str) -> Iterator[tuple[int, str, str]]:
    """Yield comments. Those on adjacent lines are joined."""
    start, last, gathered = 0, -1, list[str]()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT:
            continue
        line, column = token.start
        alone = not token.line[:column].strip()
        if gathered and not (alone and line == last + 1):
            yield start, "comment", " ".join(gathered)
            gathered = []
        if not gathered:
            start = line
        if not re.match(r"# ?(?:noqa|type:|mypy:|ruff:|pragma:|fmt:)|#!", token.string):
            gathered.append(token.string.lstrip("# ").strip())
        last = line if alone else -1
    if gathered:
        yield start, "comment", " ".join(gathered)


def _messages(tree: ast.AST, documented: set[int]) -> Iterator[tuple[int, str, str]]:
    """Yield strings that read like sentences, with expressions replaced by ``X``."""
    inner = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            inner |= {id(part) for part in node.values}
            text = "".join(
                str(part.value) if isinstance(part, ast.Constant) else CODE for part in node.values
            )
            yield from (
                (node.lineno, "message", row) for row in text.split("\n\n") if _sentence_like(row)
            )
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in inner
            and node.lineno not in documented
        ):
            for row in node.value.split("\n\n"):
                if _sentence_like(row):
                    yield node.lineno, "message", row


def _of_markdown(text: str) -> Iterator[tuple[int, str, str]]:
    def blank(found: re.Match[str]) -> str:
        return "\n" * found.group().count("\n")

    for block in _FENCE.finditer(text):
        first = text.count("\n", 0, block.start(4)) + 1
        if block[3] in ("python", "sh", "yaml", "toml", "cmake"):
            for number, row in enumerate(block[4].splitlines(), first):
                if comment := _HASH_COMMENT.search(row):
                    yield number, "comment", comment[1]
        if block[3] == "c":
            for comment in _C_COMMENT.finditer(block[4]):
                line = first + block[4].count("\n", 0, comment.start())
                yield line, "comment", comment[1] or comment[2]
    text = _FENCE.sub(blank, text)
    text = _QUOTE.sub("", text)
    text = _TAG.sub(blank, text)
    text = _LINK.sub(r"\1", text)
    for at, paragraph in paragraphs(1, text):
        rows = paragraph.split("\n")
        if rows[0].lstrip().startswith("|"):
            for number, row in enumerate(rows, at):
                for cell in re.split(r"(?<!\\)\|", _SPAN.sub(CODE, row)):
                    if _WORD.search(cell):
                        yield number, "prose", cell
        else:
            yield at, "prose", _ITEM.sub("", paragraph)


def _of_c(text: str) -> Iterator[tuple[int, str, str]]:
    for comment in _C_COMMENT.finditer(text):
        line = text.count("\n", 0, comment.start()) + 1
        body = re.sub(r"^\s*\*+!?<?", "", comment[1] or comment[2] or "", flags=re.M)
        for at, paragraph in paragraphs(line, body.strip("*!<\n ")):
            yield at, "comment", paragraph


def _of_hashes(text: str) -> Iterator[tuple[int, str, str]]:
    start, gathered = 0, list[str]()
    for number, row in enumerate(text.splitlines(), 1):
        found = _HASH_COMMENT.search(row)
        if gathered and not (found and row.lstrip().startswith("#")):
            yield start, "comment", " ".join(gathered)
            gathered = []
        if found and not row.startswith("#!") and "$schema=" not in row:
            start = start if gathered else number
            gathered.append(found[1])
    if gathered:
        yield start, "comment", " ".join(gathered)


def _of_values(node: yaml.Node, key: str = "") -> Iterator[tuple[int, str, str]]:
    """Yield the texts below a YAML or JSON node, except vendors' words."""
    if isinstance(node, yaml.MappingNode):
        for name, value in node.value:
            if name.value not in VENDORS:
                yield from _of_values(value, name.value)
    elif isinstance(node, yaml.SequenceNode):
        for value in node.value:
            yield from _of_values(value, key)
    elif isinstance(node, yaml.ScalarNode) and _sentence_like(node.value):
        yield node.start_mark.line + 1, "registry", node.value


def _of_template(path: Path, text: str) -> Iterator[tuple[int, str, str]]:
    for comment in _JINJA_COMMENT.finditer(text):
        yield text.count("\n", 0, comment.start()) + 1, "comment", comment[1]
    text = _JINJA.sub(CODE, _JINJA_COMMENT.sub("", text))
    suffix = Path(path.stem).suffix
    if suffix == ".md":
        yield from _of_markdown(text)
    elif suffix == ".html":
        for number, row in enumerate(text.splitlines(), 1):
            if _sentence_like(row := _TAG.sub(" ", row)):
                yield number, "prose", row
    elif suffix in _C:
        yield from _of_c(text)


def _found(path: Path) -> Iterator[tuple[int, str, str]]:
    text = path.read_text(encoding="utf-8", errors="replace")
    relative = path.relative_to(ROOT)
    if path.suffix == ".py":
        yield from _of_python(text, messages=relative.parts[0] != "tests")
    elif path.suffix == ".md":
        yield from _of_markdown(text)
    elif path.suffix == ".j2":
        yield from _of_template(path, text)
    elif path.suffix in _C:
        yield from _of_c(text)
    elif path.suffix in _HASH or path.name in ("Makefile", "CMakeLists.txt", "run"):
        yield from _of_hashes(text)
    if relative.parts[0] == "spec" and path.suffix in (".yaml", ".json"):
        root = yaml.compose(text, Loader=yaml.CSafeLoader)
        if root is not None:
            yield from _of_values(root)


def files() -> list[Path]:
    """Return the files of the checkout, except transcriptions and examples of bad style."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return [
        ROOT / name
        for name in names.splitlines()
        if "/printed/" not in name and name not in _BAD and (ROOT / name).is_file()
    ]


def passages(path: Path) -> list[Passage]:
    """Return the passages of a file."""
    name = path.relative_to(ROOT).as_posix()
    return [
        Passage(name, line, kind, text)
        for line, kind, found in _found(path)
        if _WORD.search(text := plain(found))
    ]


@cache
def everything() -> tuple[Passage, ...]:
    """Return all passages of the checkout."""
    return tuple(passage for path in files() for passage in passages(path))
