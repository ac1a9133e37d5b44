"""Templates compiled to Python modules: same output, and modules of changed templates are not used."""

from __future__ import annotations

from pathlib import Path

import jinja2
import pytest

from stagewire_generator import render
from stagewire_generator.model import Protocol
from stagewire_generator.targets import environment
from stagewire_generator.targets.environment import (
    compile_templates,
    compiled_templates,
    our_templates,
)
from stagewire_generator.targets.templates import Templates


@pytest.fixture
def compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The modules of our templates, in a temporary directory."""
    folder = tmp_path / "compiled"
    compile_templates(folder)
    monkeypatch.setattr(environment, "COMPILED", folder)
    return compiled_templates(our_templates())


def used(templates: Templates) -> dict[str, Path]:
    """Return the file that each template comes from."""
    found = {
        path.name: templates._environment.get_template(path.name).filename
        for path in our_templates()
    }
    return {name: Path(str(file)) for name, file in found.items()}


def test_each_template_has_its_module(compiled: Path) -> None:
    assert {file.parent for file in used(Templates()).values()} == {compiled}
    assert len(list(compiled.glob("*.py"))) == len(our_templates())


def test_compiled_templates_render_the_same(
    compiled: Path, protocol: Protocol, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from_modules = render([protocol], None, Templates())
    monkeypatch.setattr(environment, "COMPILED", tmp_path / "nothing")
    from_texts = Templates()
    assert {file.suffix for file in used(from_texts).values()} == {".j2"}
    assert render([protocol], None, from_texts) == from_modules


def test_modules_of_changed_templates_are_not_used(
    compiled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The digest covers all names and texts, the settings, and the version of Jinja."""
    first, *others = our_templates()
    edited = tmp_path / first.name
    edited.write_bytes(first.read_bytes()[:-1] + b"#")
    renamed = tmp_path / f"x{first.name}"
    renamed.write_bytes(first.read_bytes())
    sets = [(edited, *others), (renamed, *others), (*others,), (first, *others, edited)]
    found = {compiled, *map(compiled_templates, sets)}
    with monkeypatch.context() as patched:
        patched.setitem(environment._SETTINGS, "trim_blocks", False)
        found.add(compiled_templates(our_templates()))
    monkeypatch.setattr(jinja2, "__version__", "3.1.0")
    found.add(compiled_templates(our_templates()))
    assert len(found) == 2 + len(sets) + 1
    assert {file.suffix for file in used(Templates()).values()} == {".j2"}


def test_a_missing_module_is_compiled_from_the_text(compiled: Path) -> None:
    name = our_templates()[0].name
    (compiled / jinja2.ModuleLoader.get_module_filename(name)).unlink()
    missing = {found for found, file in used(Templates()).items() if file.suffix == ".j2"}
    assert missing == {name}


def test_templates_of_a_user_are_not_compiled_to_disk(compiled: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "flags.py.j2").write_text("# mine\n")
    before = sorted(tmp_path.rglob("*"))
    assert {file.suffix for file in used(Templates(mine)).values()} == {".j2"}
    assert sorted(tmp_path.rglob("*")) == before
