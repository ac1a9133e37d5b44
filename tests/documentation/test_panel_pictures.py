"""The pictures of ``stagewire panel`` show what the panel shows now."""

from __future__ import annotations

import importlib.util
import re
import sys
from types import ModuleType

import pytest

from checkout import ROOT

NAMES = sorted(path.name for path in (ROOT / "docs/images").glob("panel*.svg"))


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location(
        "panel_pictures", ROOT / "tools" / "panel_pictures.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, spec.name, module)  # dataclasses look there
        spec.loader.exec_module(module)
    return module


def text_of(svg: str) -> list[str]:
    """The texts of a picture; their positions and styles depend on the version of Textual."""
    return [text for text in re.findall(r"<text[^>]*>([^<]*)</text>", svg) if text.strip()]


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_shows_the_text_of_the_panel(tool: ModuleType, name: str) -> None:
    assert text_of(tool.svg(tool.PICTURES[name])) == text_of(
        (ROOT / "docs/images" / name).read_text("utf-8")
    ), "run python tools/panel_pictures.py"


def test_every_picture_is_stored(tool: ModuleType) -> None:
    assert sorted(tool.PICTURES) == NAMES
