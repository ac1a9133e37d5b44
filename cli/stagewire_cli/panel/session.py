"""One run of ``stagewire panel``: open the lines, show the screen, and stop all axes at the end."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field
from queue import SimpleQueue
from types import FrameType
from typing import Any, Final

import typer

from stagewire.errors import ReplyTimeoutError, StagewireError
from stagewire_cli.devices import opened, parts_of, title_of, travel_options
from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.panel.axis import MOTION_TIMEOUT, Axis
from stagewire_cli.panel.stops import Stops
from stagewire_cli.signals import handled

_MISSING: Final = "panel requires textual; install it with pip install 'stagewire[panel]'"
_NO_TERMINAL: Final = (
    "panel needs a terminal for its keys and its screen; without one, use stagewire monitor, move "
    "or stop"
)
_PATIENCE: Final = 2.0
"""Seconds to wait at the end for the answers to the stops."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line to open.

    :param unit: name of the unit; None detects it.
    :param bay: bay of a module in its rack.
    :param options: other options of ``open``; None means not given.
    """

    url: str
    unit: str | None = None
    bay: int | None = None
    options: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def each(cls, urls: Sequence[str], **given: Sequence[Any] | None) -> list[Line]:
        """Return the lines for URLs and options, each given once for all URLs, or once for each.

        Raises :class:`CalledWronglyError` for another number of values.
        """
        spread: dict[str, Sequence[Any]] = {}
        for name, values in given.items():
            found = tuple(values or (None,))
            if len(found) not in (1, len(urls)):
                raise CalledWronglyError(
                    f"--{name.replace('_', '-')} is given {len(found)} times for {len(urls)} URLs; give it "
                    "once for all of them, or once for each in their order"
                )
            spread[name] = found * len(urls) if len(found) == 1 else found
        lines = []
        for index, url in enumerate(urls):
            own = {name: values[index] for name, values in spread.items()}
            travel = travel_options(own.pop("travel", None))
            lines.append(cls(url, own.pop("unit", None), own.pop("bay", None), {**own, **travel}))
        return lines


def run(lines: Sequence[Line]) -> None:
    """Open the lines and show the panel until it is quit.

    Raises :class:`CalledWronglyError` without a terminal or Textual, and for a controller without an axis
    that can be stopped, and :class:`~stagewire.errors.StagewireError` for a line that cannot be opened.
    """
    if not all(stream.isatty() for stream in (sys.stdin, sys.stdout, sys.stderr)):
        raise CalledWronglyError(_NO_TERMINAL)
    try:
        from stagewire_cli.panel.app import PanelApp
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "textual":
            raise
        raise CalledWronglyError(_MISSING) from None
    with opened_axes(lines) as (axes, stops, left_out):
        app = PanelApp(axes, stops, left_out)
        with _ended_by_signals(stops, app.quit_soon) as received:
            app.run()
    for axis in axes:
        typer.echo(f"{axis.name}: {_outcome(axis)}")
    if received:
        raise typer.Exit(128 + received[0])
    if app.return_code:
        raise typer.Exit(WRONG)


@contextmanager
def opened_axes(
    lines: Sequence[Line],
) -> Iterator[tuple[list[Axis], Stops, list[str]]]:
    """Open the lines for a block; yield their axes, the stop of all, and the parts that do not answer.

    At the end, however the block ends, a stop is sent to every axis before the lines are closed.
    """
    with ExitStack() as stack:
        axes: list[Axis] = []
        left_out: list[str] = []
        for line in lines:
            device = stack.enter_context(
                opened(
                    line.url,
                    line.unit,
                    bay=line.bay,
                    motion_timeout=MOTION_TIMEOUT,
                    **line.options,
                )
            )
            found, silent = axes_of(device, line.url)
            axes += found
            left_out += silent
        stops = Stops(axes)
        try:
            for axis in axes:
                axis.start()
            yield axes, stops, left_out
        finally:
            stops.close(_PATIENCE)
            for axis in axes:
                axis.close(_PATIENCE)


def axes_of(device: Any, url: str) -> tuple[list[Axis], list[str]]:
    """Return the axes of a controller, and the names of those that do not answer, such as empty bays."""
    title = title_of(device).replace(", serial number", "")
    found: list[Axis] = []
    silent: list[str] = []
    error: StagewireError | None = None
    for name, part in parts_of(device).items():
        label = f"{title} {name}".strip()
        if not (hasattr(part, "stop") and hasattr(part, "start_move_absolute")):
            continue
        try:
            found.append(Axis(label, part))
        except ReplyTimeoutError as problem:
            silent.append(label)
            error = problem
    if error is not None and not found:
        raise error
    if not found:
        raise CalledWronglyError(
            f"{url}: a {device.unit.name} has no axis that can be moved to a position and stopped"
        )
    return found, silent


@contextmanager
def _ended_by_signals(stops: Stops, end: Callable[[], None]) -> Iterator[list[int]]:
    """Let signals stop all axes and end the panel in a block; yield the list of those received.

    The handler only puts orders into queues: it may have interrupted a call of a session, which it could not
    call. If the screen does not end, as when its terminal is gone, the process ends after the stops.
    """
    received: list[int] = []
    numbers: SimpleQueue[int | None] = SimpleQueue()
    over = threading.Event()

    def handle(number: int, frame: FrameType | None) -> None:
        received.append(number)
        stops.order()
        numbers.put(number)
        end()

    def force() -> None:
        number = numbers.get()
        if number is not None and not over.wait(_PATIENCE):
            stops.close(_PATIENCE)
            os._exit(128 + number)

    threading.Thread(target=force, name="panel signals", daemon=True).start()

    in_main = threading.current_thread() is threading.main_thread()
    with handled(handle) if in_main else nullcontext():
        try:
            yield received
        finally:
            over.set()
            numbers.put(None)


def _outcome(axis: Axis) -> str:
    view = axis.view
    if view.lost:
        return "the line was lost; it may still move"
    return f"at {axis.place()}{'; it may still move' if view.moving else ''}"
