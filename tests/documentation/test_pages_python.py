"""Every Python block of the documentation runs and prints the output in its comments; ``…`` matches any text.

Blocks are independent, unless the document says that one continues the block before it. Test functions are
called with the fixtures that they request, as pytest would.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from block_runners import here

from markdown_blocks import Block, said

SESSION = """\
# stagewire capture 1 protocol=thorlabs_apt unit=TDC001
0.000000 > 11 02 01 00 50 01
0.001000 < 12 02 01 01 01 50
"""


def replaying(folder: Path) -> dict[str, Any]:
    """Write a recorded session, and return the driver that was recorded."""
    (folder / "session.txt").write_text(SESSION)

    def the_driver(controller: Any) -> None:
        controller.write(bytes.fromhex("11 02 01 00 50 01"))

    return {"my_driver_does_what_the_user_did": the_driver}


GIVEN: dict[str, Callable[[Path], dict[str, Any]]] = {"docs/how-to/virtual.md": replaying}
"""Files and names that the blocks of a document expect."""


def programs() -> Iterator[Any]:
    """Yield each program of the documentation: a block, and the blocks that continue it."""
    found: list[tuple[str, list[Block]]] = []
    for document, block in here("python"):
        if block.goes_on:
            assert found, f"{document}, line {block.line}: no block to continue"
            assert found[-1][0] == document, f"{document}, line {block.line}: no block to continue"
            found[-1][1].append(block)
        else:
            found.append((document, [block]))
    for document, program in found:
        yield pytest.param(document, program, id=f"{document}:{program[0].line}")


@pytest.mark.parametrize(("document", "program"), list(programs()))
def test_a_program_runs_and_prints_the_output_in_its_comments(
    document: str,
    program: list[Block],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    request: pytest.FixtureRequest,
) -> None:
    if sys.platform == "win32" and any(".pty(" in block.text for block in program):
        pytest.skip("requires pseudo-terminals")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "__main__"}
    if document in GIVEN:
        names |= GIVEN[document](tmp_path)
    for block in program:
        # Add blank lines before the block, so that tracebacks show the line numbers of the document.
        exec(compile("\n" * block.line + block.text, document, "exec"), names)
    printed = capsys.readouterr().out.splitlines()
    lines = iter(printed)
    for expected in (line for block in program for line in said(block)):
        pattern = re.escape(expected).replace("…", ".*")
        assert any(re.fullmatch(pattern, line.strip()) for line in lines), (expected, printed)
    for name, test in list(names.items()):
        if name.startswith("test_"):
            given = [
                request.getfixturevalue(wanted) for wanted in inspect.signature(test).parameters
            ]
            test(*given)


def test_at_least_two_documents_have_programs() -> None:
    assert len({document for document, _ in here("python")}) >= 2
