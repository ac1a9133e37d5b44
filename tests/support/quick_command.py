"""Run the command repeatedly in one process, with cached parsers and entry points.

For each call, Typer creates the parsers of all commands, and the command searches all installed packages for
entry points. Both take longer than most commands.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from typing import Any

import pytest
import typer

import stagewire_cli.main

_find = metadata.entry_points


@contextmanager
def quick_command() -> Iterator[None]:
    """Create parsers and search entry points only once until the block ends."""
    with entry_points_once(), pytest.MonkeyPatch.context() as patch:
        parsers = _parsers()
        patch.setattr(stagewire_cli.main, "command", lambda arguments=(): parsers)
        yield


@contextmanager
def entry_points_once() -> Iterator[None]:
    """Search entry points only once for each import path until the block ends."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(metadata, "entry_points", _entry_points)
        yield


@cache
def _parsers() -> Any:
    return typer.main.get_command(stagewire_cli.main.command())


def _entry_points(**wanted: str) -> Any:
    return _found(tuple(sys.path), tuple(sorted(wanted.items())))


@cache
def _found(path: tuple[str, ...], wanted: tuple[tuple[str, str], ...]) -> Any:
    return _find(**dict(wanted))
