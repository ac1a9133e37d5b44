"""``stagewire_generate`` in a CMake project: it runs if and only if an input changed."""

from __future__ import annotations

import tarfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import pytest
from build_systems_page import blocks

if TYPE_CHECKING:
    from conftest import Run

RAN = "stagewire generate: protocols"
MORE = """\
chapter: more
title: More
page: 7
order: 3
flags: {more_bits: {page: 7, format: word, bits: {open: {bit: 0}}}}
"""
with_both = pytest.mark.parametrize("generator", ["Ninja", "Unix Makefiles"], indirect=True)


class Built(NamedTuple):
    code: int
    said: str

    @property
    def ran(self) -> bool:
        """Whether the generator ran."""
        return RAN in self.said


Build = Callable[[], Built]


@pytest.fixture
def generator(request: pytest.FixtureRequest) -> str:
    return str(getattr(request, "param", "Ninja"))


@pytest.fixture
def configured(project: Path, run: Run, generator: str) -> Callable[[str], Build]:
    """Configure the project with a CMakeLists.txt; return a function that builds it."""

    def configure(text: str) -> Build:
        (project / "CMakeLists.txt").write_text(text, encoding="utf-8")
        done = run("cmake", "-G", generator, "-S", ".", "-B", "build")
        assert done.returncode == 0, done.stdout

        def build() -> Built:
            done = run("cmake", "--build", "build", "--parallel", "2")
            return Built(done.returncode, done.stdout)

        return build

    return configure


@pytest.fixture
def build(configured: Callable[[str], Build]) -> Build:
    """A function that builds the unchanged project of the page again."""
    build = configured("".join(blocks("cmake")))
    first = build()
    assert first.code == 0, first.said
    assert first.ran
    return build


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def files_in(folder: Path) -> dict[str, bytes]:
    return {
        p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()
    }


def made(project: Path) -> dict[str, bytes]:
    return files_in(project / "build" / "protocols")


def archived(project: Path) -> list[str]:
    """Return the names in the archive that the project of the page makes of the generated files."""
    with tarfile.open(project / "build" / "protocols.tar") as archive:
        return sorted(name.partition("protocols/")[2] for name in archive.getnames())


def test_the_project_of_the_page_builds(project: Path, build: Build) -> None:
    assert archived(project) == sorted(made(project))


@pytest.mark.matrix
@with_both
def test_a_build_generates_the_same_files_and_only_once(
    project: Path, build: Build, run: Run
) -> None:
    assert run("stagewire", "generate", "--out", "by hand").returncode == 0
    wanted = files_in(project / "by hand")
    assert made(project) == wanted
    assert archived(project) == sorted(wanted)
    module = project / "build" / "protocols" / "python" / "stagewire_tiny" / "flags.py"
    time = module.stat().st_mtime_ns
    again = build()
    assert (again.code, again.ran) == (0, False)
    (project / "spec" / "tiny" / "units.yaml").touch()
    touched = build()
    assert (touched.code, touched.ran) == (0, True)
    assert module.stat().st_mtime_ns == time
    again = build()
    assert (again.code, again.ran) == (0, False)


@pytest.mark.matrix
def test_a_change_in_any_kind_of_file_generates_again(project: Path, build: Build) -> None:
    for path, old in {
        "tiny/messages/core.yaml": "the first",
        "tiny/examples.yaml": "No page says how.",
        "tiny/captures.yaml": "an invention",
    }.items():
        new = f"Told anew in {Path(path).stem}"
        assert not any(new.encode() in data for data in made(project).values())
        edit(project / "spec" / path, old, new)
        assert build().ran
        assert any(new.encode() in data for data in made(project).values())


@pytest.mark.matrix
@with_both
def test_an_invalid_spec_fails_the_build_until_it_is_corrected(project: Path, build: Build) -> None:
    before = made(project)
    path = project / "spec" / "tiny" / "messages" / "core.yaml"
    right = path.read_text(encoding="utf-8")
    path.write_text(f"{right}twice: 1\ntwice: 2\n", encoding="utf-8")
    for _ in range(2):  # the error does not go away
        wrong = build()
        assert (wrong.code != 0, wrong.ran) == (True, False)
        assert "tiny/messages/core.yaml:" in wrong.said
        assert ": SW002 " in wrong.said
        assert made(project) == before
    path.write_text(right.replace("the first", "Mended", 1), encoding="utf-8")
    mended = build()
    assert (mended.code, mended.ran) == (0, True), mended.said
    assert any(b"Mended" in data for data in made(project).values())
    assert not build().ran


@pytest.mark.matrix
def test_added_renamed_and_removed_files_generate_again(project: Path, build: Build) -> None:
    before = set(made(project))
    extra = project / "spec" / "tiny" / "messages" / "more.yaml"
    extra.write_text(MORE, encoding="utf-8")
    added = build()
    assert (added.code, added.ran) == (0, True), added.said
    assert b"class MoreBits" in made(project)["python/stagewire_tiny/flags.py"]
    edit(project / "spec" / "tiny" / "protocol.yaml", "package: stagewire_tiny", "package: other")
    extra.unlink()
    changed = build()
    assert (changed.code, changed.ran) == (0, True), changed.said
    renamed = {name.replace("stagewire_tiny", "other") for name in before}
    assert set(made(project)) == renamed
    assert archived(project) == sorted(renamed)
    assert b"MoreBits" not in made(project)["python/other/flags.py"]
    assert not build().ran


@pytest.mark.matrix
@with_both
def test_changed_templates_and_options_generate_again(
    project: Path, configured: Callable[[str], Build]
) -> None:
    (project / "templates").mkdir()
    template = project / "templates" / "flags.py.j2"
    template.write_text("# {{ package.package }}\n", encoding="utf-8")
    text = blocks("cmake")[0].replace(
        "OUT protocols)", "OUT protocols TEMPLATES templates OPTIONS --target python)"
    )
    build = configured(text)
    assert build().ran
    assert made(project)["python/stagewire_tiny/flags.py"] == b"# stagewire_tiny\n"
    assert not any(name.startswith("c/") for name in made(project))
    template.write_text("# {{ nothing }}\n", encoding="utf-8")
    wrong = build()
    assert wrong.code != 0
    assert "flags.py.j2:1: 'nothing' is undefined" in wrong.said
    template.write_text('{% include "_part" %}', encoding="utf-8")
    (project / "templates" / "_part").write_text("# a part\n", encoding="utf-8")
    assert build().ran
    assert made(project)["python/stagewire_tiny/flags.py"] == b"# a part\n"
    edit(project / "CMakeLists.txt", "--target python", "--target python --target registry")
    assert build().ran
    assert "registry/tiny.json" in made(project)
    assert not build().ran


@pytest.mark.parametrize(
    ("call", "said"),
    [
        ("TARGET protocols OUT protocols", "SPEC is missing"),
        pytest.param(
            *("protocols SPEC spec OUT protocols", "unknown arguments: protocols"),
            marks=pytest.mark.matrix,
        ),
        pytest.param(
            *("TARGET protocols SPEC nowhere OUT protocols", "nowhere is not a folder"),
            marks=pytest.mark.matrix,
        ),
    ],
)
def test_an_invalid_call_is_explained(project: Path, run: Run, call: str, said: str) -> None:
    text = blocks("cmake")[0]
    before, name, _ = text.partition("stagewire_generate(")
    (project / "CMakeLists.txt").write_text(f"{before}{name}{call})\n", encoding="utf-8")
    done = run("cmake", "-G", "Ninja", "-S", ".", "-B", "build")
    assert done.returncode != 0
    assert said in done.stdout
