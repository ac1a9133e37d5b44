"""Prose is wrapped as ``textwrap`` does if it breaks lines only at spaces."""

from __future__ import annotations

import textwrap

from hypothesis import given
from hypothesis import strategies as st

from stagewire_generator.targets.templates import wrapped

WORDS = st.lists(st.text("ab-µ.", min_size=1, max_size=14), max_size=30)


@given(WORDS, st.integers(1, 40), st.integers(0, 6))
def test_lines_equal_those_of_textwrap(words: list[str], width: int, hanging: int) -> None:
    text = " ".join(words)
    lines = textwrap.wrap(
        text,
        width,
        subsequent_indent=" " * hanging,
        break_long_words=False,
        break_on_hyphens=False,
    )
    assert wrapped(text, width, hanging) == lines


@given(WORDS, st.integers(1, 40))
def test_all_white_space_counts_as_a_space(words: list[str], width: int) -> None:
    assert wrapped("\n ".join(["", *words, ""]), width) == wrapped(" ".join(words), width)
