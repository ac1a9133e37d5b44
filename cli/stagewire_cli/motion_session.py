"""One run of ``stagewire move``, ``home``, ``jog`` or ``stop``: open, confirm, move, wait, stop on Ctrl-C."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import typer

from stagewire.errors import (
    ControllerFaultError,
    LinkOpenError,
    MotionTimeoutError,
    ReplyTimeoutError,
    StagewireError,
    TargetNotReachedError,
    UnsupportedError,
)
from stagewire_cli.channels import after_enabling, enabling, jog_step
from stagewire_cli.devices import (
    called_wrongly,
    opened,
    parts_of,
    title_of,
)
from stagewire_cli.errors import INTERRUPTED, WRONG, CalledWronglyError
from stagewire_cli.output import Progress, progress
from stagewire_cli.recordings import RecordFiles, recorded
from stagewire_cli.status import Value, in_words, numbers_of, status_of
from stagewire_cli.target import Target

_PIECE = 0.25  # seconds
_GIVEN_UNIT = re.compile("[a-z]")
_STOP_TIMEOUT = 10.0  # seconds in which a stopped stage must come to rest
_ENABLE = (
    "; a stop disables the motor: enable it with start_motor() of the library, then move again"
)
_OTHERWISE = {
    "start_move_relative": ("start_move_absolute", "--to"),
    "start_move_absolute": ("start_move_relative", "--by"),
}
"""Methods that can replace one that a unit lacks, with their options."""


@dataclass(frozen=True, slots=True)
class PartAddress:
    """The address of a moving part: a line, and the part of its controller."""

    url: str
    unit: str | None
    bay: int | None
    channel: int | None
    axis: str | None

    def part(self, device: Any) -> tuple[str, Any]:
        """Return the name of the addressed part, and the part.

        Raises :class:`CalledWronglyError` for an unknown part, and if one of several parts must be named.
        """
        parts = self.parts(device)
        if len(parts) > 1:
            raise CalledWronglyError(
                f"{device.unit.name} has {', '.join(parts)}; choose one with --bay, --channel or --axis"
            )
        [(name, part)] = parts.items()
        return name, part

    def parts(self, device: Any) -> dict[str, Any]:
        """Return the addressed parts, or all if none is named; raise the same errors as :meth:`part`."""
        parts = parts_of(device)
        bay = None if device.unit.kind == "bay" else self.bay  # a module was opened by its bay
        named = [("bay", bay), ("channel", self.channel), ("axis", self.axis and self.axis.upper())]
        words = [f"{kind} {value}" for kind, value in named if value is not None]
        if list(parts) == [""] and words == ["channel 1"]:
            return parts
        found = {
            name: part
            for name, part in parts.items()
            if all(f" {word} " in f" {name} " for word in words)
        }
        if not found:
            has = ", ".join(parts) if len(parts) > 1 else "only one channel"
            raise CalledWronglyError(f"{device.unit.name} has no {' '.join(words)}; it has {has}")
        return found


@contextmanager
def _opened_part(
    where: PartAddress, yes: bool, timeout: float, **options: Any
) -> Iterator[tuple[Any, str, Any]]:
    """Open a controller for a motion; yield it with the name of the addressed part and the part."""
    refuse_unattended(yes)
    with opened(
        where.url,
        where.unit,
        bay=where.bay,
        refusals=False,
        motion_timeout=timeout,
        **options,
    ) as device:
        name, part = where.part(device)
        yield device, name, part


def run_move(
    where: PartAddress,
    target: Target,
    options: Mapping[str, Any],
    *,
    timeout: float,
    yes: bool,
    files: RecordFiles,
    enable: bool = False,
) -> None:
    """Move one part, after a confirmation.

    :param options: options of its class; None means not given.
    :param enable: whether to enable its channel first.
    :param files: files to record the motion to.
    """
    with _opened_part(where, yes, timeout, **options) as (device, name, part):
        if device.unit.positions is not None:
            run_positions_move(device, part, target, timeout, yes=yes, files=files)
            return
        start = _call(device, part, f"start_move_{'relative' if target.relative else 'absolute'}")
        given = target.given(start, part, device.unit.name)
        saying = f"will {enabling(enable, device)}move from {_position(part)} {target}"

        def there() -> bool:
            return target.is_met_by(status_of(part))

        goal = _goal(target, given, part)
        begin = after_enabling(enable, device, part, lambda: start(**given))
        _act(device, name, part, saying, begin, timeout, yes, files, there, goal)


def _goal(target: Target, given: Mapping[str, Any], part: Any) -> Value | None:
    """Return where a move is to end; None if the position is unknown."""
    [(unit, value)] = given.items()
    goal = Value(float(value), "" if unit == "counts" else unit)
    if not target.relative:
        return goal
    values = status_of(part)
    here = None if values is None else numbers_of(values).get("position")
    if here is None or here.unit != goal.unit:
        return None
    return Value(here.number + goal.number, goal.unit)


def run_positions_move(
    device: Any, part: Any, target: Target, timeout: float, *, yes: bool, files: RecordFiles
) -> None:
    """Move a unit with a few positions, such as a flipper, to one of them; it cannot be stopped."""
    if target.relative or target.value.denominator != 1 or _GIVEN_UNIT.search(target.text):
        raise CalledWronglyError(f"a {device.unit.name} moves --to one of its positions, such as 1")
    position = int(target.value)
    confirm(title_of(device), f"will move from {_place(part.position)} to position {position}", yes)
    begun = device.session.now()
    try:
        with called_wrongly(), recorded(part, title_of(device), files):
            part.move_to(position, timeout=timeout)
    except KeyboardInterrupt:
        typer.echo(
            f"interrupted: a {device.unit.name} cannot be stopped, and may still move", err=True
        )
        raise typer.Exit(INTERRUPTED) from None
    seconds = device.session.now() - begun
    typer.echo(f"done after {seconds:.2f} s: it is at {_place(part.position)}")


def _place(position: int | None) -> str:
    return "an unknown position" if position is None else f"position {position}"


def run_home(
    where: PartAddress,
    options: Mapping[str, Any],
    *,
    timeout: float,
    yes: bool,
    files: RecordFiles,
    enable: bool = False,
) -> None:
    """Home one part, after a confirmation; the options are as for :func:`run_move`."""
    with _opened_part(where, yes, timeout, **options) as (device, name, part):
        start = _call(device, part, "start_home")
        saying = (
            f"will {enabling(enable, device)}home from {_position(part)} with the settings of the "
            "controller"
        )
        begin = after_enabling(enable, device, part, start)
        _act(device, name, part, saying, begin, timeout, yes, files)


def run_jog(
    where: PartAddress,
    direction: str,
    options: Mapping[str, Any],
    *,
    timeout: float,
    yes: bool,
    files: RecordFiles,
    enable: bool = False,
) -> None:
    """Jog one part, after a confirmation; the options are as for :func:`run_move`."""
    with _opened_part(where, yes, timeout, **options) as (device, name, part):
        start = _call(device, part, "start_jog")
        saying = (
            f"will {enabling(enable, device)}jog {direction} from {_position(part)} by "
            f"{jog_step(device, part, direction, name.rpartition(' ')[2])}"
        )
        begin = after_enabling(enable, device, part, lambda: start(direction))
        _act(device, name, part, saying, begin, timeout, yes, files)


def run_stop(where: PartAddress, address: int | None = None) -> None:
    """Stop everything; send the stops of all parts before waiting for answers."""
    try:
        with opened(
            where.url,
            _unit_to_stop(where),
            bay=where.bay,
            address=address,
            identify=False,
            keeps_outputs=False,
            motion_timeout=_STOP_TIMEOUT,
        ) as device:
            parts = where.parts(device)
            if hasattr(device, "stop") and not all(
                hasattr(part, "stop") for part in parts.values()
            ):
                parts = {"": device}  # its channels are stopped together
            for part in parts.values():
                _call(device, part, "stop")
            with ThreadPoolExecutor(max_workers=len(parts)) as threads:
                ends = [threads.submit(part.stop) for part in parts.values()]
    except LinkOpenError as unopened:
        raise StagewireError(
            f"no stop was sent: {unopened}. If another program has the port, stop the motion there"
        ) from None
    failed = False
    for name, end in zip(parts, ends, strict=True):
        label, error = name or device.unit.name, end.exception()
        if error is None:
            typer.echo(f"{label}: stopped" if end.result() else f"{label}: stop was sent")
        elif isinstance(error, StagewireError):
            failed = True
            typer.echo(f"stagewire: {label}: {error}", err=True)
        else:
            raise error
    if failed:
        raise typer.Exit(WRONG)


def _unit_to_stop(where: PartAddress) -> str:
    """Return the unit to stop; if it is unknown, raise an error that says that nothing was stopped."""
    from stagewire.discovery import unit_at

    if where.unit is not None:
        return where.unit
    try:
        return unit_at(where.url, bay=where.bay)
    except StagewireError as error:
        raise StagewireError(
            f"no stop was sent, because the unit is unknown: {error}. Name it with --unit: then the stop "
            "is sent first"
        ) from None


def refuse_unattended(yes: bool) -> None:
    """Refuse to move without a confirmation, before the line is opened."""
    if not yes and not sys.stdin.isatty():
        raise CalledWronglyError(
            "this moves hardware; without a terminal to ask for confirmation, give --yes"
        )


def _call(device: Any, part: Any, name: str) -> Callable[..., Any]:
    """Return a call of a part; raises :class:`CalledWronglyError` where its unit has none such."""
    try:
        call: Callable[..., Any] = getattr(part, name)
    except AttributeError as error:
        if name == "stop":
            raise CalledWronglyError(f"nothing was sent: {error}") from None
        what = name.removeprefix("start_").replace("_", " ")
        raise CalledWronglyError(
            f"{device.unit.name} does not support {what}: its class has no {name}(){_instead(part, name)}"
        ) from None
    return call


def _instead(part: Any, name: str) -> str:
    """Return what to use instead of a motion that a part does not have."""
    other = _OTHERWISE.get(name)
    if other and hasattr(part, other[0]):
        return f"; give {other[1]} instead"
    starts = [one.removeprefix("start_") for one in dir(part) if one.startswith("start_")]
    motions = [f"{one}()" for one in starts if hasattr(part, one)]
    return f"; in Python, use {' or '.join(motions)}" if motions else ""


def confirm(title: str, saying: str, yes: bool) -> None:
    """Announce a motion and ask; end with exit status 1 without a yes."""
    typer.echo(f"{title}: {saying}")
    if not yes and not _confirmed():
        typer.echo("nothing was moved")
        raise typer.Exit(WRONG)


def _act(
    device: Any,
    name: str,
    part: Any,
    saying: str,
    start: Callable[[], Any],
    timeout: float,
    yes: bool,
    files: RecordFiles,
    there: Callable[[], bool] = lambda: True,
    goal: Value | None = None,
) -> None:
    """Announce a motion, ask, start it, and wait for its end; Ctrl-C stops it.

    :param files: files to record the motion to; they are complete however it ends.
    :param there: returns whether the part is at its target, so that no motion is necessary.
    :param goal: where the motion is to end; None: unknown.
    """
    title = ", ".join(filter(None, (title_of(device), name)))
    if _moves(part):
        typer.echo(
            f"stagewire: {title} is already moving: wait, or stop it with stagewire stop", err=True
        )
        raise typer.Exit(WRONG)
    confirm(title, saying, yes)
    with recorded(part, f"{title}: {saying.removeprefix('will ')}", files, goal):
        _carry_out(device, part, start, timeout, there, goal)


def _carry_out(
    device: Any,
    part: Any,
    start: Callable[[], Any],
    timeout: float,
    there: Callable[[], bool],
    goal: Value | None,
) -> None:
    """Start a motion that was confirmed, and wait for its end; the parameters are those of :func:`_act`."""
    before, missed, end = _position(part), "", None
    try:
        with called_wrongly():
            motion = start()
        with progress() as say:
            end = _end_of(motion, device.session.now, timeout, _watching(part, goal, say))
    except KeyboardInterrupt:
        typer.echo(f"interrupted: {_stopped(part)}", err=True)
        raise typer.Exit(INTERRUPTED) from None
    except MotionTimeoutError as error:
        causes = f"; likely cause: {'; '.join(error.causes)}" if error.causes else ""
        outcome = _stopped(part)
        typer.echo(f"the motion took longer than {timeout:g} s: {outcome}{causes}", err=True)
        raise typer.Exit(WRONG) from None
    except ControllerFaultError:
        typer.echo(f"the controller reported a fault: {_stopped(part)}", err=True)
        raise
    except TargetNotReachedError as error:
        missed = str(error)
    stands = _position(part)
    says_nothing = end is None or end.message is None  # except that the axis is idle
    if says_nothing and stands == before and not there():
        hint = _ENABLE if hasattr(part, "start_motor") else ""
        why = f" ({missed})" if missed else ""
        missed = f"it did not move and is still at {stands}{hint}{why}"
    if missed:
        typer.echo(f"stagewire: {missed}", err=True)
        raise typer.Exit(WRONG)
    assert end is not None
    typer.echo(f"done after {end.seconds:.2f} s: it is at {stands}")


def _moves(part: Any) -> bool:
    """Return whether a part is moving; False if its unit cannot report it."""
    try:
        return bool(part.is_moving())
    except UnsupportedError:
        return False


def _confirmed() -> bool:
    """Ask; Ctrl-C and the end of what is typed mean no."""
    try:
        return typer.confirm("Continue?", default=False)
    except typer.Abort:
        typer.echo()
        return False


def _stopped(part: Any) -> str:
    """Stop a part, and return the result with its position; the stop has its own timeout."""
    try:
        part.stop(timeout=_STOP_TIMEOUT)
        return f"stop was sent; it is at {_position(part)}"
    except ReplyTimeoutError as error:
        return f"stop was sent but not answered, so it may still be moving ({error})"


def _watching(part: Any, goal: Value | None, say: Progress) -> Callable[[], None]:
    """Return a function that shows the position of a moving part on a terminal."""
    target = "" if goal is None else f", target {in_words(goal, '')}"

    def watch() -> None:
        if say.shows:
            with suppress(ReplyTimeoutError):  # the end of the motion shows what is wrong
                say(f"at {_position(part)}{target}")

    return watch


def _end_of(
    motion: Any, now: Callable[[], float], timeout: float, watch: Callable[[], None]
) -> Any:
    """Wait for the end of a motion, in short pieces because Windows handles Ctrl-C only between waits.

    :param watch: called between the pieces.
    """
    deadline = now() + timeout
    while True:
        try:
            return motion.wait(_PIECE)
        except MotionTimeoutError:
            if motion.done or now() > deadline + _PIECE:  # the motion has timed out
                raise
            watch()


def _position(part: Any) -> str:
    """Return the position of a part for people."""
    values = status_of(part)
    position = None if values is None else numbers_of(values).get("position")
    if position is None:
        with suppress(UnsupportedError, AttributeError):
            position = Value(part.position_counts)
    return in_words(position, "an unknown position")
