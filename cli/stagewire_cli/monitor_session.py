"""One run of ``stagewire monitor``: show statuses as a table, lines or JSON, and record them in files."""

from __future__ import annotations

import json
import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import typer

from stagewire_cli.devices import opened, title_of
from stagewire_cli.monitor_board import Board, Row, line_of
from stagewire_cli.motion_session import PartAddress
from stagewire_cli.recordings import RecordFiles, recorded

_REFRESH = 0.2  # seconds between two drawings of the table, and at most between two lines

Show = Callable[[float, list[Row]], None]
"""Shows new rows, at a time in seconds since the monitor began."""


def watch(
    url: str,
    unit: str | None,
    options: Mapping[str, Any],
    bay: int | None,
    *,
    seconds: float | None,
    as_json: bool,
    files: RecordFiles,
    log: Path | None,
    listen: bool = False,
) -> None:
    """Watch a controller until Ctrl-C, or for a time.

    :param options: options of its class that determine scales; None means not given.
    :param bay: the bay of a module in its rack; for a rack, the bay to watch.
    :param as_json: whether to print JSON, one object on each line, and no table.
    :param files: files to record to.
    :param log: file for a capture; None records none.
    :param listen: whether to send nothing, and show what another program receives.

    Raises :class:`CalledWronglyError` for a controller that cannot be watched, and
    :class:`~stagewire.errors.StagewireError` if the line fails; in both cases the files are complete.
    """
    board = Board()
    with opened(url, unit, bay=bay, log=log, on_close="leave", **options) as device:
        part = device
        if bay is not None and device.unit.kind != "bay":
            _, part = PartAddress(url, unit, bay, None, None).part(device)
        title = title_of(device)
        with suppress(KeyboardInterrupt), _shown(title, board, as_json) as show:
            _follow(device, part, title, board, show, seconds, files, listen)
    typer.echo(f"{board.count:,} status messages, {board.dropped:,} dropped", err=True)


def _follow(
    device: Any,
    part: Any,
    title: str,
    board: Board,
    show: Show,
    seconds: float | None,
    files: RecordFiles,
    listen: bool,
) -> None:
    """Show and record the statuses of a part, for a time or without end."""
    rows: deque[Row] = deque()
    now = device.session.now

    def take() -> list[Row]:
        taken = [rows.popleft() for _ in range(len(rows))]
        for row in taken:
            board.add(row)
        return taken

    begin = now()
    with recorded(part, title, files, listen=listen):
        with part.record(rows.append, listen=listen) as recording:
            while (passed := now() - begin) < (seconds or float("inf")) and recording.error is None:
                device.session.pause(
                    _REFRESH if seconds is None else min(_REFRESH, seconds - passed)
                )
                show(now() - begin, take())
                board.dropped = recording.dropped
        show(now() - begin, take())


@contextmanager
def _shown(title: str, board: Board, as_json: bool) -> Iterator[Show]:
    """Yield a function that shows rows: as lines, or as a table on a terminal."""
    if as_json:
        yield lambda now, rows: _print(rows, json.dumps)
    elif not sys.stdout.isatty():
        typer.echo(title)
        yield lambda now, rows: _print(rows, line_of)
    else:
        from stagewire_cli.screens import MonitorScreen

        with MonitorScreen(title, board) as screen:
            yield lambda now, rows: screen.draw(now)


def _print(rows: list[Row], text_of: Callable[[Row], str]) -> None:
    for row in rows:
        print(text_of(row))
    sys.stdout.flush()
