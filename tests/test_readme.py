"""The README's Python blocks run and print what they say."""

from __future__ import annotations

import io
import re
from contextlib import redirect_stdout
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"
BLOCKS = re.findall(r"^```python\n(.*?)^```", README.read_text(encoding="utf-8"), re.M | re.S)


@pytest.mark.parametrize("block", BLOCKS)
def test_a_block_runs_and_prints_what_it_says(block: str) -> None:
    printed = io.StringIO()
    with redirect_stdout(printed):
        exec(compile(block, "README.md", "exec"), {})
    for said in re.findall(r"print\(.*\) +# (.*)$", block, re.M):
        assert said in printed.getvalue()


def test_there_are_blocks() -> None:
    assert len(BLOCKS) >= 2
