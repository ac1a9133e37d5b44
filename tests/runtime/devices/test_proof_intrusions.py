"""Ten real-world messages between a request and its reply are never taken for the reply, by any query.

Each query of each unit is made twice. An intrusion arrives together with the first reply or slightly earlier;
the second reply is undisturbed. Both answers must be those of the controller, which changes its values
between the requests.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable
from typing import Any

import pytest
from proof_calls import (
    Call,
    arguments,
    calls,
    facts_of,
    message_of,
    method,
    registry,
    units,
)
from proof_controller import HOST, Parrot, answers_of, channel_of
from proof_line import SIDES, Side, settled

from stagewire import Frame
from stagewire.errors import ControllerFaultError, MotionUnderWayError
from stagewire_apt import messages as m

STATUS_SIZE = 14


class Intruder(Parrot):
    """A controller that sends :attr:`before` just before its next reply, together or separately."""

    def __init__(self, seed: int, apart: bool) -> None:
        super().__init__(seed)
        self._apart = apart
        self.before: Callable[[Intruder, Frame], bytes] | None = None

    def answer(self, frame: Frame) -> Iterable[tuple[float, bytes]]:
        reply = self.reply(frame)
        if reply is None:
            return ()
        if self.before is None:
            return [(0.001, reply.encode())]
        intrusion, self.before = self.before(self, frame), None
        if self._apart:
            return [(0.001, intrusion), (0.002, reply.encode())]
        return [(0.001, intrusion + reply.encode())]


def status(controller: Intruder, frame: Frame) -> bytes:
    """Return the packet of the true status of the channel."""
    message = controller.state(m.MotGetDcStatusUpdate, frame.dest, channel_of(frame.message) or 1)
    return message.pack(dest=HOST, source=frame.dest)[6:]


def packet(id: int, data: bytes, frame: Frame) -> bytes:
    return bytes([id & 0xFF, id >> 8, len(data), 0, HOST | 0x80, frame.dest]) + data


def completion_of_20_bytes(controller: Intruder, frame: Frame) -> bytes:
    return packet(0x0464, status(controller, frame), frame)


def completion_of_6_bytes(controller: Intruder, frame: Frame) -> bytes:
    return bytes([0x64, 0x04, channel_of(frame.message) or 1, 0, HOST, frame.dest])


def dc_status(controller: Intruder, frame: Frame) -> bytes:
    return packet(0x0491, status(controller, frame), frame)


def status_of_34_bytes(controller: Intruder, frame: Frame) -> bytes:
    """Return the status of newer controllers: the documented layout followed by 14 bytes."""
    return packet(0x0491, status(controller, frame) + bytes(range(14)), frame)


def response(controller: Intruder, frame: Frame) -> bytes:
    return bytes([0x80, 0x00, 0, 0, HOST, frame.dest])


def rich_response(controller: Intruder, frame: Frame) -> bytes:
    return packet(0x0081, bytes([0x53, 0x04, 0x10, 0x00]) + b"over current".ljust(64, b"\0"), frame)


def unknown(controller: Intruder, frame: Frame) -> bytes:
    return packet(0x7ABC, bytes(range(10)), frame)


def unknown_with_a_frame_inside(controller: Intruder, frame: Frame) -> bytes:
    """Return an unknown message that contains a wrong reply to the request, or the end of the move."""
    reply = Parrot(seed=99).reply(frame)
    inside = completion_of_6_bytes(controller, frame) if reply is None else reply.encode()
    return packet(0x7ABC, b"\1\2" + inside, frame)


def stray_zero(controller: Intruder, frame: Frame) -> bytes:
    return b"\0"


def three_bytes_of_garbage(controller: Intruder, frame: Frame) -> bytes:
    return b"\xff\x13\x37"


INTRUSIONS: list[Callable[[Intruder, Frame], bytes]] = [
    completion_of_20_bytes,
    completion_of_6_bytes,
    dc_status,
    status_of_34_bytes,
    response,
    rich_response,
    unknown,
    unknown_with_a_frame_inside,
    stray_zero,
    three_bytes_of_garbage,
]
QUERIES = ("_get", "_ask")


def queries(unit: str) -> list[Call]:
    return [call for call in calls(unit) if call.kind in QUERIES]


def said_unasked(call: Call) -> bool:
    """Return whether the reply is a status that may also be unsolicited.

    Then the reply to the first request may be matched to the second one, so the state must stay the same.
    """
    reply = answers_of()[call.table.req]
    return bool(reply.layout.unsolicited)


def true_answer(controller: Intruder) -> Any:
    """Return the reply of the controller to the last request."""
    reply = controller.reply(controller.heard[-1])
    assert reply is not None
    return reply.message


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("apart", [False, True], ids=["in one chunk", "apart"])
@pytest.mark.parametrize("unit", units())
def test_no_query_takes_an_intrusion_for_its_reply(unit: str, apart: bool, side: Side) -> None:
    controller = Intruder(seed=1, apart=apart)
    draw = random.Random(unit)

    async def scenario(bench: Any) -> list[str]:
        wrong = []
        async with bench.open(unit, identify=False, on_close="leave") as device:
            for call in queries(unit):
                ask = method(device, call)
                for intrusion in INTRUSIONS:
                    for before in (intrusion, None):
                        if before or not said_unasked(call):
                            controller.renew()
                        controller.before = before
                        values = await settled(ask(**arguments(call, draw)))
                        if values.message != true_answer(controller):
                            wrong.append(f"{call}, {intrusion.__name__}: {values}")
        return wrong

    assert side.run(controller, scenario) == []


class Mover(Intruder):
    """A controller whose moves last half a second; it sends :attr:`before` in the middle of a move."""

    def answer(self, frame: Frame) -> Iterable[tuple[float, bytes]]:
        if not isinstance(frame.message, m.MotMoveAbsolute) or self.before is None:
            return super().answer(frame)
        end = m.MotMoveCompletedHeader(chan_ident=frame.message.chan_ident)
        intrusion = self.before(self, frame)
        return [(0.25, intrusion), (0.5, end.pack(HOST, frame.dest))]


# A fault report ends the wait for a move, but it does not end the move.
FAULTS = (response, rich_response)
NO_ENDS = [
    intrusion
    for intrusion in INTRUSIONS
    if intrusion not in (completion_of_6_bytes, completion_of_20_bytes, *FAULTS)
]
MOVES = [
    call for unit in units() for call in calls(unit)
    if call.name == "move_absolute" and message_of(call).layout.message == "MOT_MOVE_ABSOLUTE"
    and facts_of(unit).get("built_in") != "MPC_Paddle"  # a random position is far outside its travel
]  # fmt: skip


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("intrusion", NO_ENDS)
def test_no_move_takes_an_intrusion_for_its_end(
    intrusion: Callable[[Intruder, Frame], bytes], side: Side
) -> None:
    async def scenario(bench: Any, call: Call) -> bool:
        async with bench.open(call.unit, identify=False, on_close="leave") as device:
            begun = bench.now()
            end = await settled(method(device, call)(counts=1000))
            took = bench.now() - begun
        return type(end.message) is m.MotMoveCompletedHeader and 0.49 < took < 0.6

    def is_right(call: Call) -> bool:
        controller = Mover(seed=1, apart=True)
        controller.before = intrusion
        return side.run(controller, lambda bench: scenario(bench, call))

    assert [str(call) for call in MOVES if not is_right(call)] == []


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("intrusion", FAULTS)
def test_a_fault_report_ends_the_wait_for_a_move_immediately(
    intrusion: Callable[[Intruder, Frame], bytes], side: Side
) -> None:
    async def scenario(bench: Any, call: Call) -> str:
        async with bench.open(call.unit, identify=False, on_close="leave") as device:
            begun = bench.now()
            with pytest.raises(ControllerFaultError) as fault:
                await settled(method(device, call)(counts=1000))
            took = bench.now() - begun
            with pytest.raises(MotionUnderWayError):
                await settled(method(device, call)(counts=1000))
            said = fault.value
            reported = (said.code, said.fault)
            expected = (0, "") if intrusion is response else (0x10, "over current")
            return "" if reported == expected and 0.24 < took < 0.3 else f"{call}: {said} {took}"

    def outcome(call: Call) -> str:
        controller = Mover(seed=1, apart=True)
        controller.before = intrusion
        return side.run(controller, lambda bench: scenario(bench, call))

    assert "\n".join(filter(None, map(outcome, MOVES))) == ""


@pytest.mark.parametrize("unit", units())
def test_the_intrusion_tests_cover_every_query_of_a_unit(unit: str) -> None:
    """Each REQ message of a unit that only reads is sent by one of the calls."""
    facts = facts_of(unit)
    asked = {call.table.req.layout.message for call in queries(unit)}
    reading = {entry["name"] for entry in registry()["messages"] if entry["effect"] == "none"}
    assert asked == {name for name in facts["messages"] if "_REQ_" in name} & reading


def test_the_intrusions_have_the_sizes_in_the_field_notes() -> None:
    frame = Frame(m.MotReqPosCounter(chan_ident=1), dest=0x50, source=HOST)
    sizes = [len(intrusion(Intruder(1, False), frame)) for intrusion in INTRUSIONS]
    assert sizes == [20, 6, 20, 34, 6, 74, 16, 20, 1, 3]
