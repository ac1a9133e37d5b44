"""User input for the commands that read a spec: its YAML files, and a folder to write to.

The generator's tests have a small good spec for each framing, and overlays for two of them. Together they
have a file of every kind. A case damages one to three of these files, either the text or the YAML tree, or
removes, moves or duplicates files.
"""

from __future__ import annotations

import ast
import atexit
import hashlib
import json
import shutil
import tempfile
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import yaml
from junitparser import JUnitXml
from malformed_text import damaged_bytes, damaged_text, damaged_tree, word
from sandbox import Case, Content, Link, Ran, Wrong

_GENERATOR = Path(__file__).parents[1] / "generator"
FILES = {
    path.relative_to(good).as_posix(): path.read_bytes()
    for good in map(
        _GENERATOR.joinpath, ("good_spec", "good_commands", "good_packets", "good_overlays")
    )
    for path in sorted(good.rglob("*.yaml"))
}
_ROOMS = ("captures", "errata", "examples", "messages", "printed")
KINDS = sorted({p.parent.name if p.parent.name in _ROOMS else p.stem for p in map(Path, FILES)})
"""The kinds of spec files, named after their folders or file names."""

OUT = "out"
_TARGETS = ("c", "c-tests", "python", "registry", "vectors")
_ODD_NAMES = (
    "tiny/messages/a b.yaml", "tiny/messages/.yaml", "tiny/messages/é.yaml", "tiny/messages/con.yaml",
    "tiny/messages/deep/more.yaml", "tiny/extra.yaml", "tiny/units.yml", "other/protocol.yaml",
    "tiny/overlays/fourth/overlay.yaml", "tiny/overlays/second/protocol.yaml",
    "turtle/stages.yaml", "turtle/messages/core.yaml", "tiny/messages/walk.yaml",
    "protocol.yaml", "tiny/printed/core.yaml/file.yaml", "conformance/examples/other.yaml", "tiny/\x1b.yaml",
)  # fmt: skip


@cache
def good() -> Path:
    """Return a folder with the good files of all protocols, removed when the process ends."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for name, content in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def _commands(rng: Random) -> tuple[str, ...]:
    """Return a command line that reads the spec, or the folder of one protocol."""
    alone = ("spec/tiny", "spec/turtle", "spec/carousel")
    folder = "spec" if rng.random() < 0.8 else rng.choice(alone)
    command = rng.random()
    if command < 0.1:
        return ("format", *(["--check"] * (rng.random() < 0.5)), folder)
    if command < 0.2:
        return ("check", folder, "--format", rng.choice(("json", "github", "junit")))
    if command < 0.5:
        return ("check", folder)
    one = rng.random() < 0.1
    wanted = [rng.choice(_TARGETS)] if one else _TARGETS if rng.random() < 0.8 else ()
    options = [word for target in wanted for word in ("--target", target)]
    if folder in ("spec", "spec/tiny") and rng.random() < 0.3:
        options += ["--overlay", "tiny/second"]
    if folder in alone and rng.random() < 0.5:
        options += ["--package", "somebody"]
    return ("generate", "--spec", folder, "--out", OUT, *options)


def _case(rng: Random, files: dict[str, Content]) -> Case:
    """Return a case that runs on the good spec with some files changed."""
    if rng.random() < 0.05:  # rename or duplicate a file
        name = rng.choice(list(FILES))
        odd = rng.choice((*_ODD_NAMES, *FILES))
        if not any(odd.startswith(f"{other}/") for other in FILES):
            files[odd] = FILES[name]
        if rng.random() < 0.5:
            files[name] = None
    arguments = _commands(rng)
    written, holds = _BY_COMMAND[arguments[0]]
    return Case(
        arguments,
        files={f"spec/{name}": content for name, content in files.items()},
        base=good(),
        may_write="" if "--check" in arguments else written,
        holds=holds,
    )


def spec_text(rng: Random) -> Case:
    """A spec with damaged text in some files."""
    return _case(rng, damaged_texts(rng))


def spec_tree(rng: Random) -> Case:
    """A spec with other content in some files, which are still valid YAML."""
    return _case(rng, damaged_trees(rng))


def damaged_texts(rng: Random) -> dict[str, Content]:
    """Return files with damaged text, by name."""
    files: dict[str, Content] = {}
    for name in rng.sample(list(FILES), rng.choice((1, 1, 2))):
        text = FILES[name].decode("utf-8")
        for _ in range(rng.choice((1, 1, 2, 3))):
            text = damaged_text(rng, text)
        content = text.encode("utf-8", "surrogatepass")
        files[name] = damaged_bytes(rng, content) if rng.random() < 0.1 else content
    return files


@cache
def _tree(name: str) -> str:
    """Return the YAML tree of a file as JSON, which is quick to copy."""
    return json.dumps(yaml.safe_load(FILES[name]))


def damaged_trees(rng: Random) -> dict[str, Content]:
    """Return files with changed trees, by name."""
    files: dict[str, Content] = {}
    for name in rng.sample(list(FILES), rng.choice((1, 1, 2))):
        tree: Any = json.loads(_tree(name))
        if rng.random() < 0.4:
            _other_texts(rng, tree)
        else:
            for _ in range(rng.choice((1, 1, 1, 2, 3))):
                tree = damaged_tree(rng, tree)
        files[name] = _yaml(tree)
    return files


def _other_texts(rng: Random, tree: Any) -> None:
    """Change texts that no rule restricts, so that the spec stays valid and code is generated."""
    if isinstance(tree, list):
        for item in tree:
            _other_texts(rng, item)
    elif isinstance(tree, dict):
        for key, value in tree.items():
            if not isinstance(value, str):
                _other_texts(rng, value)
            elif key in _FREE_TEXTS and rng.random() < 0.5:
                tree[key] = "".join(filter(str.isprintable, value + word(rng)))


_FREE_TEXTS = ("summary", "note", "title", "date", "found", "resolution", "evidence", "subject")


def _yaml(tree: Any) -> bytes:
    # wide lines: folded text would be refused for its line breaks
    text: str = yaml.dump(tree, Dumper=_Plain, allow_unicode=True, sort_keys=False, width=10_000)
    return text.encode("utf-8", "surrogatepass")


class _Plain(yaml.SafeDumper):
    """A dumper without aliases, which would be refused before the tree is checked."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _checked(case: Case, ran: Ran) -> None:
    """Check that every diagnostic has a code and the name of an existing file."""
    if "--format" in case.arguments:
        _reported(case.arguments[-1], ran)
    elif ran.code == 1:
        for line in ran.out.decode("utf-8").splitlines():
            if line[:1].isspace() or not line:
                continue  # the hint of the diagnostic above
            place, _, rest = line.partition(": ")
            name = place.rsplit(":", 2)[0]
            there = "\\" in name or (ran.folder / name).exists()  # special characters are escaped
            if not there or not rest.startswith("SW"):
                raise Wrong(f"diagnostic without an existing file or a code: {line!r}")


def _reported(format: str, ran: Ran) -> None:
    """Check that a machine-readable report is valid and agrees with the exit status."""
    text = ran.out.decode("utf-8" if format == "github" else "ascii")
    try:
        if format == "github":
            said = [line.startswith("::error file=") for line in text.splitlines()]
        elif format == "json":
            said = json.loads(text)["diagnostics"]
        else:
            said = [case for suite in JUnitXml.fromstring(text) for case in suite if case.result]
    except SyntaxError as error:
        raise Wrong(f"invalid XML: {error}") from error
    if bool(said) != (ran.code == 1) or not all(said):
        raise Wrong(f"exit status {ran.code} contradicts the {format} report: {text[:200]}")


def _formatted(case: Case, ran: Ran) -> None:
    """Check that other files keep their content as YAML, and that no temporary file remains."""
    spec = ran.folder / "spec"
    for path in sorted(spec.rglob("*")):
        name = path.relative_to(spec).as_posix()
        if f"spec/{name}" in case.files or path.is_dir():
            continue
        if name not in FILES:
            raise Wrong(f"{name} is a leftover file")
        content = path.read_bytes()
        if content != FILES[name] and yaml.safe_load(content) != json.loads(_tree(name)):
            raise Wrong(f"the content of {name} changed")


def _generated(case: Case, ran: Ran) -> None:
    """Check that generated Python and JSON is valid, and that no temporary file remains."""
    _checked(case, ran)
    out = ran.folder / OUT
    for path in sorted(out.rglob("*")) if ran.code == 0 else ():
        if path.is_dir():
            continue
        text = path.read_text(encoding="utf-8")
        try:
            if path.suffix == ".py":
                ast.parse(text)
            elif path.suffix == ".json":
                json.loads(text)
            elif path.name.startswith("."):
                raise Wrong(f"{path.name} is a leftover file")
        except (SyntaxError, ValueError) as error:
            raise Wrong(f"generated {path.relative_to(out)} is invalid: {error}") from error
    if ran.code and out.exists() and not any(name.startswith(OUT) for name in case.files):
        raise Wrong("the spec was refused, but files were written")


_BY_COMMAND = {
    "check": ("", _checked),
    "format": ("spec", _formatted),
    "generate": (OUT, _generated),
}
"""For each command, the folder it may write to and the check of its result."""


# The folder to write to

_PATHS = (
    "../precious/file.txt", "../../precious/file.txt", "/etc/hostname", "python/../../precious/file.txt",
    "python/stagewire_tiny/__init__.py", "python/mine.txt", "manifest.json",
    "c/stagewire_tiny/flags.h", "", ".", "C:\\x", "\0", "a" * 300, "python", "python/",
    "c/stagewire_tiny/flags.h/x",
)  # fmt: skip
_IN_THE_WAY = (
    "python/mine.txt",
    "c/stagewire_tiny/flags.h",
    "python/stagewire_tiny/flags.py",
    "c/stagewire_tiny/messages",
)
_MINE = b"made by hand\n"


def manifest(rng: Random) -> Case:
    """An output folder with an incorrect manifest, and with files and links in the way."""
    digests = (hashlib.sha256(_MINE).hexdigest(), "", "0" * 64, word(rng))
    listed: Any = {path: rng.choice(digests) for path in rng.sample(_PATHS, rng.randrange(6))}
    tree: Any = {"schema_version": 2, "files": listed}
    for _ in range(rng.choice((0, 0, 1, 2))):
        tree = damaged_tree(rng, tree)
    text = json.dumps(tree)
    if rng.random() < 0.3:
        text = damaged_text(rng, text)
    content = text.encode("utf-8", "surrogatepass")
    files: dict[str, Content] = {f"{OUT}/manifest.json": content}
    if rng.random() < 0.1:
        files[f"{OUT}/manifest.json"] = damaged_bytes(rng, content)
    for name in _IN_THE_WAY:
        if rng.random() < 0.2:
            files[f"{OUT}/{name}"] = _MINE
    link, target = rng.choice((
        ("python", "../../precious"), ("python/stagewire_tiny", "../../../precious"),
        ("c/stagewire_tiny", "../../../precious/file.txt"), ("other", "../../precious"),
        ("c/stagewire_tiny/flags.h", "nowhere"), ("python/stagewire_tiny/messages", "messages"),
    ))  # fmt: skip
    link = f"{OUT}/{link}"
    if rng.random() < 0.3 and not any(n.startswith(link) or link.startswith(n) for n in files):
        files[link] = Link(target)
    arguments = ("generate", "--spec", "spec", "--out", OUT)
    if rng.random() < 0.3:  # nothing may be written
        return Case((*arguments, "--check"), files=files, base=good(), holds=_kept)
    return Case(arguments, files=files, base=good(), may_write=OUT, holds=_kept)


def _kept(case: Case, ran: Ran) -> None:
    """Check that files made by hand, and not in the manifest, still exist unchanged."""
    precious = ran.folder.parent / "precious" / "file.txt"
    if precious.read_text(encoding="utf-8") != "somebody else's\n":
        raise Wrong("a file outside the folder was changed")
    try:
        listed = json.loads(case.files[f"{OUT}/manifest.json"])["files"]
    except (ValueError, KeyError, TypeError):
        listed = {}
    for name, content in case.files.items():
        kept = name.removeprefix(f"{OUT}/")
        ours = kept in listed if isinstance(listed, dict) else False
        path = ran.folder / name
        if content == _MINE and not ours and not (path.is_file() and path.read_bytes() == _MINE):
            raise Wrong(f"{kept}, made by hand, was lost")
