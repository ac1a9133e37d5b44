"""Units with a few positions, such as filter flippers: read the position, and move to one."""

from __future__ import annotations

from typing import Final

from stagewire._devices.arguments import number_of
from stagewire._devices.asynchronous.calls import change, look, query, send_starting
from stagewire._devices.asynchronous.transport import Endpoint
from stagewire._devices.endpoint import Deadline
from stagewire._devices.motions import Running
from stagewire._devices.unit import Positions
from stagewire.errors import BadValueError, MotionTimeoutError, OutOfRangeError, ReplyTimeoutError

_POLL: Final = 0.05
"""Seconds between two requests for the position."""
_MARGIN: Final = 2
"""How many times its transit time a move may take, in addition to the timeout of a call."""


async def position_of(endpoint: Endpoint) -> int | None:
    """Return the reported position, counted from 1; None if the unit reports none, as while it moves."""
    number = await _read(endpoint, _positions(endpoint), endpoint.seconds(None))
    motions = endpoint.connection.motions
    running = motions.at(endpoint.place)
    if number is not None and running is not None and not running.just_begun(endpoint.now()):
        motions.over(endpoint.place, running)  # such as a move that took longer than its timeout
    return number


async def move_to(endpoint: Endpoint, position: object, timeout: float | None) -> None:
    """Move to a position and wait until it is reported; send no move if it is reported already."""
    positions = _positions(endpoint)
    what = f"{endpoint.name}: move_to"
    number = _checked(what, positions, position)
    if await position_of(endpoint) == number:
        return
    seconds = endpoint.seconds(None)
    if timeout is None:
        milliseconds = await transit_time(endpoint)
        seconds += _MARGIN * milliseconds / 1000
        limit = f"{seconds:.3g} s (transit time {milliseconds} ms)"
    else:
        seconds = endpoint.seconds(timeout)
        limit = f"{seconds:.3g} s"
    deadline = endpoint.deadline(seconds)
    running = Running(f"{what}({number})", b"", endpoint.now())
    value, _ = positions.places[number - 1]
    message = endpoint.message(positions.move.message, {positions.argument: value})
    await send_starting(endpoint, positions.move, message, running, endpoint.part_of(deadline))
    await _reached(endpoint, positions, number, deadline, limit, running)
    endpoint.connection.motions.over(endpoint.place, running)


async def transit_time(endpoint: Endpoint) -> int:
    """Return the time of a move in ms."""
    positions = _positions(endpoint)
    milliseconds: int = getattr(
        (await query(endpoint, positions.times, None, {})).message, positions.time
    )
    return milliseconds


async def set_transit_time(endpoint: Endpoint, milliseconds: object, timeout: float | None) -> None:
    """Set the time of a move in ms, and the same time in counts of the unit."""
    positions = _positions(endpoint)
    number = number_of(None, milliseconds)
    [entry] = [entry for entry in positions.times.given if entry.field == positions.time]
    assert entry.minimum is not None  # the document limits it
    assert entry.maximum is not None
    if number is None or not entry.minimum <= number <= entry.maximum:
        error = BadValueError if number is None else OutOfRangeError
        raise error(
            f"{endpoint.name}: transit time must be a whole number of ms from {entry.minimum} to "
            f"{entry.maximum}, not {milliseconds!r}"
        )
    given = {positions.time: number, positions.counts: positions.counts_of(number)}
    await change(endpoint, positions.times, timeout, given)


async def _reached(
    endpoint: Endpoint,
    positions: Positions,
    number: int,
    deadline: Deadline,
    limit: str,
    running: Running,
) -> None:
    """Wait until a position is reported."""
    found: int | None = None
    while not deadline.over:
        await endpoint.transport.pause(min(_POLL, deadline.left))
        try:
            found = await _read(endpoint, positions, endpoint.part_of(deadline))
        except ReplyTimeoutError:  # a lost reply does not end the motion
            continue
        if found == number:
            return
    shown = "no position" if found is None else f"position {found}"
    raise MotionTimeoutError(
        f"{running.what}: position {number} was not reported within {limit}; the unit reports {shown}. It "
        "cannot be stopped, and may still move"
    )


async def _read(endpoint: Endpoint, positions: Positions, seconds: float) -> int | None:
    return positions.number_in((await look(endpoint, positions.read, seconds)).message)


def _checked(what: str, positions: Positions, position: object) -> int:
    number = number_of(None, position)
    count = len(positions.places)
    if number is None or not 1 <= number <= count:
        known = ", ".join(str(n) for n in range(1, count + 1))
        error = BadValueError if number is None else OutOfRangeError
        raise error(f"{what}: position {position!r} is not one of {known}")
    return number


def _positions(endpoint: Endpoint) -> Positions:
    positions = endpoint.connection.unit.positions
    assert positions is not None  # only units with positions have these calls
    return positions
