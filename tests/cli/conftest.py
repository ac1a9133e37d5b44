"""A fixture that runs the command in this process and returns its output and exit code."""

from __future__ import annotations

import io
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from quick_command import quick_command
from stagewire_cli import output
from stagewire_cli.main import main


@dataclass(frozen=True)
class Result:
    code: int
    out: str
    err: str


Stagewire = Callable[..., Result]


@pytest.fixture
def stagewire(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Stagewire:
    """Return a function that runs the command with arguments and standard input, without progress."""
    monkeypatch.setattr(output, "_PATIENCE", math.inf)  # on a busy machine every command is slow

    def run(*arguments: object, input: bytes = b"") -> Result:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(input), encoding="utf-8"))
        with quick_command():
            code = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err + captured.out
        return Result(code, captured.out, captured.err)

    return run
