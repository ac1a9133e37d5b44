"""The plug is pulled at every byte of a move, in both directions. The move is never sent twice."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

import pytest
from proof_controller import HOST, Controller
from proof_line import SIDES, Side, settled
from proof_server import Server

from stagewire import Frame
from stagewire.errors import TransportLostError
from stagewire_apt import TDC001
from stagewire_apt import messages as m
from stagewire_apt.aio import TDC001 as AsyncTDC001

MOVE = m.MotMoveAbsolute(chan_ident=1, absolute_distance=51456).pack(dest=0x50, source=HOST)
COMPLETED = m.MotMoveCompletedDc(
    chan_ident=1, position=51456, velocity=0, status_bits=0x80000400
).pack(dest=HOST, source=0x50)


class Cut(Controller):
    """A controller whose plug is pulled after it has received or sent a number of bytes of a move.

    :param taken: bytes received of the move; None: all.
    :param said: bytes sent of the message at its end; None: all.
    """

    def __init__(self, taken: int | None, said: int | None) -> None:
        super().__init__()
        self._taken, self._said = taken, said

    def take(self, data: bytes) -> Iterable[tuple[float, bytes | None]]:
        at = data.find(MOVE)  # keep-alive messages may precede it
        if self._taken is not None and at >= 0:
            data = data[: at + self._taken]
            self.unplug()
        return super().take(data)

    def answer(self, frame: Frame) -> Iterable[tuple[float, bytes | None]]:
        if not isinstance(frame.message, m.MotMoveAbsolute):
            return ()
        if self._said is None:
            return [(0.5, COMPLETED)]
        return [(0.5, COMPLETED[: self._said]), (0.5, None)]

    def plug_in(self) -> None:
        """Start a new line, and forget a partial frame of the previous one."""
        self.unplugged = False
        self._framer.reset()

    def moves(self) -> int:
        return sum(frame.encode() == MOVE for frame in self.heard)


CUTS = [
    *(pytest.param(taken, None, id=f"{taken} bytes received") for taken in range(len(MOVE) + 1)),
    *(pytest.param(None, said, id=f"{said} bytes sent") for said in range(len(COMPLETED) + 1)),
]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(("taken", "said"), CUTS)
def test_a_move_over_a_lost_line_in_memory_is_not_resent(
    taken: int | None, said: int | None, side: Side
) -> None:
    controller = Cut(taken, said)

    async def scenario(bench: Any) -> None:
        async with bench.open("TDC001", identify=False) as device:
            if said == len(COMPLETED):
                await settled(device.move_absolute(counts=51456))
            else:
                with pytest.raises(TransportLostError):
                    await settled(device.move_absolute(counts=51456))
            with suppress(TransportLostError):  # the wait raises it
                await bench.sleep(1)
            with pytest.raises(TransportLostError):  # as does every later call
                await settled(device.get_vel_params())

    side.run(controller, scenario)
    assert controller.moves() == (1 if taken in (None, len(MOVE)) else 0)


# The same on TCP in real time, with reconnecting.


# If the plug is pulled after the whole end was sent, the reset may overtake it, so this case is left out.
SURE = [cut for cut in CUTS if cut.values[1] != len(COMPLETED)]


@pytest.mark.parametrize(("taken", "said"), SURE)
def test_a_move_over_a_lost_tcp_connection_is_not_resent(
    taken: int | None, said: int | None
) -> None:
    controller = Cut(taken, said)
    with (
        Server(controller) as server,
        TDC001.open(server.url, identify=False, on_close="leave", reconnect_pause=0) as tdc,
    ):
        with pytest.raises(TransportLostError):
            tdc.move_absolute(counts=51456, timeout=10)
        moves = controller.moves()
        tdc.reconnect()
        tdc.identify()
    assert controller.moves() == moves == (1 if taken in (None, len(MOVE)) else 0)


@pytest.mark.parametrize(("taken", "said"), SURE)
def test_a_move_over_a_lost_tcp_connection_is_not_resent_in_asyncio(
    taken: int | None, said: int | None
) -> None:
    controller = Cut(taken, said)

    async def main(url: str) -> int:
        async with AsyncTDC001.open(
            url, identify=False, on_close="leave", reconnect_pause=0
        ) as tdc:
            with pytest.raises(TransportLostError):
                await tdc.move_absolute(counts=51456, timeout=10)
            moves = controller.moves()
            await tdc.reconnect()
            await tdc.identify()
        return moves

    with Server(controller) as server:
        moves = asyncio.run(main(server.url))
    assert controller.moves() == moves == (1 if taken in (None, len(MOVE)) else 0)
    assert [frame.message for frame in controller.heard if frame.encode() != MOVE] == [
        m.ModIdentify()
    ]
