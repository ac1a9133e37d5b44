"""User input for the commands that decode, encode and describe: hex, captures, fields, names, testee lines.

Every public function makes one :class:`~sandbox.Case` from a ``random.Random``. It starts with valid input
made from the registry, and damages it in the grammar of that input.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import jsonschema
import streams
from malformed_text import damaged_bytes, damaged_text, damaged_tree, word
from sandbox import Case, Content, Ran, Wrong

from stagewire_apt import PROTOCOL

Json = dict[str, Any]

OUT = "out"
SCHEMA = Path(__file__).parents[2] / "spec" / "schema" / "testee.schema.json"
CONTEXTS = sorted({value for cls in PROTOCOL.messages for value in cls.layout.when.values()})
REGISTRY = PROTOCOL.registry()
NAMES = sorted(
    {message["name"] for message in REGISTRY["messages"]}
    | {
        entry.get("name") or entry.get("id") or "" if isinstance(entry, dict) else entry
        for part in REGISTRY.values()
        if isinstance(part, (dict, list))
        for entry in part
    }
    | set(PROTOCOL.nameless)
)


def _argument(text: str) -> str:
    """Return the text as a valid process argument, without NUL and lone surrogates."""
    return text.replace("\0", "").encode("utf-8", "replace").decode("utf-8")


def _sometimes(rng: Random, *options: tuple[str, Callable[[], str]]) -> Iterator[str]:
    """Yield some of the options, usually with a valid value."""
    for option, value in options:
        if rng.random() < 0.3:
            yield option
            if rng.random() < 0.95:
                yield _argument(word(rng)) if rng.random() < 0.1 else value()


def _decode_options(rng: Random) -> list[str]:
    made = list(
        _sometimes(
            rng,
            ("--status", lambda: rng.choice(CONTEXTS)),
            ("--end", lambda: rng.choice(("host", "device", "none"))),
            ("--protocol", lambda: PROTOCOL.name),
        )
    )
    if rng.random() < 0.2:
        message, layout, _ = rng.choice(_layouts())
        made += ["--message", f"{message['name']}:{layout['form']}"[: rng.choice((-2, 99, 99, 99))]]
    format = rng.choice(("", "", "--json", "table", "jsonl", "csv", "parquet"))
    if format.startswith("--"):
        made.append(format)
    elif format:
        made += ["--format", format]
    if rng.random() < (0.9 if format == "parquet" else 0.2):
        made += ["--output", f"{OUT}/decoded"]
    return made


def _frames(rng: Random) -> bytes:
    data = b"".join([streams.frame(rng) for _ in range(rng.choice((0, 1, 1, 1, 3, 20)))])
    return streams.damaged(rng, data) if rng.random() < 0.5 else data


_SEPARATORS = (
    "", " ", ",", ", ", ":", "-", "\\x", " 0x", "\n", "\t", "; ", "|", "_", " # a note\n",
)  # fmt: skip


def _hex(rng: Random, data: bytes) -> str:
    separator = rng.choice(_SEPARATORS)
    digits = [f"{byte:02X}" if rng.random() < 0.9 else f"{byte:x}" for byte in data]
    return separator.lstrip() * (separator != "\n") + separator.join(digits)


def _decoding(arguments: list[str], stdin: bytes = b"", **files: bytes) -> Case:
    """Return a case of ``stagewire decode``, which may write only to the folder ``out``."""
    kept: dict[str, Content] = {f"{OUT}/readme.txt": b"", **files}
    return Case(("decode", *arguments), stdin=stdin, files=kept, may_write=OUT, holds=_decoded)


def _decoded(case: Case, ran: Ran) -> None:
    """Check that every JSON line is valid, and that a file is written exactly if decoding ran to the end."""
    written = {path.name for path in (ran.folder / OUT).glob("*")} - {"readme.txt"}
    wanted = {"decoded"} if "--output" in case.arguments and ran.code != 2 else set()
    if written != wanted:
        raise Wrong(f"exit status {ran.code}: wrote {sorted(written)}, not {sorted(wanted)}")
    if "--json" not in case.arguments and "jsonl" not in case.arguments:
        return
    said = (ran.folder / OUT / "decoded").read_bytes() if written else ran.out
    for line in said.splitlines():
        try:
            json.loads(line)
        except ValueError as error:
            raise Wrong(f"invalid JSON line: {error}: {line[:200]!r}") from None


def decode_hex(rng: Random) -> Case:
    """Hex on the command line."""
    text = _hex(rng, _frames(rng))
    for _ in range(rng.choice((0, 0, 1, 2))):
        text = damaged_text(rng, text)
    words = text.split(" ") if rng.random() < 0.3 else [text]
    words = [_argument(word) for word in words]
    return _decoding([*_decode_options(rng), "--", *words])


def decode_file(rng: Random) -> Case:
    """A file or standard input with raw bytes, hex text, or captures as JSON or JSON lines."""
    content = rng.choice((_raw, _hex_text, _json, _json_lines))(rng)
    if rng.random() < 0.3:
        content = damaged_bytes(rng, content)
    if rng.random() < 0.5:
        return _decoding(["-", *_decode_options(rng)], content)
    name = rng.choice(("capture.bin", "capture.txt", "5304", "a b.json", "é.hex", "-x"))
    return _decoding([*_decode_options(rng), "--", name], **{name: content})


def _raw(rng: Random) -> bytes:
    return _frames(rng) * rng.choice((1, 1, 1, 50))


def _hex_text(rng: Random) -> bytes:
    text = "\n".join(_hex(rng, _frames(rng)) for _ in range(rng.choice((1, 2, 10))))
    for _ in range(rng.choice((0, 0, 1, 2))):
        text = damaged_text(rng, text)
    return text.encode("utf-8", "surrogatepass")


def _entries(rng: Random) -> list[Any]:
    makers: tuple[Callable[[str], Any], ...] = (
        lambda text: text,
        lambda text: {"hex": text},
        lambda text: {"printed": text, "message": "MOT_MOVE_HOME", "page": 1},
        lambda text: {"time": 1.5, "hex": text, "note": word(rng)},
    )
    make = rng.choice(makers)
    return [make(_hex(rng, _frames(rng))) for _ in range(rng.choice((0, 1, 3, 8)))]


def _json(rng: Random) -> bytes:
    entries: Any = _entries(rng)
    tree = rng.choice((entries, {"captures": entries}, entries[0] if entries else {}))
    for _ in range(rng.choice((0, 0, 1, 2))):
        tree = damaged_tree(rng, tree)
    return _dumped(rng, tree)


def _json_lines(rng: Random) -> bytes:
    lines = []
    for entry in _entries(rng):
        changed = (
            damaged_tree(rng, entry) if isinstance(entry, dict) and rng.random() < 0.2 else entry
        )
        lines.append(_dumped(rng, changed))
    return b"\n".join(lines) + b"\n" * rng.randrange(2)


def _dumped(rng: Random, tree: Any) -> bytes:
    text = json.dumps(tree, indent=rng.choice((None, None, 2)), ensure_ascii=rng.random() < 0.5)
    if rng.random() < 0.15:
        text = damaged_text(rng, text)
    return text.encode("utf-8", "surrogatepass")


# Encode, show, conformance, anything


@cache
def _layouts() -> list[tuple[Json, Json, list[Json]]]:
    """Return every layout with its message and its fields."""
    return [
        (
            message,
            layout,
            [*(layout[k] for k in ("param1", "param2") if layout[k]), *layout["fields"]],
        )
        for message in REGISTRY["messages"]
        for layout in message["layouts"]
    ]


def _value(rng: Random, field: Json) -> Any:
    """Return a valid value of the field in its JSON form."""
    if field["kind"] == "text":
        return "x" * rng.randrange(field["size"] + 1)
    if field["kind"] == "bytes":
        return rng.randbytes(field["size"]).hex()
    low, high = field["minimum"], field["maximum"]
    return rng.choice((low, high, rng.randint(low, high)))


def _written(rng: Random, field: Json) -> str:
    """Return a valid value of the field as a person writes it."""
    names = [*(field.get("enum") or {}), *(field.get("flags") or {})]
    if names and rng.random() < 0.4:
        return rng.choice("|,+").join(rng.sample(names, rng.randrange(1, min(3, len(names)) + 1)))
    value = _value(rng, field)
    if isinstance(value, int) and rng.random() < 0.3:
        return hex(value)
    return str(value)


def encode(rng: Random) -> Case:
    """A message name with a form, addresses and fields."""
    message, layout, fields = rng.choice(_layouts())
    words = [f"{field['name']}={_written(rng, field)}" for field in fields]
    name = message["name"] if rng.random() < 0.9 else rng.choice((word(rng), rng.choice(NAMES)))
    options = ["--form", layout["form"]] if rng.random() < 0.8 else []
    options += _sometimes(
        rng,
        ("--dest", lambda: rng.choice(("0x50", "33", "0x80", "-1", "256"))),
        ("--source", lambda: rng.choice(("1", "0x01", "0x100", "1e3"))),
        ("--form", lambda: rng.choice(("header", "data", "data:dc", "data:undecided"))),
        ("--protocol", lambda: PROTOCOL.name),
    )
    for extra in ("extra=00FF", "data=0102", "param1=1", "param2=0x00"):
        if rng.random() < 0.05:
            words.append(extra)
    for _ in range(rng.choice((0, 0, 1, 2))):
        if not words:
            break
        at = rng.randrange(len(words))
        kind = rng.randrange(4)
        if kind == 0:
            del words[at]
        elif kind == 1:
            words[at] = f"{words[at].partition('=')[0]}={word(rng)}"
        elif kind == 2:
            words[at] = damaged_text(rng, words[at])
        else:
            words.append(words[at])
    return Case(("encode", *map(_argument, (*options, "--", name, *words))))


def show(rng: Random) -> Case:
    """A name, often misspelt."""
    name = rng.choice(NAMES) if rng.random() < 0.7 else word(rng)
    for _ in range(rng.choice((0, 0, 1, 2))):
        name = damaged_text(rng, name)
    if rng.random() < 0.1:
        name = rng.choice(("0x0453", "0x", "0xFFFFFF", "MGMSG_mot_move_home", "_", "0x" + "f" * 90))
    options = ["--json"] * (rng.random() < 0.2)
    options += _sometimes(rng, ("--protocol", lambda: PROTOCOL.name))
    return Case(("show", *options, "--", _argument(name)))


def conformance(rng: Random) -> Case:
    """Options of ``conformance examples``, which reads no files of the user."""
    options = [option for option in ("--coverage", "--json", "--summary") if rng.random() < 0.5]
    options += _sometimes(
        rng, ("--protocol", lambda: PROTOCOL.name), ("--protocol", lambda: "other")
    )
    if rng.random() < 0.3:
        options.append(_argument(word(rng)))
    return Case(("conformance", "examples", *options))


_COMMANDS = (
    "check",
    "generate",
    "diff",
    "show",
    "decode",
    "encode",
    "testee",
    "conformance",
    "examples",
)
_OPTIONS = (
    "--json", "--help", "-h", "--version", "--check", "--spec", "--out", "--target", "--form", "--dest",
    "--source", "--status", "--end", "--protocol", "--coverage", "--format", "--output", "--message",
    "--fail-on", "--", "-", "python", "spec", "work", "0x50", "data", "host", "chan_ident=1", "=", "a=b",
)  # fmt: skip


def arguments(rng: Random) -> Case:
    """Random words in any order, with output only in the folder ``out``."""
    words = [rng.choice(_COMMANDS)] if rng.random() < 0.9 else []
    for _ in range(rng.randrange(6)):
        words.append(rng.choice((rng.choice(_OPTIONS), rng.choice(_OPTIONS), _argument(word(rng)))))
    for at, option in enumerate(words[:-1]):
        if option in ("--out", "--output"):
            words[at + 1] = f"{OUT}/x"
    if words[:1] == ["generate"]:
        words.insert(1, "--check")
    files: dict[str, Content] = {"capture.bin": _raw(rng), f"{OUT}/readme.txt": b"a file\n"}
    return Case(tuple(words), files=files, may_write=OUT, may_start=("git",))


# Testee lines

HARD_LINES = (
    b"", b" ", b"{}", b"[]", b"null", b"1", b'"x"', b"{", b'{"id":1}', b"\xff\xfe", b"\0",
    b'{"id":null,"op":"hello"}',
    b'{"id":1,"id":2,"op":"hello"}', b'{"id":NaN,"op":"hello"}', b'{"id":1.0,"op":"hello"}',
    b'{"id":true,"op":"hello"}', b'{"id":1e999,"op":"hello"}', b'{"id":"\\ud800","op":"hello"}',
    b'{"id":' + b"9" * 5000 + b',"op":"hello"}', b'{"id":' + b"9" * 3000 + b',"op":"hello"}',
    b"[" * 100_000, b'{"a":' * 100_000, b'{"id":1,"op":"hello","x":' + b"[" * 500 + b"]" * 500 + b"}",
    b"\xef\xbb\xbf" + b'{"id":1,"op":"hello"}', b'{"id":1,"op":"hello"}\r', b'\x85{"id":1,"op":"hello"}',
)  # fmt: skip


def _request(rng: Random) -> Json:
    made: Json = {"id": rng.choice((1, 0, -5, "a", "", 1 << 70)), "op": "hello"}
    kind = rng.randrange(4)
    if kind == 0:
        return made
    made["protocol"] = PROTOCOL.name
    if kind == 1:
        made |= {"op": "decode", "hex": _frames(rng).hex()}
    elif kind == 2:
        message, layout, fields = rng.choice(_layouts())
        values = {field["name"]: _value(rng, field) for field in fields}
        made |= {
            "op": "encode",
            "message": message["name"],
            "form": layout["form"],
            "fields": values,
        }
        made |= {"dest": rng.choice((0x50, 0x21, 0x7F)), "source": 1}
        if rng.random() < 0.2:
            made |= {"extra": rng.randbytes(rng.randrange(4)).hex()}
        if rng.random() < 0.1:
            made |= {"form": rng.choice(("data:undecided", "undocumented")), "data": "00" * 14}
    else:
        data = _frames(rng)
        cut = rng.randrange(len(data) + 1)
        made |= {"op": "stream", "chunks": [data[:cut].hex(), data[cut:].hex()]}
        if rng.random() < 0.5:
            made["end"] = rng.choice(("host", "device", "none"))
    if rng.random() < 0.3:
        made["context"] = {"status": rng.choice(CONTEXTS)}
    return made


def _line(rng: Random) -> bytes:
    kind = rng.random()
    if kind < 0.1:
        return rng.choice(HARD_LINES)
    tree: Any = _request(rng)
    if kind > 0.4:
        for _ in range(rng.choice((1, 1, 2))):
            tree = damaged_tree(rng, tree)
    text = json.dumps(tree, ensure_ascii=rng.random() < 0.5)
    if rng.random() < 0.1:
        text = damaged_text(rng, text)
    line = text.replace("\n", " ").encode("utf-8", "surrogatepass")
    return damaged_bytes(rng, line).replace(b"\n", b" ") if rng.random() < 0.05 else line


def testee(rng: Random) -> Case:
    """Some lines, of which the last may lack its line end."""
    lines = b"\n".join(_line(rng) for _ in range(rng.choice((1, 5, 20))))
    return Case(("testee",), stdin=lines + b"\n" * (rng.random() < 0.8), holds=_answered)


@cache
def _answer_schema() -> jsonschema.protocols.Validator:
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    return jsonschema.Draft202012Validator({"$defs": schema["$defs"], "$ref": "#/$defs/answer"})


def _answered(case: Case, ran: Ran) -> None:
    """Check that every line has one answer, in order, valid under the schema and with its id."""
    lines = case.stdin.split(b"\n")
    if not lines[-1]:
        lines.pop()
    answers = ran.out.splitlines()
    if ran.code or len(answers) != len(lines):
        raise Wrong(f"exit status {ran.code}, {len(answers)} answers to {len(lines)} lines")
    for line, answer in zip(lines, answers, strict=True):
        said = json.loads(answer)
        problem = next(_answer_schema().iter_errors(said), None)
        if problem is not None:
            raise Wrong(f"{line[:200]!r} is answered with {answer[:300]!r}: {problem.message}")
        if "internal error" in said.get("detail", ""):
            raise Wrong(f"{line[:200]!r} is answered with {said['detail']}")
        if said["id"] != _id_of(line):
            raise Wrong(f"{line[:200]!r} is answered with the id {said['id']!r}")


def _id_of(line: bytes) -> int | str | None:
    """Return the id of a request, or None if it cannot be read."""

    def once(pairs: list[tuple[str, Any]]) -> Json:
        if len(dict(pairs)) < len(pairs):
            raise ValueError("duplicate key")
        return dict(pairs)

    def refuse(name: str) -> None:
        raise ValueError(name)

    try:
        read = json.loads(line.decode("utf-8"), object_pairs_hook=once, parse_constant=refuse)
    except (ValueError, RecursionError):
        return None
    found = read.get("id") if isinstance(read, dict) else None
    return found if isinstance(found, (int, str)) and not isinstance(found, bool) else None
