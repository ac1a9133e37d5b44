"""``stagewire generate`` for build systems: lists of files, and user templates."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from checkout import SMALL_SPECS

if TYPE_CHECKING:
    from conftest import Stagewire

SMALL = SMALL_SPECS / "good_spec"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the current folder, which contains the small good spec."""
    shutil.copytree(SMALL, tmp_path / "spec")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def files_in(folder: Path) -> list[str]:
    here = Path.cwd()
    return sorted(p.relative_to(here).as_posix() for p in folder.rglob("*") if p.is_file())


def break_it(here: Path) -> None:
    path = here / "spec" / "tiny" / "units.yaml"
    path.write_text(path.read_text(encoding="utf-8") + "units: {}\n", encoding="utf-8")


@pytest.mark.parametrize(
    "target", [(), ("--target", "registry", "--target", "vectors", "--target", "c-tests")]
)
def test_the_listed_outputs_are_written(
    stagewire: Stagewire, here: Path, target: tuple[str, ...]
) -> None:
    command = ("generate", "--out", "made/here", *target)
    listed = stagewire(*command, "--list-outputs")
    assert (listed.code, listed.err) == (0, "")
    assert not (here / "made").exists()
    assert stagewire(*command).code == 0
    assert listed.out.splitlines() == files_in(here / "made")


def test_a_spec_with_errors_has_no_outputs(stagewire: Stagewire, here: Path) -> None:
    break_it(here)
    listed = stagewire("generate", "--list-outputs")
    assert (listed.code, listed.out) == (1, "")
    assert "tiny/units.yaml:" in listed.err
    assert " SW002 " in listed.err
    assert listed.err.endswith("nothing was listed\n")


def test_files_are_named_from_the_current_folder(stagewire: Stagewire, here: Path) -> None:
    """This applies to each spec, whatever the names of its protocols."""
    break_it(here)
    shutil.copytree(here / "spec" / "tiny", here / "more" / "protocols" / "tiny")
    result = stagewire("generate", "--spec", "spec", "--spec", "more/protocols/tiny")
    assert result.code == 1
    said = [line.partition(":")[0] for line in result.out.splitlines() if " SW002 " in line]
    assert said == ["spec/tiny/units.yaml", "more/protocols/tiny/units.yaml"]


def test_the_inputs_are_spec_templates_and_generator(stagewire: Stagewire, here: Path) -> None:
    (here / "mine").mkdir()
    (here / "mine" / "wrong name.j2").write_text("{% if", encoding="utf-8")
    (here / "mine" / ".hidden").write_text("", encoding="utf-8")
    shutil.copytree(SMALL_SPECS / "good_commands", here / "more")
    command = ("generate", "--spec", "spec", "--spec", "more", "--templates", "mine")
    listed = stagewire(*command, "--list-inputs")
    assert (listed.code, listed.err) == (0, "")
    lines = listed.out.splitlines()
    assert lines == sorted(set(lines))
    assert all(Path(line).is_file() for line in lines)
    assert [line for line in lines if not line.startswith("/")] == sorted(
        [*files_in(here / "spec"), *files_in(here / "more"), "mine/wrong name.j2"]
    )
    generator = {Path(line).name for line in lines if line.startswith("/")}
    assert {"pipeline.py", "flags.py.j2", "answer.c", "messages.schema.json"} <= generator
    break_it(here)
    assert stagewire(*command, "--list-inputs") == listed


def test_a_spec_can_be_named_from_inside_its_folder(
    stagewire: Stagewire, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder is found with any name."""
    for folder, name in (
        ("spec", "."),
        ("spec/tiny", "."),
        ("spec/tiny", ".."),
        (".", "spec/tiny"),
    ):
        monkeypatch.chdir(here / folder)
        assert stagewire("check", name).code == 0, name
        listed = stagewire("generate", "--spec", name, "--list-inputs").out.splitlines()
        assert str(here / "spec" / "tiny" / "examples.yaml") in listed
        assert str(here / "spec" / "tiny" / "messages" / "core.yaml") in listed


def test_built_in_templates_are_listed(stagewire: Stagewire, here: Path) -> None:
    listed = stagewire("generate", "--list-templates")
    assert (listed.code, listed.err) == (0, "")
    [flags] = [line for line in listed.out.splitlines() if line.endswith("/flags.py.j2")]
    (here / "mine").mkdir()
    shutil.copy(flags, here / "mine")
    assert stagewire("generate", "--templates", "mine").code == 0
    assert stagewire("generate", "--check").code == 0


def test_a_user_template_replaces_a_built_in_one(stagewire: Stagewire, here: Path) -> None:
    (here / "mine").mkdir()
    (here / "mine" / "empty.py.j2").write_text(
        "class {{ view.name }}({{ view.base }}):\n"
        "    layout = {{ view.layout.opening }}{{ view.layout.items|join(' , ') }})\n",
        encoding="utf-8",
    )
    assert stagewire("generate", "--templates", "mine").code == 0
    made = (here / "generated/python/stagewire_tiny/messages/extra.py").read_text("utf-8")
    assert ' , form="' in made
    compile(made, "extra.py", "exec")


def test_the_folder_of_the_cmake_module_is_printed(stagewire: Stagewire) -> None:
    listed = stagewire("generate", "--cmake-dir")
    assert (listed.code, listed.err) == (0, "")
    assert (Path(listed.out.rstrip("\n")) / "StagewireGenerate.cmake").is_file()


def test_check_uses_user_templates(stagewire: Stagewire, here: Path) -> None:
    (here / "mine").mkdir()
    template = here / "mine" / "flags.py.j2"
    template.write_text("# mine\n", encoding="utf-8")
    command = ("generate", "--templates", "mine")
    assert stagewire(*command).code == 0
    assert stagewire(*command, "--check").code == 0
    assert "changed: python/stagewire_tiny/flags.py" in stagewire("generate", "--check").out
    template.write_text("# mine, later\n", encoding="utf-8")
    assert stagewire(*command, "--check").code == 1


@pytest.mark.parametrize("mode", [[], ["--check"], ["--list-outputs"]])
def test_invalid_templates_write_nothing(stagewire: Stagewire, here: Path, mode: list[str]) -> None:
    (here / "mine").mkdir()
    (here / "mine" / "flags.py.j2").write_text('{{ "\x1b[2J"|nothing }}', encoding="utf-8")
    (here / "mine" / "\x1b[2J.j2").write_text("", encoding="utf-8")
    done = stagewire("generate", "--templates", "mine", *mode)
    assert (done.code, done.out) == (1, "")
    undone = {"--check": "compared", "--list-outputs": "listed"}.get("".join(mode), "written")
    assert done.err == (
        "stagewire: mine/\\x1b[2J.j2: no template has this name\n"
        "stagewire: mine/flags.py.j2:1: No filter named 'nothing'.\n"
        f"nothing was {undone}\n"
    )
    assert not (here / "generated").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--check", "--list-inputs"], "--check and --list-inputs cannot be combined"),
        (
            ["--list-outputs", "--list-inputs"],
            "--list-outputs and --list-inputs cannot be combined",
        ),
        (["--list-templates", "--cmake-dir"], "cannot be combined"),
        (["--templates", "nowhere"], "nowhere is not a folder; give a folder with templates"),
        (["--templates", ""], "the name of a folder is empty"),
        (["--spec", "nowhere", "--list-inputs"], "nowhere is not a folder"),
        (
            ["--spec", "spec/tiny/messages", "--list-inputs"],
            "contains no folder with a protocol.yaml",
        ),
        (["--target", "cobol", "--list-outputs"], "unknown target cobol"),
    ],
)
def test_wrong_arguments_are_refused(
    stagewire: Stagewire, here: Path, words: list[str], said: str
) -> None:
    done = stagewire("generate", *words)
    assert (done.code, done.out) == (2, "")
    assert said in done.err


@pytest.mark.parametrize(
    ("old", "said"),
    [("", "the protocol carousel"), ("protocol: carousel", "the package stagewire_carousel")],
)
def test_folders_with_the_same_names_are_refused(
    stagewire: Stagewire, here: Path, old: str, said: str
) -> None:
    """The output of one of two protocols with the same name would overwrite the other."""
    for folder in ("one", "two"):
        shutil.copytree(SMALL_SPECS / "good_packets", here / folder)
    (here / "two" / "carousel").rename(here / "two" / "other")
    for name in ("protocol.yaml", "examples.yaml"):
        path = here / "two" / "other" / name
        text = path.read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, "protocol: other") if old else text, encoding="utf-8")
    done = stagewire("generate", "--spec", "one", "--spec", "two", "--out", "made")
    assert (done.code, done.err) == (
        2, f"stagewire: more than one of the folders has {said}\n",
    )  # fmt: skip
    assert not (here / "made").exists()


def test_folders_with_the_same_c_prefix_are_refused(stagewire: Stagewire, here: Path) -> None:
    shutil.copytree(here / "spec", here / "two")
    (here / "two" / "tiny").rename(here / "two" / "other")
    for kind in ("examples", "captures"):
        replace_in(here / "two" / "other" / f"{kind}.yaml", "protocol: tiny", "protocol: other")
    head = here / "two" / "other" / "protocol.yaml"
    replace_in(head, "protocol: tiny", "protocol: other")
    replace_in(head, "package: stagewire_tiny", "package: tiny")
    done = stagewire("generate", "--spec", "spec", "--spec", "two", "--out", "made")
    said = "stagewire: more than one of the folders has the C prefix tiny\n"
    assert (done.code, done.err) == (2, said)
    assert not (here / "made").exists()


def replace_in(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.mark.parametrize("name", ["two\nlines.yaml", "two\u2028lines.yaml", b"caf\xe9.yaml"])
def test_a_path_with_a_line_break_is_refused(
    stagewire: Stagewire, here: Path, name: str | bytes
) -> None:
    folder = bytes(here / "spec" / "tiny" / "messages")
    path = folder + b"/" + (name if isinstance(name, bytes) else name.encode())
    with open(path, "wb"):
        pass
    listed = stagewire("generate", "--list-inputs")
    assert (listed.code, listed.out) == (2, "")
    assert "cannot be listed: rename it" in listed.err
