"""Templates of a user: shadowing of ours, and error messages with their places."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from stagewire_generator import render
from stagewire_generator.model import Protocol
from stagewire_generator.targets.templates import Templates, TemplatesError, our_templates

FLAGS = "python/stagewire_tiny/flags.py"
INCLUDED = '{% include "stagewire/flags.py.j2" %}'

Shadowed = Callable[..., dict[str, str]]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "my templates"
    folder.mkdir()
    return folder


@pytest.fixture
def shadowed(folder: Path, protocol: Protocol) -> Shadowed:
    """Render the small good spec with templates by name, as text or bytes."""

    def shadow(**given: str | bytes) -> dict[str, str]:
        for name, text in given.items():
            path = folder / name.replace("__", ".")
            path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
        return render([protocol], None, Templates(folder))

    return shadow


def problems(shadowed: Shadowed, **given: str | bytes) -> list[str]:
    with pytest.raises(TemplatesError) as caught:
        shadowed(**given)
    return str(caught.value).split("\n")


def test_names_are_unique_over_all_targets() -> None:
    """Only the file name decides which template a file shadows."""
    names = [path.name for path in our_templates()]
    assert "flags.py.j2" in names
    assert sorted(set(names)) == sorted(names)


def test_files_without_tags_are_not_templates() -> None:
    """Files that are the same for every protocol are plain files."""
    texts = {path.name: path.read_text(encoding="utf-8") for path in our_templates()}
    assert [name for name, text in texts.items() if not re.search(r"\{[{%]", text)] == []


def test_plain_files_cannot_be_shadowed(shadowed: Shadowed, folder: Path) -> None:
    for name in ("answer__c", "answer__c__j2"):
        [problem, *_] = problems(shadowed, **{name: "int x;\n"})
        assert problem.endswith(": no template has this name")
        (folder / name.replace("__", ".")).unlink()


def test_a_file_shadows_ours_of_the_same_name(shadowed: Shadowed, files: dict[str, str]) -> None:
    mine = shadowed(flags__py__j2="# bits of {{ package.package }}\n")
    assert mine[FLAGS] == "# bits of stagewire_tiny\n"
    assert {path for path in files if mine[path] != files[path]} == {FLAGS, "manifest.json"}


def test_the_shadowed_template_can_be_included(shadowed: Shadowed, files: dict[str, str]) -> None:
    mine = shadowed(flags__py__j2=f'{{% include "_notice" %}}\n{INCLUDED}', _notice="# mine\n")
    assert mine[FLAGS] == f"# mine\n{files[FLAGS]}"


def test_included_templates_can_be_shadowed(shadowed: Shadowed, files: dict[str, str]) -> None:
    """Also if a template of the user includes our template that includes them."""
    mine = shadowed(
        chapter__py__j2='# mine\n{% include "stagewire/chapter.py.j2" %}',
        plain__py__j2="# the message {{ view.name }}\n",
    )
    text = mine["python/stagewire_tiny/messages/extra.py"]
    assert text.startswith(f"# mine\n{files['python/stagewire_tiny/messages/extra.py'][:20]}")
    assert "# the message Lamp\n" in text


@pytest.mark.parametrize("text", [f"\ufeff{INCLUDED}", INCLUDED.replace(" ", "\r\n")])
def test_files_with_a_byte_order_mark_and_other_line_ends(
    shadowed: Shadowed, files: dict[str, str], text: str
) -> None:
    assert shadowed(flags__py__j2=text)[FLAGS] == files[FLAGS]


def test_hidden_files_are_ignored(shadowed: Shadowed, files: dict[str, str]) -> None:
    assert shadowed(flags__py__j2=INCLUDED, __swp=b"\xff")[FLAGS] == files[FLAGS]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("one\n{{ nothing }}", "2: 'nothing' is undefined"),
        ("{{ package.nothing }}", "1: "),
        ("\n\n{% if %}", "3: Expected an expression, got 'end of statement block'"),
        ("{% if package %}\n", "1: Unexpected end of template"),
        ("\n{{ package|backwards }}", "2: No filter named 'backwards'."),
        ("\n{{ 1 / 0 }}", "2: ZeroDivisionError: division by zero"),
        ("\n{{ package.title|sort(attribute='x') }}", "2: "),
        ('\n{% include "stagewire/flag.py.j2" %}', "2: unknown template stagewire/flag.py.j2"),
        ('\n{% include "_mine" %}', "2: unknown template _mine in an include"),
        ('\n{% include "../flags.py.j2" %}', "2: unknown template ../flags.py.j2 in an include"),
        ('\n{% include "flags.py.j2" %}', "2: RecursionError: "),
        ("{% extends none %}", "1: "),
    ],
)
def test_an_error_names_the_template_and_its_line(
    shadowed: Shadowed, folder: Path, text: str, said: str
) -> None:
    [problem] = problems(shadowed, flags__py__j2=text)
    assert problem.lower().startswith(f"{folder / 'flags.py.j2'}:{said}".lower())
    assert not problem.endswith(": ")


def test_an_error_names_the_innermost_place(shadowed: Shadowed, folder: Path) -> None:
    [problem] = problems(shadowed, flags__py__j2='{% include "_part" %}', _part="\n{{ oh }}")
    assert problem == f"{folder / '_part'}:2: 'oh' is undefined"
    given = '{% set package = 0 %}{% include "stagewire/flags.py.j2" %}'
    [problem] = problems(shadowed, flags__py__j2=given)
    assert problem.startswith("stagewire/flags.py.j2:1: 'int object' has no attribute")


def test_a_text_that_cannot_be_encoded(shadowed: Shadowed, folder: Path) -> None:
    [problem] = problems(shadowed, flags__py__j2='{{ "\\ud800" }}')
    assert problem == f"{folder / 'flags.py.j2'}: produces text that cannot be encoded as UTF-8"


def test_invalid_python_is_an_error(shadowed: Shadowed) -> None:
    [said] = problems(shadowed, flags__py__j2="FINE = 1\ndef not python\n")
    assert said.startswith(f"{FLAGS}:2: the templates produce invalid Python: ")


def test_an_unknown_name_gets_suggestions(shadowed: Shadowed, folder: Path) -> None:
    assert problems(shadowed, quantity__py__j2="", chapter__j2="", README__md="") == [
        f"{folder / 'README.md'}: no template has this name",
        f"{folder / 'chapter.j2'}: no template has this name; "
        "did you mean chapter.h.j2 or chapter.py.j2?",
        f"{folder / 'quantity.py.j2'}: no template has this name; "
        "did you mean quantities.h.j2 or quantities.py.j2?",
    ]


def test_all_problems_with_files_are_reported(
    shadowed: Shadowed, folder: Path, tmp_path: Path
) -> None:
    (folder / "python").mkdir()
    (tmp_path / "elsewhere").write_text("a secret", encoding="utf-8")
    (folder / "stages.py.j2").symlink_to(tmp_path / "elsewhere")
    os.mkfifo(folder / "package.py.j2")
    given: dict[str, str | bytes] = {
        "flags__py__j2": b"caf\xe9",
        "chapter__py__j2": " " * (1 << 20) + "1",
        "messages__py__j2": "{% endif %}",
        "quantities__py__j2": "{{ package.title",
    }
    found = {
        line.partition(": ")[0]: line.partition(": ")[2] for line in problems(shadowed, **given)
    }
    assert found == {
        str(folder / "chapter.py.j2"): "is larger than 1048576 bytes",
        str(folder / "flags.py.j2"): "byte 3 is not UTF-8",
        str(folder / "package.py.j2"): "is not a regular file",
        str(folder / "python"): f"is a directory; put templates directly in {folder}",
        str(folder / "stages.py.j2"): "is a link to a file outside the directory of templates",
        f"{folder / 'messages.py.j2'}:1": "Encountered unknown tag 'endif'.",
        f"{folder / 'quantities.py.j2'}:1": "unexpected end of template, expected 'end of print statement'.",
    }


def test_an_empty_directory_is_an_error(folder: Path) -> None:
    with pytest.raises(TemplatesError, match="contains no templates"):
        Templates(folder)


def test_a_link_within_the_directory_is_followed(shadowed: Shadowed, folder: Path) -> None:
    (folder / "_part").write_text("# linked\n", encoding="utf-8")
    (folder / "flags.py.j2").symlink_to("_part")
    assert shadowed()[FLAGS] == "# linked\n"
