"""Every unit with motors: all channels and bays at the same time, with different parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import pytest
from apt_host import Host
from registry_oracle import UNITS, places

from stagewire import Frame, FramedMessage
from stagewire_apt import messages as m
from stagewire_virtual.clock import SECOND
from stagewire_virtual.options import LinkKind
from stagewire_virtual.thorlabs_apt.channel import Settings

MOTORS = sorted(name for name, unit in UNITS.items() if "MOT_MOVE_HOME" in unit["messages"])
STAGE = (Settings(travel=1_000_000, position=500_000),)
CONTINUOUS, STEP = 1, 2
HostOf = Callable[..., Host]
Place = tuple[int, int]  # address and channel


def channels(name: str) -> list[Place]:
    """Return the channels of a unit, each with its first address."""
    kinds = {"alone": [], "motherboard": [], "bay": []}
    for place in places(UNITS[name]):
        kinds[place.kind] += [(place.address, ident) for ident in place.channels]
    return kinds["bay"] or kinds["alone"][: UNITS[name]["channels"]]


def frames_at(far: Host, when: float) -> Iterator[tuple[int, Frame]]:
    """Advance to an instant, and yield the received frames with their instants."""
    while (due := far.clock.next_due) is not None and due <= when:
        far.clock.run_until(due)
        for frame in far.heard():
            yield due, frame
    far.clock.run_until(round(when))


def way(distance: float, velocity: float, acceleration: float, time: float) -> tuple[float, float]:
    """Return the distance of a motion from rest to rest after a time, and its duration."""
    peak = min(velocity, math.sqrt(distance * acceleration))
    ramp = peak / acceleration
    duration = distance / peak + ramp
    up, even, down = min(time, ramp), min(time, duration - ramp), min(time, duration)
    gone = acceleration * up**2 / 2 + peak * max(even - ramp, 0)
    late = max(down - (duration - ramp), 0)
    return gone + peak * late - acceleration * late**2 / 2, duration


def test_there_are_18_units_with_motors() -> None:
    assert len(MOTORS) == 18


@pytest.mark.parametrize("name", MOTORS)
def test_simultaneous_moves_complete_at_their_own_instants(name: str, host: HostOf) -> None:
    far = host(name, channels=STAGE)
    moves = {}
    for index, (address, ident) in enumerate(channels(name)):
        velocity, acceleration = 50_000 + 777 * index, 200_000 + 900 * index
        distance = (25_000 + 4_000 * index) * (-1) ** index
        far.say(m.MotSetVelParams(ident, 0, acceleration, velocity), address)
        moves[address, ident] = (distance, velocity, acceleration)
    for (address, ident), (distance, _, _) in moves.items():
        far.say(m.MotMoveAbsolute(ident, distance), address)
    ends = []
    for step in range(1, 110):
        ends += frames_at(far, step * SECOND / 100)
        for (address, ident), (distance, *pace) in moves.items():
            [counter] = far.ask(m.MotReqPosCounter(ident), address)
            expected = math.copysign(way(abs(distance), *pace, step / 100)[0], distance)
            assert counter.chan_ident == ident
            assert abs(counter.position - expected) <= 1
    found = {(end.source, end.message.chan_ident): (when, end.message) for when, end in ends}
    assert len(found) == len(ends) == len(moves)
    for place, (distance, *pace) in moves.items():
        when, completed = found[place]
        assert completed.layout.message == "MOT_MOVE_COMPLETED"
        assert when == pytest.approx(way(abs(distance), *pace, 0)[1] * SECOND, abs=1)
        assert completed.position == distance


@pytest.mark.parametrize("name", MOTORS)
def test_all_channels_jog_move_stop_and_home(name: str, host: HostOf) -> None:
    far = host(name, channels=STAGE)
    everybody = channels(name)

    def all_of(make: Callable[[int], FramedMessage]) -> None:
        for address, ident in everybody:
            far.say(make(ident), address)

    def ends() -> list[tuple[int, int, str]]:
        """Return the messages of the next minute."""
        far.clock.advance(60)
        found = far.heard()
        return sorted((f.source, f.message.chan_ident, f.message.layout.message) for f in found)

    def all_end(message: str, but: int = 0) -> list[tuple[int, int, str]]:
        return [(*place, message) for place in everybody if place[0] != but]

    all_of(lambda ident: m.MotSetVelParams(ident, 0, 200_000, 2_000))
    all_of(lambda ident: m.MotSetJogParams(ident, STEP, 5_000, 0, 200_000, 2_000, 2))
    all_of(lambda ident: m.MotMoveJog(ident, 2))
    assert ends() == all_end("MOT_MOVE_COMPLETED")
    all_of(lambda ident: m.MotSetJogParams(ident, CONTINUOUS, 5_000, 0, 200_000, 2_000, 2))
    for start in (lambda ident: m.MotMoveJog(ident, 1), lambda ident: m.MotMoveVelocity(ident, 2)):
        for mode in (1, 2):
            all_of(start)
            assert ends() == []
            all_of(lambda ident, mode=mode: m.MotMoveStop(ident, mode))
            assert ends() == all_end("MOT_MOVE_STOPPED")
    suspended = everybody[-1][0]
    far.say(m.MotSuspendEndOfMoveMsgs(), suspended)
    all_of(lambda ident: m.MotMoveHome(ident))
    far.clock.advance(600)
    assert ends() == all_end("MOT_MOVE_HOMED", but=suspended)
    for address, ident in everybody:
        assert far.ask(m.MotReqPosCounter(ident), address) == [m.MotGetPosCounter(ident, 0)]


@pytest.mark.parametrize("name", MOTORS)
@pytest.mark.parametrize("line", LinkKind)
def test_each_address_counts_unacknowledged_messages(
    name: str, line: LinkKind, host: HostOf
) -> None:
    """Page 80: on USB a controller falls silent after 50 messages, until the host acknowledges."""
    far = host(name, channels=STAGE, line=line)
    addresses = sorted({address for address, _ in channels(name)})
    for address in addresses:
        far.say(m.HwStartUpdateMsgs(10), address)
    far.clock.advance(20)
    heard = [frame.source for frame in far.heard()]
    each = 50 if line is LinkKind.USB else 200 * UNITS[name]["channels"]
    assert sorted(heard) == sorted(addresses * each)
    far.say(m.MotAckDcStatusUpdate(), addresses[-1])
    far.say(m.MotMoveAbsolute(1, 0), addresses[-1])  # completed immediately, and counted
    assert [end.message.layout.message for end in far.heard()] == ["MOT_MOVE_COMPLETED"]
    far.clock.advance(20)
    again = [frame.source for frame in far.heard()]
    if line is LinkKind.USB:
        assert again == addresses[-1:] * 49
