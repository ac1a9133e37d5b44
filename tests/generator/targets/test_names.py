"""Names that specs cannot use: imports of generated modules, names in their methods, keywords."""

from __future__ import annotations

import ast
import keyword
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from stagewire_generator import check
from stagewire_generator.diagnostics import SpecError

Modules = Callable[[str], list[ast.Module]]


@pytest.fixture(scope="module")
def modules(
    files: dict[str, str], command_files: dict[str, str], packet_files: dict[str, str]
) -> Modules:
    """The generated modules with a name in all packages; ``messages/*`` means the chapters."""
    parsed = {
        path: ast.parse(text)
        for generated in (files, command_files, packet_files)
        for path, text in generated.items()
        if path.endswith(".py")
    }

    def named(name: str) -> list[ast.Module]:
        found = [path for path in parsed if Path(path).match(f"stagewire_*/{name}")]
        if name == CHAPTERS:
            found = [path for path in found if not path.endswith("/__init__.py")]
        assert found
        return [parsed[path] for path in found]

    return named


CHAPTERS = "messages/*.py"

C = """
    alignas alignof auto bool break case char const constexpr continue default do double else enum
    extern false float for goto if inline int long nullptr register restrict return short signed
    sizeof static static_assert struct switch thread_local true typedef typeof typeof_unqual union
    unsigned void volatile while
"""
CPP = """
    and and_eq asm bitand bitor catch char16_t char32_t char8_t class co_await co_return co_yield
    compl concept const_cast consteval constinit decltype delete dynamic_cast explicit export friend
    mutable namespace new noexcept not not_eq operator or or_eq private protected public
    reinterpret_cast requires static_cast template this throw try typeid typename using virtual
    wchar_t xor xor_eq
"""


def refused(spec: Path) -> list[str]:
    """Return the messages about the names of a spec."""
    with pytest.raises(SpecError) as caught:
        check(spec)
    return [d.message for d in caught.value.diagnostics if d.code == "SW023"]


def change(spec: Path, file: str, old: str, new: str) -> None:
    path = spec / "tiny" / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


@contextmanager
def restored(spec: Path) -> Iterator[None]:
    """Undo the changes of the block at its end."""
    before = {path: path.read_bytes() for path in spec.rglob("*.yaml")}
    yield
    for path, content in before.items():
        path.write_bytes(content)


def imported(modules: Modules, *names: str) -> set[str]:
    """Return the names of classes that generated modules import from the runtime."""
    return {
        alias.name
        for name in names
        for module in modules(name)
        for node in ast.walk(module)
        if isinstance(node, ast.ImportFrom) and not (node.module or "").startswith("stagewire_")
        for alias in node.names
        if alias.name[0].isupper()
    }


def words(name: str) -> list[str]:
    """Return ``UndecidedMessage`` as ``undecided`` and ``message``."""
    return [word.lower() for word in re.findall(r"[A-Z][a-z]*", name)]


KEPT = {"False", "None", "True"}


OTHER_CHECKS = {"Sum", "Xor"}  # the packets of the good spec have none


def test_no_message_has_the_name_of_an_import_of_its_module(spec: Path, modules: Modules) -> None:
    for name in sorted(KEPT | OTHER_CHECKS | imported(modules, CHAPTERS, "messages/__init__.py")):
        taken, spelling = "_".join(words(name)).upper(), " ".join(words(name))
        with restored(spec):
            change(spec, "messages/extra.yaml", "  LAMP:\n", f'  "{taken}":\n')
            change(spec, "messages/extra.yaml", "spelling: lamp\n", f'spelling: "{spelling}"\n')
            assert refused(spec) == [f"{taken}: the class name {name} is reserved"]


def test_imports_are_found(modules: Modules) -> None:
    """They are the base classes of all kinds of protocols, and the classes of their protocol objects."""
    assert imported(modules, CHAPTERS, "messages/__init__.py") >= {
        "Command", "CommandProtocol", "Crc", "Direction", "FramedMessage", "FramedProtocol", "Layout",
        "Message", "PacketMessage", "PacketProtocol", "Reply", "Self", "SetupCommand", "Shape", "Struct",
    }  # fmt: skip


def test_a_name_without_a_spelling_is_split_at_underscores(spec: Path) -> None:
    """Names of messages, and of sets with their members."""
    spelled = check(spec)[0]
    change(spec, "messages/extra.yaml", "    spelling: lamp test\n", "")
    change(spec, "messages/core.yaml", "    spelling: mode\n", "")
    [bare] = check(spec)
    words = {message.name: message.words for message in bare.messages}
    assert words == {message.name: message.words for message in spelled.messages}
    assert [found.words for found in bare.sets] == [found.words for found in spelled.sets]


@pytest.mark.parametrize("name", ["MESSAGES", "PROTOCOL"])
def test_no_message_has_the_name_of_a_constant(spec: Path, name: str) -> None:
    """Words of one letter each become a class in capitals."""
    change(spec, "messages/extra.yaml", "  LAMP:\n", f"  {'_'.join(name)}:\n")
    change(spec, "messages/extra.yaml", "spelling: lamp\n", f"spelling: {' '.join(name.lower())}\n")
    assert refused(spec) == [f"{'_'.join(name)}: the class name {name} is reserved"]


def test_no_flag_table_has_the_name_of_an_import_of_its_users(spec: Path, modules: Modules) -> None:
    for name in sorted(KEPT | imported(modules, "flags.py", CHAPTERS)):
        taken = "_".join(words(name))
        with restored(spec):
            change(spec, "messages/core.yaml", "  state_bits:\n", f'  "{taken}":\n')
            change(spec, "messages/core.yaml", "flags: state_bits,", f'flags: "{taken}",')
            assert refused(spec) == [f"{taken}: the class name {name} is reserved"]


def test_no_enumeration_has_the_name_of_an_import_of_its_module(
    spec: Path, modules: Modules
) -> None:
    for name in sorted(KEPT | imported(modules, "enumerations.py")):
        taken = "_".join(words(name))
        with restored(spec):
            change(spec, "messages/core.yaml", "  channel:\n", f'  "{taken}":\n')
            change(spec, "messages/core.yaml", "enum: channel", f'enum: "{taken}"')
            assert refused(spec) == [f"{taken}: the class name {name} is reserved"]


def test_no_stage_has_the_name_of_an_import_of_its_module(spec: Path, modules: Modules) -> None:
    for name in sorted(KEPT | imported(modules, "stages.py")):
        with restored(spec):
            change(spec, "stages.yaml", "  Slide:\n", f'  "{name}":\n')
            change(spec, "units.yaml", "stages: [Slide]", f'stages: ["{name}"]')
            assert refused(spec) == [f"the stage name {name} is reserved"]


def used_by_methods(modules: Modules) -> Iterator[str]:
    """Yield the names in methods with a variable for each field, except these variables."""
    for module in modules(CHAPTERS):
        for kind in module.body:
            if not isinstance(kind, ast.ClassDef):
                continue
            own = {n.target.id for n in kind.body
                   if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)}  # fmt: skip
            for method in kind.body:
                if isinstance(method, ast.FunctionDef) and method.name in ("__new__", "unpack"):
                    for node in ast.walk(method):
                        if isinstance(node, ast.Name | ast.arg):
                            name = node.id if isinstance(node, ast.Name) else node.arg
                            if name not in own and re.fullmatch("[a-z][a-z0-9_]*", name):
                                yield name


def with_fields(spec: Path, names: list[str]) -> Path:
    fields = ", ".join(f'"{name}": {{format: byte}}' for name in names)
    data = "length: 0x04, fields: {sample_time: {format: word, quantity: samples}, "
    data += "force: {format: word, quantity: pressure}}"
    change(spec, "messages/extra.yaml", data, f"length: {len(names)}, fields: {{{fields}}}")
    return spec


def with_bits(spec: Path, names: list[str]) -> Path:
    bits = "".join(f'      "{name}": {{bit: {n % 32}}}\n' for n, name in enumerate(names))
    change(spec, "messages/core.yaml", "      at_rest: {bit: 1}\n", bits)
    return spec


def test_no_field_has_a_name_that_its_methods_use(spec: Path, modules: Modules) -> None:
    names = sorted(set(used_by_methods(modules)) - {"str"})  # `str` is only an annotation
    assert {"cls", "draft", "raw", "int", "check_integer", "check_text", "check_bytes"} <= set(
        names
    )
    assert refused(with_fields(spec, names)) == [
        f"LAMP: the field name {name} is reserved" for name in names
    ]


FORMATS = {"u8": 1, "u16": 2, "u24": 3, "s24": 3, "char[3]": 3, "u8[2]": 2}


@pytest.mark.parametrize("form", ["request", "reply"])
@pytest.mark.parametrize("format", FORMATS)
def test_no_field_of_a_command_has_a_name_that_its_methods_use(
    commands_spec: Path, modules: Modules, form: str, format: str
) -> None:
    """Integers of 24 bits and texts have a variable of the same name before conversion."""
    kept = {*used_by_methods(modules), "int", "reply", "marks", "layout", "pack", "unpack"} - {
        "str"
    }
    names = sorted(kept)
    fields = ", ".join(f'"{name}": {{format: "{format}"}}' for name in names)
    text = (
        "chapter: more\ntitle: More\npage: 3\norder: 9\ncommands:\n"
        "  LOAD: {byte: 0x4C, page: 3, title: Load, effect: none, summary: x, "
        f"size: {FORMATS[format] * len(names)}, {form}: {{fields: {{{fields}}}}}}}\n"
    )
    (commands_spec / "turtle" / "messages" / "more.yaml").write_text(text, encoding="utf-8")
    assert refused(commands_spec) == [f"LOAD: the field name {name} is reserved" for name in names]


every_language = pytest.mark.parametrize(
    "listed", [C, CPP, " ".join(keyword.kwlist)], ids=["C", "C++", "Python"]
)


@every_language
def test_no_field_is_a_keyword(spec: Path, listed: str) -> None:
    names = sorted(name for name in listed.split() if name.islower())
    assert refused(with_fields(spec, names)) == [
        f"LAMP: the field name {name} is reserved" for name in names
    ]


@every_language
def test_no_bit_is_a_keyword(spec: Path, listed: str) -> None:
    names = sorted(name for name in listed.split() if name.islower())
    assert refused(with_bits(spec, names)) == [
        f"state_bits: the bit name {name} is reserved" for name in names
    ]
