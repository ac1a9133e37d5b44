"""The output is formatted, for all texts of any length."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import plain_yaml
from checkout import ROOT
from files import write_files
from stagewire_generator import check, pipeline, render


def load(path: Path) -> Any:
    return plain_yaml.load(path.read_text(encoding="utf-8"))


def save(path: Path, data: Any) -> None:
    path.write_text(json.dumps(data, ensure_ascii=False), encoding="utf-8")  # JSON is also YAML


def ruff_format(folder: Path) -> subprocess.CompletedProcess[str]:
    config = ["--config", str(ROOT / "pyproject.toml"), "--no-cache"]
    command = [sys.executable, "-m", "ruff", "format", "--diff", *config, str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=False, encoding="utf-8")


def ruff_check(folder: Path) -> subprocess.CompletedProcess[str]:
    """Check for undefined names and unused variables."""
    command = [sys.executable, "-m", "ruff", "check", "--isolated", "--no-cache"]
    command += ["--select=F", "--ignore=F401", str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=False, encoding="utf-8")


def stretched(spec: Path, words: str) -> None:
    """Fill the spec with texts, names and lists of different lengths."""
    tiny = spec / "tiny"

    def text(length: int) -> str:
        return (words * length)[:length].strip() or "x"

    stages = load(tiny / "stages.yaml")
    for n in range(1, 140):
        stages["stages"][f"S{n}"] = {
            "title": text(min(n, 100)),
            "page": 3,
            "controllers": {
                "TPx": {
                    "distance": {"counts_per_mm": n, "printed": text(n), "source": text(n)},
                    "speed": {"unknown": text(n)},
                }
            },
        }
    described = load(tiny / "units.yaml")
    for name in ("TP1", "TP2"):
        described["units"][name]["stages"] = list(stages["stages"])
    save(tiny / "units.yaml", described)
    stages["controllers"]["TP9"]["units"] += [f"TP{n}" for n in range(100, 120)]
    stages["stages"]["Many"] = {"title": "x", "page": 3, "controllers": {}}
    for n in range(1, 40):
        units = [f"TP{k}" for k in range(100 + 7 * n, 107 + 7 * n)]
        stages["controllers"]["C" * n] = {"units": units, "page": 3}
        stages["stages"]["Many"]["controllers"]["C" * n] = {"distance": {"counts_per_mm": n}}
    save(tiny / "stages.yaml", stages)
    core = load(tiny / "messages" / "core.yaml")
    for table in range(3):
        core["flags"][f"long_bits_{table}"] = {
            "page": 5,
            "format": "dword",
            "bits": {
                f"bit_{n}": {"bit": n, "note": text(30 * table + n + 1)} for n in range(32)
            },
        }  # fmt: skip
    save(tiny / "messages" / "core.yaml", core)


def test_formatting_of_long_texts(good_spec: Path, tmp_path: Path) -> None:
    for number, words in enumerate(["word ", "x", "a-b ", 'say "it" ', "it's ", "字", "é", "\\ "]):
        spec = Path(shutil.copytree(good_spec, tmp_path / "spec" / str(number)))
        stretched(spec, words)
        write_files(tmp_path / "out" / str(number), render(check(spec)))
    result = ruff_format(tmp_path / "out")
    assert result.stdout == ""
    assert result.returncode == 0, result.stderr


def many_fields(spec: Path) -> None:
    """Add messages with one to thirty fields of every role, with short and long names."""
    formats = ["word", "long", "char[4]", "byte[3]", "short", "dword", "byte"]
    sizes = {"word": 2, "long": 4, "char[4]": 4, "byte[3]": 3, "short": 2, "dword": 4, "byte": 1}
    messages: dict[str, Any] = {}
    printed: dict[str, Any] = {}
    contexts: dict[str, Any] = {}
    for count in range(1, 31):
        for stem in ("a", "a_field", "a_field_with_a_long_name"):
            fields: dict[str, Any] = {}
            for n in range(count):
                field: dict[str, Any] = {"format": formats[n % len(formats)]}
                if n % 5 == 3:
                    field["role"] = "reserved"
                elif formats[n % len(formats)] == "word" and n % 3 == 0:
                    field |= {"role": "constant", "value": 500 + n}
                fields[f"{stem}_{n + 1}"] = field
            name = f"M{len(messages)}"
            length = sum(sizes[field["format"]] for field in fields.values())
            data = {"length": length, "fields": fields}
            entry: dict[str, Any] = {
                "id": 0x1000 + len(messages), "page": 8, "spelling": name.lower(),
                "direction": "both" if count < 20 else "to_host", "summary": "Has fields.",
                **({"effect": "none"} if count < 20 else {}),
            }  # fmt: skip
            if count % 2:
                entry["data"] = data
            else:
                context = "c" * len(messages)
                contexts[context] = {
                    "values": ["servo", "coil"], "page": 8, "summary": "x", "unstated": "no unit"
                }  # fmt: skip
                entry["layouts"] = {
                    "header": {"param1": {"name": f"{stem}_1"}, "param2": {"constant": 3}},
                    "data_one": {**data, "when": {context: "servo"}},
                    "data_two": {**data, "when": {context: "coil"}},
                }
            messages[name] = entry
            printed[name] = {"heading": {"page": 8, "line": 80, "id": f"0x{entry['id']:04X}"}}
    erratum = load(spec / "tiny" / "errata" / "core.yaml")
    for n in range(9):
        name = f"NAMELESS_{n}"
        messages[name] = {
            "id": "unknown", "page": 8, "spelling": f"nameless {n}", "direction": "to_host",
            "summary": "Has no id.", "layout": "undocumented",
        }  # fmt: skip
        printed[name] = {"heading": {"page": 8, "line": 81, "id": "none"}}
        erratum["errata"]["tiny-lamp-test"]["messages"].append(name)
    save(spec / "tiny" / "errata" / "core.yaml", erratum)
    chapter = {"chapter": "more", "title": "More", "page": 8, "order": 3, "messages": messages}
    save(spec / "tiny" / "messages" / "more.yaml", chapter)
    save(spec / "tiny" / "printed" / "more.yaml", {"chapter": "more", "messages": printed})
    head = load(spec / "tiny" / "protocol.yaml")
    head["framing"]["devices"] = list(range(0x11, 0x51))
    units = load(spec / "tiny" / "units.yaml")
    units["addresses"]["bays"] |= {"first": 0x12, "last": 0x4F, "count": 0x3E}
    save(spec / "tiny" / "units.yaml", units)
    head["contexts"] |= contexts
    save(spec / "tiny" / "protocol.yaml", head)


def test_formatting_of_long_lists(
    good_spec: Path, tmp_path: Path, imported: Callable[[Path], Any]
) -> None:
    spec = Path(shutil.copytree(good_spec, tmp_path / "spec"))
    many_fields(spec)
    write_files(tmp_path / "out", render(check(spec)))
    result = ruff_format(tmp_path / "out")
    assert result.stdout == ""
    assert result.returncode == 0, result.stderr
    assert ruff_check(tmp_path / "out").stdout == "All checks passed!\n"
    package = imported(tmp_path / "out")
    shared = package.messages.M29Undecided(bytes(package.messages.M29Undecided.layout.length))
    assert shared.a_field_with_a_long_name_2 == 0
    assert shared.a_field_with_a_long_name_3 == ""
    assert shared.a_field_with_a_long_name_4 == bytes(3)


def test_formatting_of_a_small_spec(
    good_spec: Path, tmp_path: Path, imported: Callable[[Path], Any]
) -> None:
    """No stages, no tables, a chapter without messages, and a chapter without ids."""
    spec = Path(shutil.copytree(good_spec, tmp_path / "spec"))
    tiny = spec / "tiny"
    for name in (
        "quantities",
        "stages",
        "units",
        "messages/core",
        "printed/core",
        "rules",
        "captures",
    ):
        (tiny / f"{name}.yaml").unlink()
    head = load(tiny / "protocol.yaml")
    del head["framing"]["channel"]
    save(tiny / "protocol.yaml", head)
    extra = load(tiny / "messages" / "extra.yaml")
    extra["messages"]["LAMP"]["data"]["fields"] = {"blob": {"format": "byte[4]"}}
    broken = extra["messages"].pop("LAMP_BROKEN")
    save(tiny / "messages" / "extra.yaml", extra)
    for name, messages in (("empty", {}), ("nameless", {"LAMP_BROKEN": broken})):
        data = {"chapter": name, "title": "x", "page": 1, "order": 1, "messages": messages}
        save(tiny / "messages" / f"{name}.yaml", data)
    errata = load(tiny / "errata" / "core.yaml")
    del errata["errata"]["tiny-move-length"]
    save(tiny / "errata" / "core.yaml", errata)
    files = render(check(spec))
    write_files(tmp_path / "out", files)
    result = ruff_format(tmp_path / "out")
    assert result.stdout == ""
    assert result.returncode == 0, result.stderr
    stages = files["python/stagewire_tiny/stages.py"]
    assert "import" not in stages.replace("from __future__ import annotations", "")
    assert imported(tmp_path / "out").messages.Lamp(bytes(4)).blob == bytes(4)
    assert [path for path in files if "/messages/" in path] == [
        "c/stagewire_tiny/messages/extra.h",
        "python/stagewire_tiny/messages/__init__.py",
        "python/stagewire_tiny/messages/extra.py",
    ]


COMMAND_FORMATS = {
    "u8": 1, "s24": 3, "char[3]": 3, "u24": 3, "u16": 2, "u8[3]": 3, "s16": 2
}  # fmt: skip
SWITCHES = ("", "low_level", "high_level", "power_on")
STEMS = (
    "a", "a_field", "a_field_with_a_long_name", "a_field_with_a_longer_name",
    "a_field_with_a_name_longer_than_that", "a_field_with_a_name_that_is_longer_than_any_of_them",
)  # fmt: skip


def fields_of(stem: str, count: int, note: Callable[[int], str]) -> tuple[dict[str, Any], int]:
    """Return ``count`` fields of every format and role, and their size."""
    kinds = list(COMMAND_FORMATS)
    fields: dict[str, Any] = {}
    for n in range(count):
        field: dict[str, Any] = {"format": kinds[(n + count) % len(kinds)]}
        if n % 5 == 3:
            field["role"] = "reserved"
        elif field["format"] == "u16" and n % 3 == 0:
            field |= {"role": "constant", "value": 500 + n}
        elif field["format"] == "u8":
            field["flags"] = "eyes"
        elif field["format"] == "s24":
            field |= {"quantity": "distance", "note": note(4 * n + count)}
        fields[f"{stem}_{n + 1}"] = field
    return fields, sum(COMMAND_FORMATS[field["format"]] for field in fields.values())


def many_commands(spec: Path, words: str) -> None:
    """Add commands and replies with one to twenty fields, and texts and names of different lengths."""
    turtle = spec / "turtle"

    def text(length: int) -> str:
        return (words * length)[:length].strip() or "x"

    commands: dict[str, Any] = {}
    for count in range(1, 21):
        for stem in STEMS:
            number = len(commands)
            fields, size = fields_of(stem, count, text)
            part = {"fields": fields, "note": text(8 * count)}
            commands[f"M{'X' * (number % 36)}_{number}"] = {
                "byte": 0x80 + number, "page": 3, "title": "Listing", "summary": text(5 * number + 1),
                "note": text(200 - number), "size": size, "dummy": True,
                "effect": "settings",
                "firmware": [{"version": "9." * (count % 9) + "1", "note": text(2 * number + 1)}],
                **({"request": part} if number % 3 < 2 else {}),
                **({"reply": part} if number % 3 > 0 else {}),
            }  # fmt: skip
    setup = {
        f"S_{'Y' * n}": {
            "byte": 0x60 + n, "page": 1, "title": "Setup", "summary": text(n), "note": text(7 * n),
            "effect": "settings",
            **({"switches_to": SWITCHES[n % 4]} if n % 4 else {}),
        }
        for n in range(1, 40)
    }  # fmt: skip
    chapter = {"chapter": "more", "title": text(100), "page": 3, "order": 9}
    more = {**chapter, "commands": commands, "setup_commands": setup}
    save(turtle / "messages" / "more.yaml", more)
    walk = load(turtle / "messages" / "walk.yaml")
    axes = walk["enumerations"]["axis"]["values"]
    axes |= {f"AXIS_{'Z' * n}": {"value": 0x40 + n, "note": text(n)} for n in range(1, 40)}
    bits = walk["flags"]["eyes"]["bits"]
    bits |= {f"bit_{n}": {"bit": n, "note": text(20 * n)} for n in range(2, 8)}
    save(turtle / "messages" / "walk.yaml", walk)
    quantities = load(turtle / "quantities.yaml")
    for n in range(1, 120):
        factor = ("counts_per_um", "um_per_count")[n % 2]
        quantities["quantities"][f"q{n}{'u' * (n % 60)}"] = {
            "unit": "um", "page": 3, "summary": text(n),
            "scale": {factor: n, "printed": text(n % 30 + 1), "source": text(n)},
        }  # fmt: skip
    save(turtle / "quantities.yaml", quantities)
    head = load(turtle / "protocol.yaml")
    head["framing"]["terminator"] = 0xFD  # not one of the sizes
    save(turtle / "protocol.yaml", head)


@pytest.mark.parametrize(
    "words",
    [
        "word ",
        *(pytest.param(w, marks=pytest.mark.matrix) for w in ("x", 'say "it" ', "字", "\\ ")),
    ],
)
def test_formatting_of_commands(
    good_commands: Path,
    tmp_path: Path,
    imported: Callable[[Path], Any],
    monkeypatch: pytest.MonkeyPatch,
    words: str,
) -> None:
    monkeypatch.setattr(
        pipeline, "check_errata", lambda *_: None
    )  # the document prints none of this
    spec = Path(shutil.copytree(good_commands, tmp_path / "spec"))
    many_commands(spec, words)
    write_files(tmp_path / "out", render(check(spec)))
    result = ruff_format(tmp_path / "out")
    assert result.stdout == ""
    assert result.returncode == 0, result.stderr
    assert ruff_check(tmp_path / "out").stdout == "All checks passed!\n"
    package = imported(tmp_path / "out")
    kinds = [kind for kind in package.messages.MESSAGES if kind.layout.length]
    assert len(kinds) > 100
    for kind in kinds:
        made = kind.unpack(bytes(range(3 + kind.layout.length)))
        assert type(made).keep(made.values()) == made


def test_formatting_of_few_commands(
    good_commands: Path, tmp_path: Path, imported: Callable[[Path], Any]
) -> None:
    """No flags, no quantities, no fields, and a chapter with only setup commands."""
    spec = Path(shutil.copytree(good_commands, tmp_path / "spec"))
    turtle = spec / "turtle"
    for name in (
        "quantities", "units", "printed/wording", "printed/document", "errata/walk", "examples",
    ):  # fmt: skip
        (turtle / f"{name}.yaml").unlink()
    walk = load(turtle / "messages" / "walk.yaml")
    walk["commands"] = {"HALT": walk["commands"]["HALT"]}
    del walk["flags"], walk["enumerations"]["feeling"]
    save(turtle / "messages" / "walk.yaml", walk)
    printed = load(turtle / "printed" / "commands.yaml")
    printed["commands"] = [c for c in printed["commands"] if c["title"] == "Halt"]
    printed["mentions"] = [{"line": 120, "name": "Halt"}]
    save(turtle / "printed" / "commands.yaml", printed)
    form = load(turtle / "printed" / "format.yaml")
    form["bytes"][3][1] = "BYTES 4-3"
    form["sizes"][1]["to"] = "0"
    form["exceptions"] = [{"line": 24, "count": "zero"}]
    save(turtle / "printed" / "format.yaml", form)
    head = load(turtle / "protocol.yaml")
    head["firmware"] = head["firmware"][:1]
    save(turtle / "protocol.yaml", head)
    files = render(check(spec))
    write_files(tmp_path / "out", files)
    result = ruff_format(tmp_path / "out")
    assert result.stdout == ""
    assert result.returncode == 0, result.stderr
    assert ruff_check(tmp_path / "out").stdout == "All checks passed!\n"
    messages = imported(tmp_path / "out").messages
    assert messages.Halt().pack(1) == b"\x01\x48\x00\x2e"
    assert messages.Wake().pack() == b"\xfe\x57"
    for module in ("walk", "setup"):
        assert "Struct" not in files[f"python/stagewire_turtle/messages/{module}.py"]
    assert "import" not in files["python/stagewire_turtle/quantities.py"]
