"""Spec files in an editor with the YAML language server (``docs/how-to/editors.md``).

The tests run the real server, which finds the schema by the first line of each file.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from checkout import ROOT
from language_server import LanguageServer
from stagewire_generator.formatting import find
from stagewire_generator.schemas import KINDS

pytestmark = pytest.mark.matrix

SCHEMAS = ROOT / "spec" / "schema"
MESSAGES = ROOT / "spec" / "thorlabs_apt" / "messages" / "motor.yaml"
FILES = find(ROOT / "spec")


def name(path: Path) -> str:
    return Path(os.path.relpath(path, ROOT)).as_posix()


def squiggles(server: LanguageServer, more: str = "") -> dict[str, list[dict[str, Any]]]:
    """Return the diagnostics of all files of the project, with ``more`` appended to each."""
    texts = {path: f"{path.read_text(encoding='utf-8')}{more}" for path in FILES}
    found = server.open_all(texts)
    server.close(*texts)
    return {name(path): said for path, said in found.items()}


def test_valid_files_have_no_squiggles(server: LanguageServer) -> None:
    found = squiggles(server)
    assert {
        "spec/asi_ms2000/protocol.yaml",
        "spec/thorlabs_apt/examples.yaml",
    } <= found.keys()
    assert {path: said for path, said in found.items() if said} == {}
    assert server.messages == []


def test_every_file_is_validated_against_its_schema(server: LanguageServer) -> None:
    """An unknown key is underlined, so the schema was found."""
    for path, found in squiggles(server, "unheard_of: 1\n").items():
        line = (ROOT / path).read_text(encoding="utf-8").count("\n")
        places = {(said["message"], said["range"]["start"]["line"]) for said in found}
        assert ("Property unheard_of is not allowed.", line) in places, path


def test_a_missing_schema_is_reported(server: LanguageServer) -> None:
    """Otherwise the tests above would pass without a schema."""
    text = MESSAGES.read_text(encoding="utf-8").replace("../../schema/", "../../lost/", 1)
    [squiggle] = server.open(MESSAGES, text)
    server.close(MESSAGES)
    assert "Unable to load schema" in squiggle["message"]


@pytest.mark.parametrize(
    ("right", "wrong", "marked", "said"),
    [
        ("    spelling: vel", "    speling: vel", "speling", "Property speling is not allowed."),
        ("    page: 28\n", "    page: many\n", "many", 'Expected "integer"'),
        ("format: long", "format: 4", "4", 'Expected "string"'),
        ("direction: to_controller", "direction: out", "out", "Valid values"),
        ("MOT_VELPARAMS:", "Mot_velparams:", "Mot_velparams", "not allowed"),
        ("quantity: velocity", "quantity: Velo City", "Velo City", "lower_snake_case"),
        ("title: ", 'title: "\\u202E" #', '"\\u202E"', "plain text on one line"),
        ("id: 0x0443", "id: 0x10443", "0x10443", "maximum of 65535"),
    ],
)
def test_a_mistake_is_underlined_in_its_place(
    server: LanguageServer, right: str, wrong: str, marked: str, said: str
) -> None:
    text = MESSAGES.read_text(encoding="utf-8")
    assert right in text
    broken = text.replace(right, wrong, 1)
    start = broken.index(wrong) + wrong.index(marked)
    line, character = position(broken, start)
    found = server.open(MESSAGES, broken)
    server.close(MESSAGES)
    here = [s for s in found if s["range"]["start"] == {"line": line, "character": character}]
    assert here, found
    assert said in here[0]["message"]


FIELD = {"format", "quantity", "enum", "flags", "role", "minimum", "maximum", "default", "note"}


def test_completion_within_a_field(server: LanguageServer) -> None:
    text = MESSAGES.read_text(encoding="utf-8")
    field = "      min_velocity: {format: long"
    new = "      new_field:\n        \n"
    start = text.index(field)
    offered = complete(server, text[:start] + new + text[start:], start + len(new) - 1)
    assert offered.keys() >= FIELD
    assert "its unit and scale" in str(offered["quantity"]["documentation"])
    started = new.replace("        \n", "        format: word\n        qua\n")
    offered = complete(server, text[:start] + started + text[start:], start + len(started) - 1)
    assert "quantity" in offered
    assert "format" not in offered
    braces = "      new_field: {format: word, q}\n"
    offered = complete(server, text[:start] + braces + text[start:], start + len(braces) - 2)
    assert "quantity" in offered


def test_completion_of_values(server: LanguageServer) -> None:
    text = MESSAGES.read_text(encoding="utf-8")
    start = text.index("    direction: to_controller") + len("    direction: ")
    offered = complete(server, text[:start] + text[start + len("to_controller") :], start)
    assert offered.keys() >= {"to_controller", "to_host", "both"}


@pytest.mark.parametrize("kind", KINDS)
def test_completion_in_a_new_file(server: LanguageServer, kind: str, tmp_path: Path) -> None:
    """With only its first line, a file offers all top-level keys."""
    path = tmp_path / f"{kind}.yaml"
    schema = (SCHEMAS / f"{kind}.schema.json").as_posix()
    text = f"# yaml-language-server: $schema={schema}\n\n"
    server.open(path, text)
    offered = server.completion(path, 1, 0)
    server.close(path)
    properties = json.loads(Path(schema).read_text(encoding="utf-8"))["properties"]
    assert offered.keys() >= properties.keys()


@pytest.mark.parametrize(
    ("key", "title", "said"),
    [
        ("quantity: velocity", "Quantity", "its unit and scale"),
        ("spelling: ", "Spelling", "run-together name"),
        ("  MOT_VELPARAMS:", "Parameter set", "a set has one of header"),
        ("chapter: motor", "Chapter", "short name of the chapter"),
    ],
)
def test_hover_shows_the_description_in_the_schema(
    server: LanguageServer, key: str, title: str, said: str
) -> None:
    text = MESSAGES.read_text(encoding="utf-8")
    line, character = position(text, text.index(key) + len(key) - len(key.lstrip()) + 1)
    server.open(MESSAGES)
    shown = server.hover(MESSAGES, line, character)
    server.close(MESSAGES)
    assert shown.startswith(f"#### {title}")
    assert said in shown
    assert "messages.schema.json" in shown
    assert "||" not in shown


def complete(server: LanguageServer, text: str, offset: int) -> dict[str, dict[str, Any]]:
    server.open(MESSAGES, text)
    offered = server.completion(MESSAGES, *position(text, offset))
    server.close(MESSAGES)
    return offered


def position(text: str, offset: int) -> tuple[int, int]:
    """Return line and character of an offset in a text, as the protocol counts them."""
    begin = text.rfind("\n", 0, offset) + 1
    return text.count("\n", 0, offset), len(text[begin:offset].encode("utf-16-le")) // 2


def patterns(schema: Any) -> Iterator[str]:
    """Yield every regular expression of a schema."""
    parts = [schema]
    while parts:
        part = parts.pop()
        if isinstance(part, dict):
            if isinstance(part.get("pattern"), str):
                yield part["pattern"]
            yield from part.get("patternProperties", ())
            parts += part.values()
        elif isinstance(part, list):
            parts += part


def texts() -> set[str]:
    """Return words of the spec, and texts that a pattern might accept by mistake."""
    words = {
        word
        for path in FILES[::4]
        for word in re.findall(r"[^\s\"',\[\]{}]+", path.read_text(encoding="utf-8"))
    }
    words = set(sorted(words)[::40])
    hidden = "\n\r\t\0\x7f\x85\xa0\xad\u200b\u2028\u202e\ufeff\ufff9"
    words |= {f"{word}{sign}{word}" for word in ("a", "A_1", "10") for sign in hidden}
    words |= {f"{word}{sign}" for word in sorted(words)[::9] for sign in "\n \u0130"}
    return words | {"", "µm/s²", "\U0001f600", "A\U00010400", "é", "Ⅷ", "٣", "x" * 300}


def test_patterns_match_the_same_texts_in_javascript() -> None:
    """Python and the language server agree on names, line feeds and invisible characters."""
    words = sorted(texts())
    found = {
        pattern
        for kind in KINDS
        for pattern in patterns(json.loads((SCHEMAS / f"{kind}.schema.json").read_text("utf-8")))
    }
    assert len(found) > 20
    cases = [[pattern, words] for pattern in sorted(found)]
    command = ["node", str(Path(__file__).with_name("patterns.cjs"))]
    answer = subprocess.run(
        command, input=json.dumps(cases).encode(), capture_output=True, check=True
    )
    for (pattern, _), said in zip(cases, json.loads(answer.stdout), strict=True):
        ours = [re.search(pattern, word) is not None for word in words]
        differ = [word for word, one, two in zip(words, ours, said, strict=True) if one != two]
        assert differ == [], pattern
