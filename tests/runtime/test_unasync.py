"""The half of the library for threads is generated from the half for asyncio."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def unasync() -> ModuleType:
    spec = importlib.util.spec_from_file_location("unasync_tool", ROOT / "tools" / "unasync.py")
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    return tool


def test_the_modules_for_threads_are_up_to_date(unasync: ModuleType) -> None:
    drifted = [str(module.relative_to(ROOT)) for module in unasync.drift()]
    assert not drifted, (
        f"{', '.join(drifted)} differ from the modules generated from the asyncio half; edit that half, "
        f"then run `{unasync.COMMAND}` with {sys.executable}, which has the right version of ruff"
    )


def test_the_modules_for_threads_contain_no_asynchronous_words(unasync: ModuleType) -> None:
    for _, copy in unasync.pairs():
        text = copy.read_text(encoding="utf-8")
        assert text.startswith("# Generated from ")
        assert "do not edit" in text.partition("\n")[0]
        left = re.findall(r"\bawait\b|\basync\b|\bAsync\w*|\basyncio\b|_async\b|\btasks?\b", text)
        assert left == [], copy.name


def test_a_passage_that_does_not_occur_raises_an_error(
    unasync: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, _ = next(unasync.pairs())
    name = source.relative_to(unasync.PACKAGE).as_posix()
    monkeypatch.setitem(unasync.PASSAGES, name, (("no such passage", ""),))
    with pytest.raises(ValueError, match="no such passage"):
        unasync.generated(source)


def test_every_replaced_word_occurs_in_a_source(unasync: ModuleType) -> None:
    texts = [source.read_text(encoding="utf-8") for source, _ in unasync.pairs()]
    unused = [word for word, _ in unasync.WORDS if not any(re.search(word, text) for text in texts)]
    assert unused == []


def test_a_changed_source_and_a_copy_without_a_source_are_reported(
    unasync: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    source = tmp_path / "a" / "one.py"
    source.write_text("async def one() -> None:\n    await two()\n")
    (tmp_path / "b" / "left.py").write_text("")
    monkeypatch.setattr(unasync, "PACKAGE", tmp_path)
    monkeypatch.setattr(unasync, "MODULES", {"a": "b"})
    found = unasync.drift()
    assert found[tmp_path / "b" / "left.py"] is None
    text = found[tmp_path / "b" / "one.py"]
    assert "def one() -> None:\n    two()\n" in text
    (tmp_path / "b" / "one.py").write_text(text)
    (tmp_path / "b" / "left.py").unlink()
    assert not unasync.drift()
    source.write_text("async def one() -> None:\n    await three()\n")
    assert list(unasync.drift()) == [tmp_path / "b" / "one.py"]
