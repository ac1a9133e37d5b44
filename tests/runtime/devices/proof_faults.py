"""Queries with unique replies over a line that loses, repeats, delays and damages bytes.

``python tests/runtime/devices/proof_faults.py --requests 100000 --seed 1`` makes this number of requests in
simulated time and prints the results. It exits with 1 if a value was wrong, an error was undocumented, or the
session was not usable afterwards.

Every reply carries a unique number. An answer is right if the controller sent it in reply to a request of the
same kind that it received after the call began. The line preserves order: a repeated frame follows its
original immediately, as do two answers to a repeated request. A delay also delays the following bytes, but
never for longer than the quiet period of a session.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter
from collections.abc import Iterable
from typing import Any

from proof_calls import fields_of, layouts
from proof_controller import HOST, Controller, answers_of
from proof_line import SIDES, Side, settled

from stagewire import Frame
from stagewire.errors import ReplyTimeoutError
from stagewire.framing import Received
from stagewire_apt import messages as m

UNIT, ADDRESS, FOREIGN_BAY = "TDC001", 0x50, 0x22
QUERIES = {
    "get_pos_counter": m.MotGetPosCounter,
    "get_enc_counter": m.MotGetEncCounter,
    "get_vel_params": m.MotGetVelParams,
    "get_gen_move_params": m.MotGetGenMoveParams,
    "get_move_abs_params": m.MotGetMoveAbsParams,
}
RATE = 0.01
FAULTS = ("loss", "duplication", "delay", "insertion", "header")
TIMEOUTS = (0.2, 1.0)  # the shorter one expires before a delayed reply
SILENCE = 0.05  # seconds after which either side discards a partial frame
HEADER = range(6)
LONGEST = {True: 0.35, False: 0.1}  # seconds of delay, to the host and to the controller


class Noisy(Controller):
    """A controller on a faulty line.

    :param faults: faults that occur, each with probability :data:`RATE` per frame and direction.
    """

    def __init__(self, seed: int, faults: Iterable[str]) -> None:
        super().__init__()
        self.faults = tuple(faults)
        self.noisy = True
        self.happened: Counter[str] = Counter()
        self.count = 0  # the number of the last reply
        self.kinds: dict[int, type] = {}  # number -> class of its message
        self._draw = random.Random(seed)
        self._free = {True: 0.0, False: 0.0}  # when each direction is idle again
        self._last = 0.0

    # The line

    def take(self, data: bytes) -> Iterable[tuple[float, bytes]]:
        time, carried = self._carry([data], to_host=False, time=self.now())
        late = time - self._last > SILENCE
        self._last = time
        events = [*(self._framer.abandon() if late else ()), *self._framer.feed(carried)]
        replies = [reply for event in events for _, reply in self.hear(event)]
        if not replies:
            return []
        time, said = self._carry(replies, to_host=True, time=time)
        return [(time - self.now(), said)]

    def _carry(self, frames: list[bytes], to_host: bool, time: float) -> tuple[float, bytes]:
        """Return when consecutive frames arrive at the other end, and their bytes after faults."""
        said, delay = b"", 0.0
        for frame in frames:
            parts = [frame]
            for fault in self.faults if self.noisy else ():
                if self._draw.random() >= RATE:
                    continue
                self.happened[fault] += 1
                if fault == "delay":
                    delay = self._draw.uniform(0.0, LONGEST[to_host])
                else:
                    parts = self._hit(fault, frame, parts, to_host)
            said += b"".join(parts)
        self._free[to_host] = max(self._free[to_host], time + delay)
        return self._free[to_host], said

    def _hit(self, fault: str, frame: bytes, parts: list[bytes], to_host: bool) -> list[bytes]:
        draw = self._draw
        if fault == "loss":
            return [] if draw.random() < 0.5 else [_without_a_byte(frame, HEADER, draw)]
        if fault == "duplication":
            return parts * 2
        if fault == "insertion":
            at = draw.randint(0, len(parts))
            return [*parts[:at], self._inserted(to_host), *parts[at:]]
        if fault == "header":
            return [_damaged(part, HEADER, draw) for part in parts]
        # Damage a byte in the packet, or lose one, so that the next bytes may be read as part of it.
        spoil = _without_a_byte if draw.random() < 0.5 else _damaged
        return [spoil(part, range(HEADER.stop, len(frame)), draw) for part in parts]

    def _inserted(self, to_host: bool) -> bytes:
        draw = self._draw
        if not to_host or draw.random() < 0.4:
            return draw.randbytes(draw.randint(1, 12))
        wrong = self._reply(draw.choice(list(QUERIES.values())), draw.choice((1, 2)))
        source = ADDRESS if wrong.chan_ident == 2 else FOREIGN_BAY
        return Frame(wrong, dest=HOST, source=source).encode()

    # The controller

    def hear(self, event: Any) -> Iterable[tuple[float, bytes]]:
        if not isinstance(event, Received) or event.dest != ADDRESS:
            return ()
        return super().hear(event)

    def answer(self, frame: Frame) -> Iterable[tuple[float, bytes]]:
        self.heard.clear()
        cls = answers_of().get(type(frame.message))
        if cls not in QUERIES.values() or not 0 < frame.message.chan_ident < 3:
            return ()
        reply = self._reply(cls, frame.message.chan_ident)
        self.kinds[number_of(self.count)] = cls
        return [(0.0, Frame(reply, dest=HOST, source=ADDRESS).encode())]

    def _reply(self, cls: Any, channel: int) -> Any:
        self.count += 1
        names = [field["name"] for field in fields_of(layouts()[cls.__name__])]
        values = {name: number_of(self.count) for name in names if name != "chan_ident"}
        return cls(chan_ident=channel, **values)


def number_of(count: int) -> int:
    """Return the number in the reply with this count; a parity bit protects it against single-bit damage."""
    return count << 1 | count.bit_count() & 1


def _without_a_byte(frame: bytes, where: range, draw: random.Random) -> bytes:
    if len(frame) < where.stop or not where:
        return frame
    at = draw.choice(where)
    return frame[:at] + frame[at + 1 :]


def _damaged(frame: bytes, where: range, draw: random.Random) -> bytes:
    if len(frame) < where.stop or not where:
        return frame
    at = draw.choice(where)
    return frame[:at] + bytes([frame[at] ^ 1 << draw.randrange(8)]) + frame[at + 1 :]


class Tally:
    """The results of the requests.

    :ivar wrong: descriptions of results that must never happen.
    :ivar spoilt: number of values that the controller did not send; only damage in packets causes them.
    """

    def __init__(self) -> None:
        self.right = self.failed = self.spoilt = 0
        self.wrong: list[str] = []
        self.faults: Counter[str] = Counter()

    def __str__(self) -> str:
        faults = ", ".join(f"{name} {count}" for name, count in sorted(self.faults.items()))
        asked = f"{self.right} right, {self.failed} of them when asked again after an error"
        return f"{asked}; {self.spoilt} spoilt, {len(self.wrong)} wrong; {faults}"


def judge(controller: Noisy, before: int, cls: type, message: Any) -> str:
    """Return ``right``, ``spoilt`` (a number that was never sent), or what is wrong with an answer."""
    names = [field["name"] for field in fields_of(layouts()[cls.__name__])]
    numbers = {getattr(message, name) for name in names if name != "chan_ident"}
    known = {number for number in numbers if number in controller.kinds}
    if numbers != known or len(numbers) > 1:
        return "spoilt"
    [number] = numbers
    if controller.kinds[number] is not cls:
        return f"{number} was sent in a {controller.kinds[number].__name__}"
    if number >> 1 <= before:
        return f"reply {number >> 1} belongs to an earlier request; {before} was the last before the call"
    return "right"


async def ask(bench: Any, controller: Noisy, requests: int, seed: int) -> Tally:
    """Make a number of requests; after each failure, repeat the request over a line without faults."""
    draw = random.Random(seed)
    tally = Tally()
    async with bench.open(UNIT, identify=False, on_close="leave") as device:
        for _ in range(requests):
            name = draw.choice(list(QUERIES))
            await _ask_once(device, controller, name, tally, draw.choice(TIMEOUTS))
    tally.faults = controller.happened
    return tally


async def _ask_once(
    device: Any, controller: Noisy, name: str, tally: Tally, timeout: float
) -> None:
    before = controller.count
    try:
        values = await settled(getattr(device, name)(timeout=timeout))
    except ReplyTimeoutError:
        if not controller.noisy:
            tally.wrong.append(f"{name}: no answer over a line without faults")
            return
        tally.failed += 1
        controller.noisy = False
        await _ask_once(device, controller, name, tally, 3 * max(TIMEOUTS))
        controller.noisy = True
        return
    except Exception as error:  # any other error is undocumented
        tally.wrong.append(f"{name}: {error!r}")
        return
    verdict = judge(controller, before, QUERIES[name], values.message)
    if verdict == "right":
        tally.right += 1
    elif verdict == "spoilt" and "packet" in controller.faults:
        tally.spoilt += 1
    else:
        tally.wrong.append(f"{name}: {verdict}: {values}")


def run(side: Side, requests: int, seed: int, faults: Iterable[str] = FAULTS) -> Tally:
    controller = Noisy(seed, faults)
    return side.run(controller, lambda bench: ask(bench, controller, requests, seed))


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--requests", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    failed = False
    for side in SIDES:
        for faults in (FAULTS, (*FAULTS, "packet")):
            tally = run(side, options.requests, options.seed, faults)
            print(f"{side}, {', '.join(faults)}: {tally}")
            for text in tally.wrong[:20]:
                print(f"  {text}")
            failed = failed or bool(tally.wrong)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
