"""The small good spec of commands: its package works, its examples pass, and it has every kind of entry."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from checkout import ROOT
from files import write_files
from stagewire.framing import CommandReceived, TextReceived, host_framer
from stagewire_conformance import run


@pytest.fixture
def turtle(command_files: dict[str, str], tmp_path: Path, imported: Callable[[Path], Any]) -> Any:
    """The generated package."""
    write_files(tmp_path, command_files)
    return imported(tmp_path)


def test_every_example_passes(turtle: Any) -> None:
    verdicts = run(turtle.PROTOCOL)
    assert {v.id: v.detail for v in verdicts if v.outcome not in ("passed", "noted")} == {}
    assert Counter(v.outcome for v in verdicts)["noted"] == 1  # prose


def test_the_package_encodes_and_decodes(turtle: Any) -> None:
    """Cover numbers of 24 bits, texts, a constant that contains the terminator, and a reply."""
    m = turtle.messages
    moved = m.GoTo(place=-10000, height=100).pack(1)
    assert moved.hex(" ") == "01 47 06 f0 d8 ff 64 00 00 2e"
    assert turtle.decode(moved).message == m.GoTo(-10000, 100)
    assert m.Knock(strength=2, eyes=0).pack(2).hex(" ") == "02 4b 04 02 00 2e 2e 2e"
    where = turtle.PROTOCOL.decode_reply(bytes.fromhex("f0d8ff64000003"), "WHERE")
    assert where == m.WhereReply(place=-10000, height=100, eyes_wide=3)
    assert where.eyes_wide_flags.shell
    assert m.Knock(strength=2, eyes=2).eyes_flags.shell
    assert m.Name("Bo").pack(1).hex(" ") == "01 4e 04 42 6f 00 00 2e"
    assert turtle.quantities.DISTANCE.to_counts(1) == 10
    assert turtle.enumerations.Axis.TAIL == 0x1B


def test_a_host_stream_is_split_in_both_formats(turtle: Any) -> None:
    """The registry defines which commands switch the format."""
    framer = host_framer(turtle.PROTOCOL)
    mood = b"\x01?."
    events = framer.feed(b"\xfe\x47" + mood + b"\r" + b"\xfe\x57" + mood + b"\xfe\x47hay\r")
    assert [(type(event), event.raw) for event in events] == [
        (CommandReceived, b"\xfe\x47"),
        (TextReceived, mood + b"\r"),
        (CommandReceived, b"\xfe\x57"),
        (CommandReceived, mood),
        (CommandReceived, b"\xfe\x47"),
        (TextReceived, b"hay\r"),
    ]


def keys(data: Any) -> Iterator[str]:
    if isinstance(data, dict):
        yield from data
    for value in data.values() if isinstance(data, dict) else data:
        if isinstance(value, dict | list):
            yield from keys(value)


def definition(kind: str, *path: str) -> Any:
    part = json.loads((ROOT / f"spec/schema/{kind}.schema.json").read_text(encoding="utf-8"))
    for key in path:
        part = part[key]
    return part


def test_it_has_every_key_of_the_language(good_commands: Path) -> None:
    """Cover the keys of commands, of their witness, and of their examples."""
    shown: dict[str, set[str]] = {}
    for kind in ("messages", "printed"):
        folder = good_commands / "turtle" / kind
        loaded = [yaml.safe_load(p.read_text(encoding="utf-8")) for p in folder.iterdir()]
        shown[kind] = set(keys(loaded))
    for name in ("command", "setup_command", "part", "firmware"):
        assert shown["messages"] >= definition("messages", "$defs", name, "properties").keys()
    for name in (
        "ascii_reply", "axis", "bit", "breakdown", "command", "command_mention", "exceptions",
        "limits", "number_format", "printed_unit", "setup_row", "setup_table", "size_range",
        "vocabulary",
    ):  # fmt: skip
        assert shown["printed"] >= definition("printed", "$defs", name, "properties").keys()
    path = good_commands / "turtle" / "examples.yaml"
    examples = yaml.safe_load(path.read_text(encoding="utf-8"))["examples"].values()
    assert {e["kind"] for e in examples} == {"tx", "rx", "keyboard", "stream", "statement"}
    assert {e.get("notation", "hex") for e in examples} == {"hex", "decimal", "hash"}
    assert {e.get("form") for e in examples} == {
        None, "request", "reply", "request:without_size"
    }  # fmt: skip
    of_commands = {
        "axis", "typed", "shown", "code_page", "corrected", "notation", "printed_is", "breakdown",
    }  # fmt: skip
    assert set().union(*examples) >= of_commands
    claims = {key for e in examples for key in e.get("claim", ())}
    assert claims >= {
        "bit", "of", "member", "format", "sizes", "without_size", "dummies", "unanswered",
        "firmware", "message", "stream", "command", "switches_to",
    }  # fmt: skip
