"""Other examples of the page: the lists of files, and a template that includes the one it shadows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from build_systems_page import blocks

if TYPE_CHECKING:
    from conftest import Run


def test_every_block_of_the_page_is_run() -> None:
    run = {"sh": 1, "cmake": 2, "make": 1, "yaml": 2, "jinja": 1}
    assert {language: len(blocks(language)) for language in run} == run
    assert len(blocks()) == sum(run.values())


def test_the_lists_of_inputs_and_outputs_are_complete(project: Path, run: Run) -> None:
    [block] = [block for block in blocks("sh") if "--list-outputs" in block]
    commands = [line.partition("#")[0].split() for line in block.splitlines()]
    outputs, inputs = (run(*words).stdout.splitlines() for words in commands)
    assert not (project / "generated").exists()
    assert run("stagewire", "generate").returncode == 0
    found = sorted(p.relative_to(project).as_posix() for p in project.glob("generated/**/*.*"))
    assert outputs == found
    assert {line for line in inputs if line.startswith("spec/")} == {
        p.relative_to(project).as_posix() for p in project.glob("spec/**/*.yaml")
    }


def test_the_template_of_the_page_adds_a_licence(project: Path, run: Run) -> None:
    [template] = blocks("jinja")
    assert run("stagewire", "generate").returncode == 0
    module = project / "generated" / "python" / "stagewire_tiny" / "flags.py"
    ours = module.read_text(encoding="utf-8")
    (project / "mine").mkdir()
    (project / "mine" / "flags.py.j2").write_text(template, encoding="utf-8")
    (project / "mine" / "_licence").write_text("# Free for all.\n", encoding="utf-8")
    done = run("stagewire", "generate", "--templates", "mine")
    assert done.returncode == 0, done.stdout
    first = template.splitlines()[0]
    assert module.read_text(encoding="utf-8") == f"{first}\n# Free for all.\n{ours}"
