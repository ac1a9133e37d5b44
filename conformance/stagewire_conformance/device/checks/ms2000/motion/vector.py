"""Motion at a speed, without a target (section 25)."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.motion.mover import (
    SPEED_REPLY,
    Mover,
    Sample,
    motion_check,
)
from stagewire_conformance.device.checks.ms2000.motion.stops import IGNORED, stop
from stagewire_conformance.device.trial import EnoughError
from stagewire_ms2000 import messages as m

_SLOWEST: Final = 20
"""The lowest speed that can be judged, in µm/s."""
_CRUISE: Final = 0.6
"""Seconds of motion at the commanded speed."""
_BRAKE: Final = 0.25
"""Seconds at top speed that remain to the end of the range when the axis is stopped at the latest.

It moves at half that speed, and has almost half a second to come to rest.
"""
_OFF: Final = 0.05
"""The relative tolerance of a reported speed."""
_CHANGED: Final = 0.3
"""Seconds after a ramp in which an axis has certainly reached its speed."""
_NEAR: Final = 0.15
"""The relative tolerance of a measured speed."""
_FASTEST: Final = 65_535
"""The speed in µm/s that a controller may read instead of a negative one."""
_GLANCE: Final = 0.1
"""Seconds within which the direction of motion shows."""


KIND: Final = Kind(
    name="move-vector",
    title="A vector speed is kept until the next command",
    rules=("vector-speed-runs", "vector-speed-no-reply", "current-speed-reply", "status-busy"),
)


_MESSAGES: Final = ("WRITE_VECTOR_SPEED", "STOP_MOTOR", "START_MOTOR")


@motion_check(
    KIND,
    "{axis} moves at the commanded speed until the next command",
    messages=_MESSAGES,
    seconds=2.9,
)
def _runs(mover: Mover) -> None:
    """Move up at a speed, check that it is kept, set the speed 0, and stop."""
    mover.trial.depends_on(IGNORED)
    mover.ready()
    trial, line = mover.trial, mover.line
    ramp = mover.ramp_time / 1000
    make_room(mover)
    room = mover.high - mover.position - mover.counts_in(_BRAKE)
    speed = speed_for(mover)
    if speed < _SLOWEST:
        trial.inconclusive(f"{mover.low}..{mover.high} leaves too little room for a speed")
        raise EnoughError
    what = f"axis {mover.name}, commanded to move at {speed} µm/s"
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
            f"{what}, is not busy at {reached.position}; it should keep moving until the next command",
            rule="vector-speed-runs",
            cause=Cause("WRITE_VECTOR_SPEED", EFFECT),
        )
        trial.need(
            _is(reached.speed, speed),
            f"{what}, moves at {reached.speed} µm/s after "
            f"{line.now - end + 2 * ramp + _CRUISE:.2f} s; it should have reached its speed",
            rule="vector-speed-runs",
            cause=Cause("WRITE_VECTOR_SPEED", EFFECT),
            because=SPEED_REPLY,
        )
        end = line.now + _CRUISE
        last = mover.follow(what, room, until=lambda at: at.time > end or at.position > brake)[-1]
        _judge_cruise(mover, what, speed, reached, last)
        _change(mover, speed)
        line.send(m.WriteVectorSpeed(0), mover.address)
        end = line.now + ramp + _CRUISE
        ended = mover.follow("set to 0 µm/s", room, until=lambda at: at.time > end)[-1]
        trial.info(
            f"a vector speed of 0 {'does not end the motion' if ended.speed else 'ends the motion'}"
        )
    finally:
        stop(mover)
    mover.silent(m.WriteVectorSpeed(speed))


def _judge_cruise(mover: Mover, what: str, speed: int, first: Sample, last: Sample) -> None:
    trial = mover.trial
    trial.need(
        last.busy,
        f"{what}, is not busy at {last.position}; it should keep moving until the next command",
        rule="status-busy" if last.speed else "vector-speed-runs",
        cause=Cause("READ_STATUS", "busy") if last.speed else Cause("WRITE_VECTOR_SPEED", EFFECT),
    )
    seconds = last.time - first.time
    way, due = last.position - first.position, mover.counts_in(seconds, speed)
    trial.must(
        due / 2 <= way <= 2 * due,
        f"{what}, moved {way} counts in {seconds:.3f} s; it should move about {due}",
        rule="vector-speed-runs",
        cause=Cause("WRITE_VECTOR_SPEED", EFFECT),
    )
    trial.must(
        bool(last.status.motor_signal),
        f"{what}, has the status byte {int(last.status):#04x}, without bit 0, which means motion",
        came=bytes((int(last.status),)),
        rule="vector-speed-runs",
        cause=Cause("status byte", "motion"),
    )


def speed_for(mover: Mover) -> int:
    """Return a speed for which an axis has enough room to go up; 0 or less if it has none."""
    room = mover.high - mover.position - mover.counts_in(_BRAKE)
    seconds = 3 * (mover.ramp_time / 1000 + _CRUISE)
    return min(mover.top_speed // 2, int(room / mover.counts_in(seconds, 1)))


def follow_to_speed(mover: Mover, speed: int) -> Sample:
    """Follow an axis until it has reached a speed, or should have; return its last values."""
    brake = mover.high - mover.counts_in(_BRAKE)
    end = mover.line.now + mover.ramp_time / 1000 + _CHANGED
    return mover.follow(
        f"at a vector speed of {speed} µm/s",
        mover.high - mover.position,
        until=lambda at: _is(at.speed, speed) or at.time > end or at.position > brake,
    )[-1]


def is_near(found: float, due: float) -> bool:
    """Return whether a measured speed is about the due one."""
    return abs(found - due) <= _NEAR * due


def _change(mover: Mover, speed: int) -> None:
    """Command another speed on the way, which replaces the first one."""
    half = speed // 2
    mover.line.send(m.WriteVectorSpeed(half), mover.address)
    now = follow_to_speed(mover, half)
    mover.trial.must(
        _is(now.speed, half) or now.position > mover.high - mover.counts_in(_BRAKE),
        f"axis {mover.name}, moving at {speed} µm/s, was commanded to move at {half} µm/s, but moves at "
        f"{now.speed} µm/s; the last speed should apply",
        rule="vector-speed-runs",
        cause=Cause("WRITE_VECTOR_SPEED", "on the way"),
        because=(*SPEED_REPLY, Cause("WRITE_VECTOR_SPEED", EFFECT)),
    )


def _is(found: int, speed: int) -> bool:
    return abs(found - speed) <= max(2, _OFF * speed)


def make_room(mover: Mover) -> None:
    """Go to the lower part of the range, unless the axis is there: the document has no way to move down."""
    middle = (mover.low + mover.high) // 2
    if mover.start > middle:
        mover.go(mover.goal(upwards=False))


@motion_check(
    KIND,
    "{axis} interprets a speed of 32768 or more as signed or unsigned",
    messages=_MESSAGES,
    name="sign",
    seconds=0.5,
)
def _sign(mover: Mover) -> None:
    """Find the direction of a speed whose highest bit is set: the document leaves its sign open.

    The axis moves either down slowly or up at the highest speed, limited only by the top speed. So this is
    done only if there is room for both.
    """
    mover.trial.depends_on(IGNORED)
    mover.ready()
    trial, line = mover.trial, mover.line
    needed = mover.counts_in(2 * _GLANCE, _FASTEST)
    if min(mover.high - mover.start, mover.start - mover.low) < needed:
        trial.inconclusive(
            f"not tried: at {_FASTEST} µm/s, a speed that may also be a slow one downwards "
            f"needs {needed} counts in both directions, but axis {mover.name} is at "
            f"{mover.start} in {mover.low}..{mover.high}"
        )
        return
    slow = max(_SLOWEST, mover.top_speed // 10)
    # The class refuses such values because they are ambiguous, which is tested here.
    speed = m.WriteVectorSpeed.unpack(_bytes_of(mover, (-slow) % 0x10000))
    line.send(speed, mover.address)
    try:
        end = line.now + _GLANCE
        seen = mover.follow("at a speed of unknown sign", needed, until=lambda at: at.time > end)
    finally:
        stop(mover)
    way = seen[-1].position - mover.start
    if way < 0:
        trial.info("a vector speed is signed: 32768 or more moves down")
    elif way > 0:
        trial.must(
            seen[-1].speed % 0x10000
            > 2 * slow,  # above 32767 µm/s, the reply has the highest bit set
            f"axis {mover.name}, at a vector speed of {-slow % 0x10000}, moves up at {seen[-1].speed} "
            f"µm/s; it should move down at {slow} µm/s if the speed is signed, and otherwise up much faster",
            rule="vector-speed-runs",
            cause=Cause("WRITE_VECTOR_SPEED", "sign"),
        )
        trial.info("a vector speed is unsigned: 32768 or more moves up")
    else:
        trial.info("a vector speed of 32768 or more is ignored")


def _bytes_of(mover: Mover, speed: int) -> bytes:
    """Return the bytes of WRITE_VECTOR_SPEED with any speed of 16 bits."""
    command = bytearray(m.WriteVectorSpeed(0).pack(mover.address))
    command[3:5] = speed.to_bytes(2, "little")
    return bytes(command)
