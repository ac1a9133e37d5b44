"""A text of the spec can never become code, and whatever it is, the output has its final formatting."""

from __future__ import annotations

import ast
import importlib
import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from stagewire_generator import check, render
from stagewire_generator.diagnostics import SpecError

ROOT = Path(__file__).parents[2]
PACKAGE = "stagewire_tiny"
FILES = [
    *("protocol", "quantities", "stages", "units", "messages/core", "messages/extra"),
    *("errata/core", "../conformance/examples/tiny", "../conformance/captures/tiny"),
]
TEXTS = {"title", "summary", "note", "subject", "printed", "encoded", "evidence", "source"}
TEXTS |= {"unknown", "issue", "date", "says", "means", "reference"}
LIMITS = {"issue": 20, "date": 40, "title": 60}

NASTY = [
    '"',
    "'",
    '"""',
    "'''",
    '""""',
    '"""""""',
    '"\'"',
    "'\"'",
    "\\",
    "\\\\",
    '\\"',
    '\\"""',
    '"""\\',
    "\\n",
    "\\N{DASH}",
    "\\x4",
    "\\u12",
    "{}",
    "{x!r}",
    "{{ 7 * 7 }}",
    "{% raw %}",
    "{# no #}",
    "%s %(a)d %",
    "# x",
    "*/ /*",
    "?? ??/",
    "</script>",
    '"""; boom() #',
    '"); boom(',
    "'+boom()+'",
    "a  b",
    "é µ × ² ‑",
    "字字字 😀",
    "e\u0301 \u200b \u00ad \u00a0x",
    "\ufeff",
    "__class__",
    "${x} $(x) `x`",
    "-",
    ".",
    "`` :x:`~y`",
]
FORMS: dict[str, Callable[[str], str]] = {
    "alone": lambda nasty: nasty,
    "first": lambda nasty: f"{nasty}x",
    "last": lambda nasty: f"x{nasty}",
    "within": lambda nasty: f"x {nasty} y",
    "blanks": lambda nasty: f" {nasty} ",
    "long": lambda nasty: f"{nasty} and " * 5 + nasty,
}
CASES = [(form, nasty) for form in ("alone", "first", "last") for nasty in NASTY[:12]]
CASES += [(list(FORMS)[n % len(FORMS)], nasty) for n, nasty in enumerate(NASTY[12:])]
CASES += [(list(FORMS)[3 + n % 3], nasty) for n, nasty in enumerate(NASTY[:12])]


def load(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def save(path: Path, data: Any) -> None:
    path.write_text(json.dumps(data, ensure_ascii=False), encoding="utf-8")  # which is YAML, too


def with_texts(data: Any, text: str, key: str = "") -> Any:
    """Return the data with every free text replaced; captured bytes are none."""
    if isinstance(data, dict):
        bytes_ = "reference" in data
        return {
            k: v if bytes_ and k == "printed" else with_texts(v, text, k) for k, v in data.items()
        }
    if isinstance(data, list):
        return [with_texts(item, text) for item in data]
    if isinstance(data, str) and key in TEXTS:
        return text[: LIMITS.get(key, 200)]
    return data


def spec_with(text: str, good: Path, folder: Path) -> Path:
    shutil.copytree(good, folder)
    for name in FILES:
        path = folder / "tiny" / f"{name}.yaml"
        save(path, with_texts(load(path), text))
    return folder


def write(files: dict[str, str], out: Path) -> None:
    for path, text in files.items():
        (out / path).parent.mkdir(parents=True, exist_ok=True)
        (out / path).write_bytes(text.encode("utf-8"))


def blanked(source: str) -> str:
    """Return the syntax of a module without the contents of its strings."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            node.value = ""
    return ast.dump(tree)


def ruff_format(folder: Path) -> subprocess.CompletedProcess[str]:
    config = ["--config", str(ROOT / "pyproject.toml"), "--no-cache"]
    command = [sys.executable, "-m", "ruff", "format", "--diff", *config, str(folder)]
    return subprocess.run(command, capture_output=True, text=True, check=False, encoding="utf-8")


@pytest.fixture(scope="module")
def rendered(
    good_spec: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, dict[tuple[str, str], dict[str, str]]]:
    """Return a folder with one output a case, and the files of each."""
    base = tmp_path_factory.mktemp("escaping")
    found = {}
    for number, case in enumerate(CASES):
        form, nasty = case
        spec = spec_with(FORMS[form](nasty), good_spec, base / "spec" / str(number))
        found[case] = render(check(spec))
        write(found[case], base / "out" / str(number))
    return base / "out", found


@pytest.fixture(scope="module")
def plain(good_spec: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What is rendered where every text is a harmless word."""
    folder = tmp_path_factory.mktemp("plain") / "spec"
    return {
        path: blanked(text)
        for path, text in render(check(spec_with("word", good_spec, folder))).items()
        if path.endswith(".py")
    }


Rendered = tuple[Path, dict[tuple[str, str], dict[str, str]]]


def test_texts_stay_texts(rendered: Rendered, plain: dict[str, str]) -> None:
    """But for its strings, each module is the same syntax whatever the texts are."""
    for case, files in rendered[1].items():
        for path, text in files.items():
            if path.endswith(".py"):
                assert blanked(text) == plain[path], f"{case}: {path}"


def test_formatting_is_final(rendered: Rendered) -> None:
    result = ruff_format(rendered[0])
    assert result.stdout == ""
    assert result.returncode == 0, result.stderr


@pytest.fixture
def imported() -> Iterator[Callable[[Path], Any]]:
    """Import the package below a folder, afresh."""
    before = list(sys.path)

    def forget() -> None:
        for name in [n for n in sys.modules if n.split(".")[0] == PACKAGE]:
            del sys.modules[name]

    def load_package(folder: Path) -> Any:
        forget()
        sys.path[:] = [str(folder / "python"), *before]
        importlib.invalidate_caches()
        return importlib.import_module(PACKAGE)

    yield load_package
    forget()
    sys.path[:] = before


def squeezed(text: str | None) -> str:
    return " ".join((text or "").split())


def test_texts_arrive(rendered: Rendered, imported: Callable[[Path], Any]) -> None:
    """The packages import; their strings, docstrings and JSON hold the texts as they were."""
    folder, found = rendered
    for number, case in enumerate(found):
        form, nasty = case
        text = FORMS[form](nasty)
        package = imported(folder / str(number))
        stage = package.stages.Slide
        assert stage.title == text[:60], case
        assert vars(package.flags.StateBits)["moving"].note == text[:200], case
        doc = squeezed(package.messages.PosMove.__doc__)
        assert squeezed(text) in doc, case
        assert squeezed(text[:60]) in squeezed(package.__doc__), case
        assert squeezed(text[:60]) in squeezed(package.messages.core.__doc__), case
        assert squeezed(text[:60]) in squeezed(package.stages.__doc__), case
        data = json.loads((folder / str(number) / "registry" / "tiny.json").read_text("utf-8"))
        assert data["title"] == text[:60], case
        by_name = {message["name"]: message for message in data["messages"]}
        assert by_name["POS_MOVE"]["summary"] == text[:200], case
        assert {erratum["evidence"] for erratum in data["errata"]} == {text[:200]}, case


@pytest.mark.parametrize("char", ["\n", "\r", "\x0b", "\x0c", "\x1c", "\x85", "\u2028", "\u2029"])
def test_line_ends_in_texts_are_refused(char: str, good_spec: Path, tmp_path: Path) -> None:
    spec = spec_with("word", good_spec, tmp_path / "spec")
    for name in FILES[:-2]:
        path = spec / "tiny" / f"{name}.yaml"
        path.write_text(path.read_text(encoding="utf-8").replace('"word"', json.dumps(f"a{char}b")))
    with pytest.raises(SpecError) as caught:
        check(spec)
    found = {d.place.file for d in caught.value.diagnostics}
    assert found == {f"tiny/{name}.yaml" for name in FILES[:-2]}


# Formatting of long things


def stretched(spec: Path, words: str) -> None:
    """Fill the spec with texts, names and lists of many lengths."""
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
    stages["controllers"]["TP9"]["units"] += [f"TP{n}" for n in range(100, 120)]
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
        write(render(check(spec)), tmp_path / "out" / str(number))
    result = ruff_format(tmp_path / "out")
    assert result.stdout == ""
    assert result.returncode == 0, result.stderr


def many_fields(spec: Path) -> None:
    """Add messages with one to thirty fields of every role, with short and long names."""
    formats = ["word", "long", "char[4]", "byte[3]", "short", "dword", "byte"]
    sizes = {"word": 2, "long": 4, "char[4]": 4, "byte[3]": 3, "short": 2, "dword": 4, "byte": 1}
    messages: dict[str, Any] = {}
    printed: dict[str, Any] = {}
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
            }  # fmt: skip
            if count % 2:
                entry["data"] = data
            else:
                entry["layouts"] = {
                    "header": {"param1": {"name": f"{stem}_1"}, "param2": {"constant": 3}},
                    "data_one": {**data, "when": {"status": "servo"}},
                    "data_two": {**data, "when": {"status": "coil"}},
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
    head["framing"]["devices"] = list(range(0x11, 0x60))
    save(spec / "tiny" / "protocol.yaml", head)


def test_formatting_of_long_lists(
    good_spec: Path, tmp_path: Path, imported: Callable[[Path], Any]
) -> None:
    spec = Path(shutil.copytree(good_spec, tmp_path / "spec"))
    many_fields(spec)
    write(render(check(spec)), tmp_path / "out")
    result = ruff_format(tmp_path / "out")
    assert result.stdout == ""
    assert result.returncode == 0, result.stderr
    package = imported(tmp_path / "out")
    shared = package.messages.M29Undecided(bytes(package.messages.M29Undecided.layout.length))
    assert shared.a_field_with_a_long_name_2 == 0
    assert shared.a_field_with_a_long_name_3 == ""
    assert shared.a_field_with_a_long_name_4 == bytes(3)


def test_formatting_of_little(
    good_spec: Path, tmp_path: Path, imported: Callable[[Path], Any]
) -> None:
    """No stages, no tables, a chapter without a message, one without a message that has an id."""
    spec = Path(shutil.copytree(good_spec, tmp_path / "spec"))
    tiny = spec / "tiny"
    for name in ("quantities", "stages", "units", "messages/core", "printed/core"):
        (tiny / f"{name}.yaml").unlink()
    shutil.rmtree(spec / "conformance" / "captures")
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
    write(files, tmp_path / "out")
    result = ruff_format(tmp_path / "out")
    assert result.stdout == ""
    assert result.returncode == 0, result.stderr
    assert imported(tmp_path / "out").messages.Lamp(bytes(4)).blob == bytes(4)
    assert [path for path in files if "/messages/" in path] == [
        "python/stagewire_tiny/messages/__init__.py",
        "python/stagewire_tiny/messages/extra.py",
    ]
