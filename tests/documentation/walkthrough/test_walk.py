"""A document that shows something else than happens is found out."""

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
LIES = {
    "a line": ("\none\ntwo\n$", "\none\n2\n$"),
    "a line that is left out": ("\none\ntwo\n$", "\none\n$"),
    "a line too many": ("three\n$ echo", "three\nfour\n$ echo"),
    "part of a line": ("a … line", "a … lie"),
    "how it ends": ("exit status 4", "exit status 1"),
    "that it ends well": ("    # exit status 4", ""),
    "a file": ("```text\none", "```text\n1"),
    "what python prints": ("# three", "# 3"),
    "that python prints": ("  # four", ""),
    "no command": ("console\n$ cat", "console\ncat"),
    "a language that nothing runs": ("```python", "```ruby"),
}


def follow(page: str, tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text(page, encoding="utf-8")
    (tmp_path / "reader").mkdir()
    walk = Walk(tmp_path / "reader")
    for block in blocks(tmp_path / "page.md"):
        walk.follow(block)


def test_a_true_document(tmp_path: Path) -> None:
    follow(TRUE, tmp_path)
    assert [block.section for block in blocks(tmp_path / "page.md")] == ["First"] * 3 + ["Second"]


@pytest.mark.parametrize("lie", LIES)
def test_a_lie_is_found_out(lie: str, tmp_path: Path) -> None:
    told = TRUE.replace(*LIES[lie])
    assert told != TRUE
    with pytest.raises(AssertionError, match="line "):
        follow(told, tmp_path)
