"""A walkthrough fails if the document differs from what happens."""

from __future__ import annotations

from pathlib import Path

import pytest
from walk import Walk

from markdown_blocks import blocks

TRUE = """\
# Title

## First

File `folder/one.txt`, in full:

```text
one
```

In `folder/one.txt`:

```text
two
```

```console
$ cat folder/one.txt
one
two
$ cd folder && export WORD=three
$ cat one.txt; \\
  echo $WORD
…
three
$ echo "a long line"; exit 4    # exit status 4
a … line
```

## Second

```python
import os

print(os.environ["WORD"])  # three
print("".join(["f", "our"]))  # four
```
"""
MISTAKES = {
    "wrong line": ("\none\ntwo\n$", "\none\n2\n$"),
    "missing line": ("\none\ntwo\n$", "\none\n$"),
    "extra line": ("three\n$ echo", "three\nfour\n$ echo"),
    "wrong part of a line": ("a … line", "a … lie"),
    "wrong exit status": ("exit status 4", "exit status 1"),
    "missing exit status": ("    # exit status 4", ""),
    "wrong file": ("```text\none", "```text\n1"),
    "wrong output of python": ("# three", "# 3"),
    "missing output of python": ("  # four", ""),
    "missing command": ("console\n$ cat", "console\ncat"),
    "unsupported language": ("```python", "```ruby"),
}


def follow(page: str, tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text(page, encoding="utf-8")
    (tmp_path / "reader").mkdir()
    walk = Walk(tmp_path / "reader")
    for block in blocks(tmp_path / "page.md"):
        walk.follow(block)


def test_a_correct_document_passes(tmp_path: Path) -> None:
    follow(TRUE, tmp_path)
    assert [block.section for block in blocks(tmp_path / "page.md")] == ["First"] * 3 + ["Second"]


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_the_document_is_detected(mistake: str, tmp_path: Path) -> None:
    page = TRUE.replace(*MISTAKES[mistake])
    assert page != TRUE
    with pytest.raises(AssertionError, match="line "):
        follow(page, tmp_path)
