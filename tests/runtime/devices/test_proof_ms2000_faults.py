"""Replies without a frame over a line that loses, repeats and delays: a late reply is never matched.

Bytes that are inserted into or damaged in a reply of the MS-2000 cannot be detected, so this is not tested.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable
from typing import Any

import pytest
from proof_line import SIDES, FarEnd, Side, settled

from stagewire.errors import ReplyTimeoutError
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as c

PACKAGE = "stagewire_ms2000"
REQUESTS = 4000
RATE = 0.02
TIMEOUTS = (0.3, 1.0)
LATEST = 1.15  # seconds: longer than the timeouts, but shorter than the silence that drains a line
QUERIES = {
    "read_motor_position": (c.ReadMotorPosition, "position"),
    "read_target_position": (c.ReadTargetPosition, "target_position"),
    "read_increment_value": (c.ReadIncrementValue, "increment"),
}


class Numbering(FarEnd):
    """A controller that answers each request with a new number."""

    def __init__(self, seed: int) -> None:
        self.count = 0
        self.kinds: dict[int, type] = {}
        self.happened: Counter[str] = Counter()
        self.noisy = False
        self._draw = random.Random(seed)
        self._framer = PROTOCOL.framer()
        self._free = 0.0

    def take(self, data: bytes) -> Iterable[tuple[float, bytes]]:
        said = []
        for event in self._framer.feed(data):
            message = event.frame.message
            if type(message) in {cls for cls, _ in QUERIES.values()}:
                self.count += 1
                self.kinds[self.count] = type(message)
                said.append(self._carry(self.count.to_bytes(3, "little")))
        return said

    def _carry(self, reply: bytes) -> tuple[float, bytes]:
        draw, delay = self._draw, 0.002
        for fault in ("loss", "cut", "duplication", "delay") if self.noisy else ():
            if draw.random() >= RATE:
                continue
            self.happened[fault] += 1
            if fault == "loss":
                reply = b""
            elif fault == "cut":
                reply = reply[:-1]
            elif fault == "duplication" and len(reply) == 3:
                reply *= 2
            else:
                delay = draw.choice((draw.uniform(0.0, LATEST), LATEST))
        self._free = max(self._free, self.now() + delay)
        return self._free - self.now(), reply


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_stale_value_is_never_returned(side: Side, seed: int) -> None:
    far = Numbering(seed)
    draw = random.Random(seed)

    async def scenario(bench: Any) -> list[str]:
        wrong = []
        failed = 0
        async with bench.open("MS2000", PACKAGE, on_close="leave") as device:
            await settled(device.switch_to_low_level())
            axis = device.axis("X")
            for _ in range(REQUESTS):
                name = draw.choice(list(QUERIES))
                cls, field = QUERIES[name]
                before = far.count
                far.noisy = True
                try:
                    values = await settled(getattr(axis, name)(timeout=draw.choice(TIMEOUTS)))
                except ReplyTimeoutError:
                    failed += 1
                    far.noisy = False
                    before = far.count
                    values = await settled(getattr(axis, name)(timeout=3.0))
                number = getattr(values.message, field)
                if number <= before or far.kinds.get(number) is not cls:
                    wrong.append(f"{name}: {number} after {before}, {far.kinds.get(number)}")
        assert failed > 50
        return wrong

    assert side.run(far, scenario) == []
    assert all(far.happened[fault] > 50 for fault in ("loss", "cut", "duplication", "delay"))
