"""Names reserved by languages, systems and the generated code, tried for every kind of name.

For each kind, all names are tried at once. The refused names are removed, and the rest must work: the
packages can be imported, and every message can be encoded and decoded.
"""

from __future__ import annotations

import copy
import keyword
import re
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import text_places
from outputs import faults, ruff, run_packages, write_tree
from payloads import NAMES, part_or_all
from text_places import Files, write

from stagewire_generator import TARGETS, check, pipeline, render
from stagewire_generator.diagnostics import Diagnostic, SpecError
from stagewire_generator.lint.errata import check_errata
from stagewire_generator.model import Protocol

PAGE = 8
Json = dict[str, Any]
PYTHON = {word for word in keyword.kwlist if word.islower()}
# Each of these must be refused as the name of a field, a value or a bit.
KEYWORDS = PYTHON | {
    "alignas", "alignof", "and", "and_eq", "asm", "auto", "bitand", "bitor", "bool", "break", "case",
    "catch", "char", "char16_t", "char32_t", "char8_t", "class", "co_await", "co_return", "co_yield",
    "compl", "concept", "const", "const_cast", "consteval", "constexpr", "constinit", "continue",
    "decltype", "default", "delete", "do", "double", "dynamic_cast", "else", "enum", "explicit", "export",
    "extern", "false", "float", "for", "friend", "goto", "if", "inline", "int", "long", "mutable",
    "namespace", "new", "noexcept", "not", "not_eq", "nullptr", "operator", "or", "or_eq", "private",
    "protected", "public", "register", "reinterpret_cast", "requires", "restrict", "return", "short",
    "signed", "sizeof", "static", "static_assert", "static_cast", "struct", "switch", "template", "this",
    "thread_local", "throw", "true", "try", "typedef", "typeid", "typename", "typeof", "typeof_unqual",
    "union", "unsigned", "using", "virtual", "void", "volatile", "wchar_t", "while", "xor", "xor_eq",
}  # fmt: skip
MEMBERS = {
    "layout", "pack", "unpack", "values", "keep", "replace", "data", "mro", "reply", "marks", "shape",
}  # fmt: skip
CLASSES = {
    "MESSAGE", "LAYOUT", "NONE", "TRUE", "FALSE", "COMMAND", "REPLY", "SETUP_COMMAND", "FRAMED_MESSAGE",
    "FRAMED_PROTOCOL", "COMMAND_PROTOCOL", "UNDECIDED_MESSAGE", "UNDOCUMENTED_MESSAGE",
    "M_E_S_S_A_G_E_S", "P_R_O_T_O_C_O_L", "PACKET_MESSAGE", "PACKET_PROTOCOL", "SHAPE", "CRC", "SUM", "XOR",
}  # fmt: skip


def pattern(kind: str, *path: str) -> re.Pattern[str]:
    """Return the name pattern at a path of a schema."""
    node = text_places.schema(kind)
    for part in path:
        node = node[part]
    return re.compile(
        node["pattern"] if "pattern" in node else next(iter(node["patternProperties"]))
    )


def fitting(allowed: re.Pattern[str]) -> list[str]:
    """Return the hostile names that match the pattern, in any capitalisation."""
    spelt = [f(name) for name in NAMES for f in (str, str.lower, str.upper, str.capitalize)]
    return [name for name in dict.fromkeys(spelt) if allowed.search(name) and len(name) <= 40]


SNAKE = fitting(pattern("messages", "$defs", "fields"))
CAPITALS = fitting(pattern("messages", "properties", "messages"))
MIXED = fitting(pattern("stages", "properties", "stages"))
OURS_FIRST = sorted(CAPITALS, key=lambda name: name not in CLASSES)  # the ids are limited
FEW = SNAKE[::4]  # for names that are only text in Python
WORDS = [name for name in SNAKE if "_" not in name]


class Spec:
    """The complete spec with an additional chapter for names."""

    def write(self, folder: Path) -> Path:
        if not self.printed["messages"]:
            self.message("W", header={})
        return write(self.files, folder)

    def __init__(self, files: Files) -> None:
        self.files = copy.deepcopy(files)
        head = {"chapter": "words", "title": "Words", "page": PAGE, "order": 9}
        self.chapter: dict[str, Any] = {**head, "messages": {}}
        self.printed: dict[str, Any] = {"chapter": "words", "messages": {}}
        self.files["tiny/messages/words.yaml"] = self.chapter
        self.files["tiny/printed/words.yaml"] = self.printed
        self.id = 0x1000
        # Compare only the headings of the names.
        for name in ("contents", "lists", "summary"):
            del self.files[f"tiny/printed/{name}.yaml"]
        del self.files["tiny/errata/optics.yaml"]

    def message(self, name: str, **entry: Any) -> None:
        self.id += 1
        self.chapter["messages"][name] = {
            "id": self.id, "page": PAGE, "spelling": name.lower().replace("_", " "),
            "direction": "both", "effect": "none", "summary": "Has a name.",
            **entry,
        }  # fmt: skip
        self.printed["messages"][name] = heading(self.id)

    def data(self, fields: dict[str, Any], size: int, **entry: Any) -> dict[str, Any]:
        return {"length": size * len(fields), "fields": fields, **entry}


def heading(id: int) -> dict[str, Any]:
    return {"heading": {"page": PAGE, "line": 80, "id": f"0x{id:04X}"}}


def few(names: Iterable[str], number: int) -> Iterator[list[str]]:
    listed = list(names)
    for start in range(0, len(listed), number):
        yield listed[start : start + number]


# One function for each kind of name


def fields(field: dict[str, Any], size: int) -> Callable[[Spec, list[str]], None]:
    def fill(spec: Spec, names: list[str]) -> None:
        spec.chapter["flags"] = {
            "some_bits": {"page": 8, "format": "byte", "bits": {"one": {"bit": 0}}}
        }
        for number, part in enumerate(few(names, 24)):
            spec.message(f"W{number}", data=spec.data(dict.fromkeys(part, field), size))

    return fill


def parameters(spec: Spec, names: list[str]) -> None:
    for number, part in enumerate(few(names, 2)):
        params = {f"param{n}": {"name": name} for n, name in enumerate(part, 1)}
        spec.message(f"W{number}", header=params)


def shared(spec: Spec, names: list[str]) -> None:
    for number, part in enumerate(few(names, 24)):
        data = spec.data({name: {"format": "char[2]"} for name in part}, 2)
        forms = {f"data_{c}": {**data, "when": {"status": c}} for c in ("servo", "coil")}
        spec.message(f"W{number}", layouts=forms)


def messages(spec: Spec, names: list[str]) -> None:
    for name in names:
        spec.message(name, header={})


def sets(spec: Spec, names: list[str]) -> None:
    spec.chapter["parameter_sets"] = {}
    for number, name in enumerate(names):
        ids = {"req": 0x2000 + 2 * number, "get": 0x2001 + 2 * number}
        spec.chapter["parameter_sets"][name] = {
            "spelling": name.lower().replace("_", " "), "summary": "Has a name.", "page": PAGE,
            "ids": ids, "header": {},
        }  # fmt: skip
        for role, id in ids.items():
            spec.printed["messages"][f"{role.upper()}_{name}"] = heading(id)


def forms(spec: Spec, names: list[str]) -> None:
    for number, part in enumerate(few(names, 2)):
        layouts = {
            f"data_{name}": spec.data({"x": {"format": "word"}}, 2, when={"status": context})
            for name, context in zip([*part, "another"], ("servo", "coil"), strict=False)
        }
        spec.message(f"W{number}", layouts=layouts)


def contexts(spec: Spec, names: list[str]) -> None:
    spec.files["tiny/protocol.yaml"]["contexts"] |= {
        name: {"values": ["one", "two"], "page": PAGE, "summary": "Which.", "unstated": "No unit."}
        for name in names
    }
    for number, name in enumerate(names):
        data = spec.data({"x": {"format": "word"}}, 2)
        both = {f"data_{value}": {**data, "when": {name: value}} for value in ("one", "two")}
        spec.message(f"W{number}", layouts=both)


def context_values(spec: Spec, names: list[str]) -> None:
    context = {"values": names, "page": PAGE, "summary": "Which.", "unstated": "No unit."}
    spec.files["tiny/protocol.yaml"]["contexts"]["word"] = context
    data = spec.data({"x": {"format": "word"}}, 2)
    layouts = {f"data_f{n}": {**data, "when": {"word": name}} for n, name in enumerate(names)}
    spec.message("W", layouts=layouts)


def enumerations(spec: Spec, names: list[str]) -> None:
    table = {"page": PAGE, "values": {"ONE": {"value": 1}}}
    spec.chapter["enumerations"] = dict.fromkeys(names, table)
    for number, part in enumerate(few(names, 24)):
        data = {f"x{n}": {"format": "byte", "enum": name} for n, name in enumerate(part)}
        spec.message(f"W{number}", data=spec.data(data, 1))


def values(spec: Spec, names: list[str]) -> None:
    table = {name: {"value": number} for number, name in enumerate(names)}
    spec.chapter["enumerations"] = {"word": {"page": PAGE, "values": table}}


def flag_tables(spec: Spec, names: list[str]) -> None:
    table = {"page": PAGE, "format": "byte", "bits": {"one": {"bit": 0}}}
    spec.chapter["flags"] = dict.fromkeys(names, table)
    for number, part in enumerate(few(names, 24)):
        data = {f"x{n}": {"format": "byte", "flags": name} for n, name in enumerate(part)}
        spec.message(f"W{number}", data=spec.data(data, 1))


def bits(spec: Spec, names: list[str]) -> None:
    spec.chapter["flags"] = {
        f"bits{number}": {
            "page": PAGE,
            "format": "dword",
            "bits": {name: {"bit": n, "note": "x"} for n, name in enumerate(part)},
        }
        for number, part in enumerate(few(names, 32))
    }


def blocks(spec: Spec, names: list[str]) -> None:
    block = spec.data({"x": {"format": "word"}}, 2)
    spec.chapter["blocks"] = dict.fromkeys(names, block)
    for number, name in enumerate(names):
        spec.message(f"W{number}", data={"block": name})


def formats(spec: Spec, names: list[str]) -> None:
    new = [name for name in names if name not in spec.files["tiny/protocol.yaml"]["formats"]]
    format = {"size": 1, "signed": True}
    spec.files["tiny/protocol.yaml"]["formats"] |= dict.fromkeys(new, format)
    for number, name in enumerate(new):
        data = {"x": {"format": name}, "y": {"format": f"{name}[1]"}}
        spec.message(f"W{number}", data=spec.data(data, 1))


def quantities(spec: Spec, names: list[str]) -> None:
    quantity = spec.files["tiny/quantities.yaml"]["quantities"]["distance"]
    spec.files["tiny/quantities.yaml"]["quantities"] |= dict.fromkeys(names, quantity)
    slide = spec.files["tiny/stages.yaml"]["stages"]["Slide"]["controllers"]["TPx"]
    slide |= dict.fromkeys(names, slide["distance"])


def stages(spec: Spec, names: list[str]) -> None:
    known = spec.files["tiny/stages.yaml"]["stages"]
    copy = {key: value for key, value in known["Slide"].items() if key != "ids"}
    known |= dict.fromkeys(names, copy)
    for unit in spec.files["tiny/units.yaml"]["units"].values():
        unit["stages"] = [*unit["stages"], *(name for name in names if name not in unit["stages"])]


def controllers(spec: Spec, names: list[str]) -> None:
    data = spec.files["tiny/stages.yaml"]
    data["controllers"] |= {
        name: {"units": [f"TP{number}"], "page": 3} for number, name in enumerate(names, 100)
    }
    slide = data["stages"]["Slide"]["controllers"]
    slide |= dict.fromkeys(names, slide["TPx"])


def _without_stages(data: Json) -> Json:
    """Return the facts of another unit like TP9, for which no stage has scales."""
    facts = {key: value for key, value in data["units"]["TP9"].items() if key != "fewer_stages"}
    return {**facts, "stages": []}


def units(spec: Spec, names: list[str]) -> None:
    data = spec.files["tiny/units.yaml"]
    data["units"] |= {name: _without_stages(data) for name in names}


def families(spec: Spec, names: list[str]) -> None:
    known = spec.files["tiny/units.yaml"]["families"]
    family = {key: value for key, value in known["plain"].items() if key != "hazards"}
    known |= dict.fromkeys(names, family)  # hazards are of the messages of units


def lists(spec: Spec, names: list[str]) -> None:
    data = spec.files["tiny/units.yaml"]
    for number, name in enumerate(names):
        data["units"][f"L{number}"] = _without_stages(data)
        listed = data["lists"]["TP1"]
        messages = [*listed["messages"], "POS_PLACE"]  # the family reports its stage in it
        data["lists"][name] = {**listed, "messages": messages, "units": [f"L{number}"]}


# Names in a command protocol


def commanded(fill: Callable[[Json, list[str]], None]) -> Callable[[Spec, list[str]], None]:
    """Return a function that fills an additional chapter of commands, which the witness does not have."""

    def fill_chapter(spec: Spec, names: list[str]) -> None:
        head = {"chapter": "words", "title": "Words", "page": 3, "order": 9}
        chapter: Json = {**head, "commands": {}, "setup_commands": {}}
        fill(chapter, names)
        spec.files["turtle/messages/words.yaml"] = chapter

    return fill_chapter


def command(number: int, **entry: Any) -> Json:
    """Return a command with an unused byte; their number is limited."""
    byte = [*range(0x60, 0x77), *range(0x78, 0x100)][number]
    base = {"byte": byte, "page": 3, "title": "Listing", "effect": "none", "summary": "Has a name."}
    return {**base, **entry}


def data_of(form: str, field: Json, size: int) -> Callable[[Spec, list[str]], None]:
    def fill(chapter: Json, names: list[str]) -> None:
        for number, part in enumerate(few(names, 15)):
            data = {form: {"fields": dict.fromkeys(part, field)}}
            chapter["commands"][f"W{number}"] = command(number, size=size * len(part), **data)

    return commanded(fill)


@commanded
def commands(chapter: Json, names: list[str]) -> None:
    reply = {"fields": {"x": {"format": "u24"}}}
    for number, name in enumerate(names[:150]):
        chapter["commands"][name] = command(number, size=3, reply=reply)


@commanded
def setup_commands(chapter: Json, names: list[str]) -> None:
    for number, name in enumerate(names[:150]):
        chapter["setup_commands"][name] = command(number)


@commanded
def axes(chapter: Json, names: list[str]) -> None:
    values = {name: {"value": number} for number, name in enumerate(names[:200], 0x30)}
    chapter["enumerations"] = {"word": {"page": 3, "values": values}}


# Names in a packet protocol


def packeted(entries: Callable[[list[str]], Iterator[tuple[str, Json]]]) -> Any:
    """Return a function that fills an additional chapter of packets; the number of ids is limited."""

    def fill(spec: Spec, names: list[str]) -> None:
        messages = {
            name: {
                "id": number, "page": 3, "spelling": name.lower().replace("_", " "),
                "direction": "both", "effect": "none", "summary": "Has a name.",
            **entry,
            }
            for number, (name, entry) in enumerate(entries(names), 0x41)
        }  # fmt: skip
        head = {"chapter": "words", "title": "Words", "page": 3, "order": 9}
        spec.files["carousel/messages/words.yaml"] = {**head, "messages": messages}

    return fill


def payload_of(field: Json, size: int) -> Any:
    @packeted
    def entries(names: list[str]) -> Iterator[tuple[str, Json]]:
        for number, part in enumerate(few(names, 32 // size)):
            fields = dict.fromkeys(part, field)
            yield f"W{number}", {"data": {"length": size * len(part), "fields": fields}}

    return entries


@packeted
def packets(names: list[str]) -> Iterator[tuple[str, Json]]:
    for name in names:
        yield name, {"header": {}}


def chapters(spec: Spec, names: list[str]) -> None:
    for number, name in enumerate(names):
        message = {
            "id": 0x3000 + number, "page": PAGE, "spelling": f"w{number}", "direction": "both",
            "effect": "none", "summary": "Has a name.", "header": {},
        }  # fmt: skip
        spec.files[f"tiny/messages/c{number}.yaml"] = {
            "chapter": name, "title": "x", "page": PAGE, "order": 9, "messages": {f"W{number}": message},
        }  # fmt: skip
        spec.printed["messages"][f"W{number}"] = heading(0x3000 + number)


KINDS: dict[str, tuple[Callable[[Spec, list[str]], None], list[str], set[str]]] = {
    "fields": (fields({"format": "byte"}, 1), SNAKE, KEYWORDS | MEMBERS),
    "ranged fields": (
        fields({"format": "byte", "minimum": 1, "maximum": 4}, 1), SNAKE, KEYWORDS | MEMBERS,
    ),
    "texts": (fields({"format": "char[3]"}, 3), SNAKE, KEYWORDS | MEMBERS),
    "bytes": (fields({"format": "byte[3]"}, 3), SNAKE, KEYWORDS | MEMBERS),
    "fields with flags": (
        fields({"format": "byte", "flags": "some_bits"}, 1), SNAKE, KEYWORDS | MEMBERS,
    ),
    "reserved fields": (
        fields({"format": "word", "role": "reserved"}, 2), SNAKE, KEYWORDS | MEMBERS,
    ),
    "constant fields": (
        fields({"format": "word", "role": "constant", "value": 7}, 2), SNAKE, KEYWORDS | MEMBERS,
    ),
    "parameters": (parameters, SNAKE, KEYWORDS | MEMBERS),
    "shared fields": (shared, SNAKE, KEYWORDS | MEMBERS),
    "messages": (messages, CAPITALS, CLASSES),
    "sets": (sets, CAPITALS[::4], set()),
    "forms": (forms, WORDS, set()),
    "contexts": (contexts, FEW, set()),
    "values of a context": (context_values, FEW, set()),
    "enumerations": (enumerations, SNAKE, {"enumeration", "none", "true", "false"}),
    "values": (values, CAPITALS, set()),
    "flag tables": (flag_tables, SNAKE, {"flags", "bit", "none", "true", "false"}),
    "bits": (bits, SNAKE, KEYWORDS | {"bits", "of", "names", "unnamed", "real"}),
    "blocks": (blocks, FEW, set()),
    "formats": (formats, [name for name in WORDS if len(name) < 17], set()),
    "quantities": (quantities, FEW, set()),
    "stages": (stages, MIXED, {"Stage", "Scale", "None", "True", "False"}),
    "controllers": (controllers, MIXED, set()),
    "units": (units, MIXED, set()),
    "families": (families, FEW, set()),
    "lists": (lists, MIXED, set()),
    "integers of a request": (
        data_of("request", {"format": "s24"}, 3), SNAKE, KEYWORDS | MEMBERS,
    ),
    "integers of a reply": (data_of("reply", {"format": "u24"}, 3), SNAKE, KEYWORDS | MEMBERS),
    "texts of a request": (
        data_of("request", {"format": "char[3]"}, 3), SNAKE, KEYWORDS | MEMBERS,
    ),
    "texts of a reply": (data_of("reply", {"format": "char[3]"}, 3), SNAKE, KEYWORDS | MEMBERS),
    "flags of a reply": (
        data_of("reply", {"format": "u8", "flags": "eyes"}, 1), SNAKE, KEYWORDS | MEMBERS,
    ),
    "commands": (commands, OURS_FIRST[:150], CLASSES),
    "setup commands": (setup_commands, OURS_FIRST[:150], CLASSES),
    "axes": (axes, CAPITALS[:150], set()),
    "integers of a payload": (payload_of({"format": "s24"}, 3), SNAKE, KEYWORDS | MEMBERS),
    "bytes of a payload": (payload_of({"format": "u8[2]"}, 2), SNAKE, KEYWORDS | MEMBERS),
    "flags of a payload": (
        payload_of({"format": "u16", "flags": "state_bits"}, 2), SNAKE, KEYWORDS | MEMBERS,
    ),
    "packets": (packets, OURS_FIRST[:150], CLASSES),
    "chapters": (chapters, SNAKE, PYTHON | {"con", "nul", "aux", "com1", "decode", "tuple"}),
}  # fmt: skip


def named(diagnostic: Diagnostic, folder: Path) -> set[str]:
    """Return the names that a diagnostic may refer to: on its line, and first and last in its message."""
    lines = (folder / diagnostic.place.file).read_text(encoding="utf-8").splitlines()
    line = lines[diagnostic.place.line - 1].strip().rstrip(",")
    at = re.findall(r'"([^"]*)"', line)
    words = re.sub(
        r" (is reserved|differ only in case or underscores)$", "", diagnostic.message
    ).split(" ")
    return {*at, words[-1], words[0]}


def settle(
    fill: Callable[[Spec, list[str]], None], names: list[str], files: Files, folder: Path
) -> tuple[dict[str, str], list[str]]:
    """Remove refused names until the spec is valid; return the rendered files and the remaining names."""
    for number in range(6):
        spec = Spec(files)
        fill(spec, names)
        at = spec.write(folder / str(number))
        try:
            return render(check(at), TARGETS), names
        except SpecError as error:
            refused: set[str] = set()
            for diagnostic in error.diagnostics:
                assert diagnostic.code in ("SW022", "SW023"), str(diagnostic)
                meant = named(diagnostic, at) & set(names)
                assert meant, str(diagnostic)
                refused |= meant
            names = [name for name in names if name not in refused]
    raise AssertionError("names are still refused after six attempts")


EVERY_RUN = ("fields", "bits", "stages", "commands", "packets")
every_kind = pytest.mark.parametrize(
    "kind",
    [pytest.param(kind, marks=() if kind in EVERY_RUN else pytest.mark.matrix) for kind in KINDS],
)
some_kinds = pytest.mark.parametrize("kinds", part_or_all(EVERY_RUN, tuple(KINDS)))
Settled = Callable[[str], tuple[dict[str, str], list[str]]]


@pytest.fixture(scope="module")
def settled(
    quick_checking: None, files: Files, tmp_path_factory: pytest.TempPathFactory
) -> Settled:
    """A function from a kind to the rendered files and the names that are not refused."""

    @cache
    def of_kind(kind: str) -> tuple[dict[str, str], list[str]]:
        fill, names, _ = KINDS[kind]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(pipeline, "check_errata", witness_of_messages_only)
            return settle(fill, names, files, tmp_path_factory.mktemp("names"))

    return of_kind


def witness_of_messages_only(protocol: Protocol, *rest: Any) -> Any:
    """Skip the witness of the commands, which has none of the names."""
    return None if protocol.name == "turtle" else check_errata(protocol, *rest)


def test_there_are_enough_names() -> None:
    assert set(SNAKE) >= KEYWORDS
    assert min(len(SNAKE), len(CAPITALS), len(MIXED)) > 200


@every_kind
def test_reserved_names_are_refused(settled: Settled, kind: str) -> None:
    _, names, kept = KINDS[kind]
    assert kept <= set(names)
    left = set(settled(kind)[1])
    assert kept & left == set()
    assert left, "every name was refused"


@every_kind
def test_rendered_files_are_valid_and_harmless(
    settled: Settled, rendered: dict[str, str], kind: str
) -> None:
    assert list(faults(settled(kind)[0], rendered)) == []


@some_kinds
def test_packages_with_the_remaining_names_work(
    settled: Settled, tmp_path: Path, kinds: tuple[str, ...]
) -> None:
    folders = {}
    for number, kind in enumerate(kinds):
        tree, _ = settled(kind)
        folders[str(write_tree(tree, tmp_path / str(number)) / "python")] = kind
    wrong = run_packages([Path(folder).parent for folder in folders], tmp_path / "workplace")
    assert {folders[folder]: fault for folder, fault in wrong.items()} == {}
    assert ruff("check", "--select", "F,E9", str(tmp_path)) == ""
    assert ruff("format", "--diff", str(tmp_path)) == ""


@some_kinds
def test_allowed_names_are_unchanged_in_the_registry(
    settled: Settled, kinds: tuple[str, ...]
) -> None:
    """An allowed name is not changed."""
    for kind in kinds:
        tree, names = settled(kind)
        texts = "".join(tree[f"registry/{name}.json"] for name in ("tiny", "turtle", "carousel"))
        for name in names:
            shown = f"data:{name}" if kind == "forms" else name
            if kind != "blocks":  # blocks are expanded, so their names disappear
                assert f'"{shown}"' in texts, f"{kind}: {name}"


@pytest.mark.parametrize(
    ("kind", "pair"),
    [
        ("fields", ["a_bc", "ab_c"]),
        ("fields", ["mode", "mo_de"]),
        ("bits", ["a_bc", "ab_c"]),
        ("values", ["A_BC", "AB_C"]),
        ("messages", ["A_BC", "AB_C"]),
        ("enumerations", ["a_bc", "ab_c"]),
        ("flag tables", ["a_bc", "ab_c"]),
        ("stages", ["Foo", "FOO"]),
        ("controllers", ["Foo", "FOO"]),
        ("units", ["Foo", "FOO"]),
        ("lists", ["Foo", "FOO"]),
        ("commands", ["A_BC", "AB_C"]),
        ("commands", ["FOO", "FOO_REPLY"]),
        ("integers of a reply", ["a_bc", "ab_c"]),
        ("axes", ["A_BC", "AB_C"]),
        ("packets", ["A_BC", "AB_C"]),
        ("integers of a payload", ["a_bc", "ab_c"]),
    ],
    ids=str,
)
def test_names_that_are_too_alike_are_refused(
    files: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, pair: list[str]
) -> None:
    monkeypatch.setattr(pipeline, "check_errata", witness_of_messages_only)
    spec = Spec(files)
    KINDS[kind][0](spec, pair)
    with pytest.raises(SpecError) as caught:
        check(spec.write(tmp_path))
    assert {d.code for d in caught.value.diagnostics} == {"SW022"}
    message = str(caught.value.diagnostics[0])
    assert pair[0] in message
    assert pair[1] in message


PACKAGES = [
    "struct",
    "typing",
    "sys",
    "enum",
    "os",
    "json",
    "stagewire",
    "stagewire_cli",
    "serial",
    "class",
]
PACKAGES += [
    "con",
    "nul",
    "lpt1",
    "x__y",
    "x_",
    "_x",
    "X",
    "x-y",
    "x.y",
    "../x",
    "x/y",
    "ｘ",
    "",
    "yield",
]


@pytest.mark.parametrize("name", PACKAGES)
def test_a_hostile_package_name_is_refused(files: Files, tmp_path: Path, name: str) -> None:
    other = copy.deepcopy(files)
    other["tiny/protocol.yaml"]["python"]["package"] = name
    with pytest.raises(SpecError) as caught:
        check(write(other, tmp_path))
    assert {d.code for d in caught.value.diagnostics} <= {"SW010", "SW023"}


@pytest.mark.parametrize(
    "name", ["con", "nul", "aux", "com9", "x__y", "../x", "x/y", "x\\y", ".", "X"]
)
def test_a_hostile_protocol_name_is_refused(files: Files, tmp_path: Path, name: str) -> None:
    other = copy.deepcopy(files)
    other["tiny/protocol.yaml"]["protocol"] = name
    with pytest.raises(SpecError) as caught:
        check(write(other, tmp_path))
    assert {d.code for d in caught.value.diagnostics} <= {"SW010", "SW023"}
