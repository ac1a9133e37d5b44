"""One run of ``stagewire monitor``: show status messages as a table or lines, and draw a picture."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import typer

from stagewire.devices import Values
from stagewire.errors import (
    ReplyTimeoutError,
    SessionClosedError,
    StagewireError,
    TransportError,
)
from stagewire.protocols import Frame, Message
from stagewire_cli.devices import opened, title_of
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.monitor_board import Board
from stagewire_cli.motion_session import PartAddress
from stagewire_cli.status import reading_of, status_of

_REFRESH = 0.2  # seconds between two drawings of the table, and between two polls

Draw = Callable[[float], None]
PartStatus = tuple[str, Values[Any] | None]
"""The name of a part, and its status."""


def watch(
    url: str,
    unit: str | None,
    options: Mapping[str, Any],
    bay: int | None,
    *,
    seconds: float | None,
    picture: Path | None,
    log: Path | None,
    listen: bool = False,
) -> None:
    """Watch a controller until Ctrl-C, or for a time.

    :param options: options of its class that determine scales; None means not given.
    :param bay: the bay of a module in its rack; for a rack, the bay to watch.
    :param picture: file for a picture of the recorded positions; None draws none.
    :param log: file for a capture; None records none.
    :param listen: whether to send nothing, and show what another program receives.

    Raises :class:`CalledWronglyError` for a controller that cannot be watched, and
    :class:`~stagewire.errors.StagewireError` if the line fails; in both cases the picture is still drawn.
    """
    board = Board(track=picture is not None)
    title = url
    try:
        with opened(url, unit, bay=bay, log=log, on_close="leave", **options) as device:
            title = title_of(device)
            with suppress(KeyboardInterrupt), _shown(title, board) as draw:
                parts = PartAddress(url, unit, bay, None, None).parts(device)
                _follow(device, parts, board, draw, seconds, listen=listen)
    finally:
        if picture is not None and board.tracks:
            from stagewire_cli.monitor_board import plot

            plot(picture, title, board.tracks)
    typer.echo(f"{board.count:,} status messages, {board.dropped:,} dropped", err=True)


@contextmanager
def _shown(title: str, board: Board) -> Iterator[Draw]:
    """Yield a function that draws the board as a table on a terminal, or else does nothing."""
    if not sys.stdout.isatty():
        typer.echo(title)
        yield lambda now: None
        return
    from stagewire_cli.screens import MonitorScreen

    with MonitorScreen(title, board) as screen:
        yield screen.draw


def _follow(
    device: Any,
    parts: dict[str, Any],
    board: Board,
    draw: Draw,
    seconds: float | None,
    *,
    listen: bool,
) -> None:
    """Add the statuses of the parts of a controller to the board, for a time or without end."""
    now = device.session.now
    begin = now()
    lines = not sys.stdout.isatty()
    with _statuses(device, parts, board, listen=listen) as statuses:
        for name, values in statuses:
            passed = now() - begin
            if seconds is not None and passed >= seconds:
                draw(passed)
                return
            if values is None:
                draw(passed)
                continue
            reading = reading_of(name, passed, values)
            board.add(reading)
            if lines:
                typer.echo(reading.line())


@contextmanager
def _statuses(
    device: Any, parts: dict[str, Any], board: Board, *, listen: bool
) -> Iterator[Iterator[PartStatus]]:
    """Yield an endless iterator of statuses, with None whenever the table may be drawn."""
    sources = [part for part in parts.values() if hasattr(part, "start_updates")]
    if not sources and hasattr(device, "start_updates"):  # it sends for all its channels
        sources = [device]
    classes = _unsolicited_classes(device)
    sends_none = hasattr(device, "move_to")  # a unit with a few positions has no status update
    if not sources or not classes or sends_none:
        if listen:
            raise CalledWronglyError(
                f"--listen: {device.unit.name} does not send status messages by itself"
            )
        yield _polled(device, parts)
        return
    with ExitStack() as stack:
        subscription = stack.enter_context(device.session.subscribe(classes))
        for source in () if listen else sources:
            source.start_updates()
            stack.callback(_stop_updates, source)
        yield _unsolicited(device, parts, subscription, board)


def _stop_updates(source: Any) -> None:
    with suppress(TransportError, SessionClosedError):  # the line is lost or closed anyway
        source.stop_updates()


def _unsolicited_classes(device: Any) -> tuple[type[Message], ...]:
    """Return the classes of the status messages that a unit sends unsolicited."""
    protocol = device.facts.protocol
    started = {
        name
        for message in protocol.registry()["messages"]
        if message["name"] in device.unit.messages
        for name in message["exchange"].get("starts", ())
    }
    return tuple(
        cls
        for cls in protocol.messages
        if cls.layout.message in started & device.unit.messages and cls.layout.unsolicited
    )


def _unsolicited(
    device: Any, parts: dict[str, Any], subscription: Any, board: Board
) -> Iterator[PartStatus]:
    """Yield unsolicited messages; the board counts those that were dropped."""
    drawn = device.session.now()
    while True:
        try:
            frame = subscription.get(timeout=_REFRESH).frame
        except ReplyTimeoutError:
            pass
        else:
            name = _source_part(device, parts, frame)
            values = parts[name].values(frame.message) if name in parts else None
            if values is not None:
                yield name, values
        board.dropped = subscription.dropped
        if device.session.now() - drawn >= _REFRESH:
            drawn = device.session.now()
            yield "", None


def _source_part(device: Any, parts: dict[str, Any], frame: Frame) -> str:
    """Return the part that a frame comes from; some controllers swap its addresses."""
    words = []
    bays = device.unit.bays if device.unit.kind == "rack" else ()
    for address in (frame.source, frame.dest):
        if address in bays:
            words.append(f"bay {bays.index(address) + 1}")
            break
    channel = getattr(frame.message, device.facts.protocol.channel, None)
    if device.unit.channels > 1:
        words.append(f"channel {channel}")
    name = " ".join(words)
    return name if words or len(parts) > 1 else next(iter(parts))


def _polled(device: Any, parts: dict[str, Any]) -> Iterator[PartStatus]:
    """Poll the parts of a controller that sends no status messages, and yield their answers.

    Axes that do not answer in the first round are assumed to be missing.
    """
    silent: StagewireError | None = None
    for name, part in tuple(parts.items()):
        try:
            values = status_of(part)
        except ReplyTimeoutError as error:
            silent = error
            values = None
        if values is None:
            del parts[name]
            yield "", None
        else:
            yield name, values
    if not parts:
        raise silent or CalledWronglyError(f"{device.unit.name} has no status message")
    while True:
        yield "", None
        device.session.pause(_REFRESH)
        for name, part in parts.items():
            yield name, status_of(part)
