"""The plug is pulled at every byte of a polled move. The move is never sent twice."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest
from proof_line import SIDES, Side, at_once, settled
from proof_ms2000 import LOW, UNITS, Axes, Said, opened
from proof_server import Server

from stagewire.errors import MotionUnderWayError, TransportLostError, WrongModeError
from stagewire_ms2000 import MS2000
from stagewire_ms2000 import messages as c
from stagewire_ms2000.aio import MS2000 as AsyncMS2000

MOVES: dict[str, tuple[Callable[[Any], Any], bytes]] = {
    "move_absolute": (
        lambda axis: axis.move_absolute(counts=100),
        c.WriteTargetPosition(100).pack(0x18),
    ),
    "increment_move_up": (lambda axis: axis.increment_move_up(), c.IncrementMoveUp().pack(0x18)),
    "increment_move_down": (
        lambda axis: axis.increment_move_down(),
        c.IncrementMoveDown().pack(0x18),
    ),
}
READ = c.ReadStatus().pack(0x18)
POLLS = 4  # polls during a move of 0.35 s
WHERE = c.ReadMotorPositionAndStatus().pack(0x18)
ASKED = c.ReadIncrementValue().pack(0x18) + WHERE
"""Requests before a move by a stored distance."""
ANSWERED = 3 + 4  # bytes
OPTIONS: dict[str, Any] = {"on_close": "leave", "reconnect_pause": 0}
"""Options on TCP; the far end forgets half a command when it hangs up, so no pause is needed."""


def before(name: str) -> bytes:
    """Return the requests before a move."""
    return ASKED if name.startswith("increment") else b""


def whole(name: str) -> bytes:
    """Return all bytes written for a move: requests, the command, polls, and the final position request."""
    return before(name) + MOVES[name][1] + READ * POLLS + WHERE


class Cut(Axes):
    """A controller whose plug is pulled after it has received or sent a number of bytes in low-level mode.

    :param taken: bytes to receive; None: all.
    :param said: bytes to send; None: all.
    """

    def __init__(self, taken: int | None, said: int | None) -> None:
        super().__init__()
        self._to_take, self._to_say = taken, said

    def take(self, data: bytes) -> Said:
        if self._to_take is not None and len(self.raw + data) > len(LOW):
            room = len(LOW) + self._to_take - len(self.raw)
            if len(data) >= room:
                data = data[:room]
                self.unplug()
        said: list[tuple[float, bytes | None]] = []
        for delay, reply in super().take(data):
            assert reply is not None
            if self._to_say is not None:
                reply = reply[: self._to_say]
                self._to_say -= len(reply)
            said.append((delay, reply))
            if self._to_say == 0:
                said.append((delay, None))
        return said

    def plug_in(self) -> None:
        """Start a new line, and forget a partial command of the previous one."""
        if self.unplugged:
            self._to_take = self._to_say = None
        self.unplugged = False
        self.begin()


def cuts(name: str, polls: int) -> list[tuple[int | None, int | None]]:
    """Return every byte at which to cut a move with a number of polls, and their answers."""
    size = len(before(name) + MOVES[name][1]) + polls * len(READ)
    answered = ANSWERED if before(name) else 0
    return [
        *((taken, None) for taken in range(size + 1)),
        *((None, said) for said in range(1, answered + polls)),
    ]


def seen(name: str, taken: int | None, said: int | None) -> int:
    """Return how many moves a controller receives before the cut."""
    if taken is None:
        return int(not before(name) or (said or 0) > ANSWERED)
    return int(taken >= len(before(name) + MOVES[name][1]))


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("name", MOVES)
def test_a_polled_move_over_a_lost_line_in_memory_is_not_resent(
    unit: str, name: str, side: Side
) -> None:
    move, _ = MOVES[name]

    async def scenario(bench: Any, far: Cut) -> None:
        async with opened(bench, unit, on_close="stop") as device:
            await settled(device.switch_to_low_level())
            with pytest.raises(TransportLostError):
                await settled(move(device.axis("X")))
            for call in (device.axis("X").read_status, device.axis("X").stop):
                with pytest.raises(TransportLostError):  # as does every later call
                    await settled(call())

    for taken, said in cuts(name, POLLS):
        far = Cut(taken, said)
        side.run(far, lambda bench, far=far: scenario(bench, far))
        assert far.moves() == seen(name, taken, said), (taken, said)
        assert far.raw == (LOW + whole(name))[: len(far.raw)]
        assert taken is None or len(far.raw) == len(LOW) + taken


def test_a_move_without_a_cut_writes_all_expected_bytes() -> None:
    """This shows that the cuts cover the whole move."""
    for name, (move, _) in MOVES.items():
        far = Cut(None, None)

        async def scenario(bench: Any, move: Any = move) -> None:
            async with opened(bench) as device:
                device.switch_to_low_level()
                move(device.axis("X"))

        SIDES[0].run(far, scenario)
        assert far.raw == LOW + whole(name), name


async def again(device: Any, far: Cut, moves: int) -> None:
    """Reconnect: nothing is resent, and another move is refused until the first is known to have ended."""
    far.forget()
    await settled(device.reconnect())
    axis = device.axis("X")
    with pytest.raises(WrongModeError):
        await settled(axis.start_move_absolute(counts=1))
    await settled(device.switch_to_low_level())
    if moves:
        with pytest.raises(MotionUnderWayError):
            await settled(axis.start_move_absolute(counts=1))
        await settled(axis.stop())
    assert far.moves() == 0
    await settled(axis.start_move_absolute(counts=1))
    await settled(axis.stop())
    await settled(axis.read_status())  # its reply shows that everything before it arrived
    assert far.moves() == 1


@pytest.mark.parametrize(("taken", "said"), cuts("move_absolute", 1))
def test_a_polled_move_over_a_lost_tcp_connection_is_not_resent(
    taken: int | None, said: int | None
) -> None:
    far = Cut(taken, said)
    far.lasts = 60
    move, _ = MOVES["move_absolute"]
    moves = seen("move_absolute", taken, said)
    with Server(far) as server, MS2000.open(server.url, **OPTIONS) as device:
        device.switch_to_low_level()
        with pytest.raises(TransportLostError):
            move(device.axis("X"))
        assert far.moves() == moves
        at_once(again(device, far, moves))


@pytest.mark.parametrize(("taken", "said"), cuts("move_absolute", 1))
def test_a_polled_move_over_a_lost_tcp_connection_is_not_resent_in_asyncio(
    taken: int | None, said: int | None
) -> None:
    far = Cut(taken, said)
    far.lasts = 60
    move, _ = MOVES["move_absolute"]
    moves = seen("move_absolute", taken, said)

    async def main(url: str) -> None:
        async with AsyncMS2000.open(url, **OPTIONS) as device:
            await device.switch_to_low_level()
            with pytest.raises(TransportLostError):
                await move(device.axis("X"))
            assert far.moves() == moves
            await again(device, far, moves)

    with Server(far) as server:
        asyncio.run(main(server.url))
