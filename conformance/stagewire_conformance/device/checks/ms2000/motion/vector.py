"""Movement at a speed, without a target (section 25)."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.motion.mover import Mover, Sample, motion_check
from stagewire_conformance.device.checks.ms2000.motion.stops import stop
from stagewire_conformance.device.trial import EnoughError
from stagewire_ms2000 import messages as m

_SLOWEST: Final = 20
"""µm/s of the slowest movement that tells anything."""
_CRUISE: Final = 0.2
"""Seconds at the speed that was asked for."""
_BRAKE: Final = 0.25
"""Seconds at top speed that are left to the end of the range when the axis is stopped at the latest: it is
half as fast, and has not quite half a second to stand."""
_OFF: Final = 0.05
"""The part of a speed by which the one that is told may differ."""
_FASTEST: Final = 65_535
"""µm/s that a controller may take a speed for that is meant to be negative."""
_GLANCE: Final = 0.1
"""Seconds in which the way is seen that an axis goes."""


KIND: Final = Kind(
    name="move-vector",
    title="A vector speed is kept until something else is told",
    rules=("vector-speed-runs", "vector-speed-no-reply", "current-speed-reply", "status-busy"),
)


_MESSAGES: Final = ("WRITE_VECTOR_SPEED", "STOP_MOTOR", "START_MOTOR")


@motion_check(
    KIND,
    "{axis} goes at the speed that it is told, until it is told otherwise",
    messages=_MESSAGES,
    seconds=1.5,
)
def _runs(mover: Mover) -> None:
    """Move up at a speed, see that it is kept, ask for the speed 0, and stop."""
    mover.ready()
    trial, line = mover.trial, mover.line
    ramp = mover.ramp_time / 1000
    _make_room(mover)
    room = mover.high - mover.position - mover.counts_in(_BRAKE)
    speed = min(mover.top_speed // 2, int(room / mover.counts_in(3 * (ramp + _CRUISE), 1)))
    if speed < _SLOWEST:
        trial.inconclusive(f"{mover.low}..{mover.high} leaves too little way for a speed")
        raise EnoughError
    what = f"axis {mover.name}, told to go at {speed} µm/s"
    brake = mover.high - mover.counts_in(_BRAKE)
    mover.begin(m.WriteVectorSpeed(speed))
    try:
        end = line.now + 2 * ramp + _CRUISE
        reached = mover.follow(
            what,
            room,
            until=lambda at: _is(at.speed, speed) or at.time > end or at.position > brake,
        )[-1]
        trial.need(
            reached.busy,
            f"{what}, is not busy at {reached.position}; it goes on until told otherwise",
        )
        trial.need(
            _is(reached.speed, speed),
            f"{what}, goes at {reached.speed} µm/s after {line.now - end + 2 * ramp + _CRUISE:.2f} s",
        )
        end = line.now + _CRUISE
        last = mover.follow(what, room, until=lambda at: at.time > end or at.position > brake)[-1]
        _judge_cruise(mover, what, speed, reached, last)
        line.send(m.WriteVectorSpeed(0), mover.address)
        end = line.now + ramp + _CRUISE
        ended = mover.follow("told to go at 0 µm/s", room, until=lambda at: at.time > end)[-1]
        trial.info(f"a vector speed of 0 {'goes on' if ended.speed else 'ends the movement'}")
    finally:
        stop(mover)
    mover.silent(m.WriteVectorSpeed(speed))


def _judge_cruise(mover: Mover, what: str, speed: int, first: Sample, last: Sample) -> None:
    trial = mover.trial
    trial.must(
        last.busy, f"{what}, is not busy at {last.position}; it goes on until told otherwise"
    )
    seconds = last.time - first.time
    way, due = last.position - first.position, mover.counts_in(seconds, speed)
    trial.must(
        due / 2 <= way <= 2 * due,
        f"{what}, went {way} counts in {seconds:.3f} s; that makes {due}",
    )
    trial.must(
        bool(last.status.motor_signal),
        f"{what}, tells the status byte {int(last.status):#04x}, without bit 0: it does not move",
        came=bytes((int(last.status),)),
    )


def _is(found: int, speed: int) -> bool:
    return abs(found - speed) <= max(2, _OFF * speed)


def _make_room(mover: Mover) -> None:
    """Go to the lower part of the range, unless the axis is there: the document has no way to go down."""
    middle = (mover.low + mover.high) // 2
    if mover.start > middle:
        mover.go(mover.goal(upwards=False))


@motion_check(
    KIND,
    "{axis} takes a speed of 32768 and more in one way or the other",
    messages=_MESSAGES,
    name="sign",
    seconds=0.5,
)
def _sign(mover: Mover) -> None:
    """See which way an axis goes at a speed whose highest bit is set: the document leaves its sign open.

    It is either slow and down, or the fastest of all and up, unless the top speed holds it back. So it is
    done only where there is way for either.
    """
    mover.ready()
    trial, line = mover.trial, mover.line
    needed = mover.counts_in(2 * _GLANCE, _FASTEST)
    if min(mover.high - mover.start, mover.start - mover.low) < needed:
        trial.inconclusive(
            f"not tried: at {_FASTEST} µm/s, what may be a slow speed downwards needs {needed} counts in "
            f"both directions, and axis {mover.name} stands at {mover.start} in {mover.low}..{mover.high}"
        )
        return
    slow = max(_SLOWEST, mover.top_speed // 10)
    # The class refuses such values, since they mean two things; which of them, is to be seen here.
    speed = m.WriteVectorSpeed.unpack(_bytes_of(mover, (-slow) % 0x10000))
    line.send(speed, mover.address)
    try:
        end = line.now + _GLANCE
        seen = mover.follow("at a speed of unknown sign", needed, until=lambda at: at.time > end)
    finally:
        stop(mover)
    way = seen[-1].position - mover.start
    if way < 0:
        trial.info("a vector speed has a sign: 32768 and more go down")
    elif way > 0:
        trial.info("a vector speed has no sign: 32768 and more go up")
    else:
        trial.info("a vector speed of 32768 and more is ignored")


def _bytes_of(mover: Mover, speed: int) -> bytes:
    """Return the bytes of WRITE_VECTOR_SPEED with a speed of any 16 bits."""
    command = bytearray(m.WriteVectorSpeed(0).pack(mover.address))
    command[3:5] = speed.to_bytes(2, "little")
    return bytes(command)
