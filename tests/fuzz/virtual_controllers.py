"""Say anything to virtual controllers: nothing raises, memory is bounded, a request is answered afterwards.

    python tests/fuzz/virtual_controllers.py                          # every unit, for a minute
    python tests/fuzz/virtual_controllers.py --seconds 10 --seed 7
    python tests/fuzz/virtual_controllers.py --first 1234 --cases 1   # one case again

A case is one unit with options by chance, and what a host does to it: random bytes, whole and damaged frames
or commands of its protocol, the plug pulled, the power switched off and on, time going on in between. In a
third of the cases there are faults on the line, too. Then the host comes to its senses, waits until nobody
waits for the rest of a broken frame any more, and asks: on a line without faults the answer must come.
Case ``n`` depends on the seed and on ``n`` alone.

Every twentieth case goes on for long; at its end ``tracemalloc`` says what its controller holds in memory.
"""

from __future__ import annotations

import argparse
import gc
import sys
import time
import tracemalloc
from collections.abc import Callable
from itertools import count
from random import Random

import command_streams
import streams

import stagewire_virtual as virtual
from stagewire_virtual.asi_ms2000.instrument import STRATEGIES
from stagewire_virtual.instrument import all_units
from stagewire_virtual.thorlabs_apt.quirks import QUIRKS

UNITS = tuple(sorted(all_units()))
SHORT = 40
LONG = 1000
"""Steps of a case, at most and exactly."""
BOUND = 4 << 20
"""Bytes that a controller may hold, whatever comes; most of them are waveform tables."""

_FAULTS = (
    "to_host drop frame every=3",
    "to_host drop byte p=0.05",
    "to_controller drop byte every=17",
    "to_controller flip byte p=0.02",
    "to_host flip byte every=5",
    "to_controller insert byte p=0.03",
    "to_host insert byte every=9",
    "to_controller duplicate frame every=2",
    "to_host duplicate byte every=7 count=3",
    "to_host delay frame every=4 by=0.3",
    "to_controller delay byte p=0.1 by=1.5",
    "to_host flood after=1 count=50 hex=810400",
    "to_host disconnect at=30",
    "to_controller disconnect at=200",
)
_COLONS = b":" * 300  # whatever command is pending, its data included, has ended by then
_LONG_ENOUGH = 2.0  # nobody waits so long for the rest of a frame


class Broken(Exception):
    """A case that a controller did not stand, with what is needed to repeat it."""

    def __init__(self, seed: int, number: int, what: str) -> None:
        super().__init__(
            f"{UNITS[number % len(UNITS)]}, seed {seed}, case {number}: {what}\n"
            f"  repeat: virtual_controllers.py --seed {seed} --first {number} --cases 1"
        )


def one_case(
    seed: int,
    number: int,
    steps: int | None = None,
    hear: Callable[[bytes], object] = len,
) -> virtual.VirtualController:
    """Run a case and return its controller; raise :class:`Broken` when it did not stand it.

    :param steps: how much is done; by default a few things, by chance.
    :param hear: takes what the controller says.
    """
    rng = Random(f"{seed}/{number}")
    steps = rng.randrange(SHORT) if steps is None else steps
    faults = rng.sample(_FAULTS, rng.randrange(1, 4)) if rng.random() < 0.3 else []
    try:
        controller = _made(rng, UNITS[number % len(UNITS)], faults)
        for _ in range(steps):
            _step(rng, controller, hear)
        controller.plug_in()
        if not faults:
            ask(controller)
    except Exception as error:
        raise Broken(seed, number, f"{type(error).__name__}: {error}") from error
    return controller


def ask(controller: virtual.VirtualController) -> None:
    """Ask what every controller answers; raise when it does not."""
    controller.advance(_LONG_ENOUGH)
    unit = controller.instrument.unit
    if unit.protocol.name == "asi_ms2000":
        controller.write(_COLONS + b"\xff\x42")
        asked, size = b"\x18\x73\x02:", 2
    else:
        address = 0x50 if unit.facts["address"] == "generic_usb" else 0x11
        asked, size = bytes((0x05, 0x00, 0x00, 0x00, address, 0x01)), 90
    controller.read()
    controller.write(asked)
    found = controller.read()
    if len(found) != size:
        raise AssertionError(f"{asked.hex(' ')} was answered {found.hex(' ')!r}, not {size} bytes")


def _made(rng: Random, name: str, faults: list[str]) -> virtual.VirtualController:
    """Return a controller with options by chance."""
    factory = getattr(virtual, name)
    options = {"seed": rng.randrange(1000), "faults": faults}
    if factory.unit.protocol.name == "asi_ms2000":
        chosen = rng.sample(sorted(STRATEGIES), rng.randrange(len(STRATEGIES) + 1))
        options["strategies"] = {name: rng.choice(sorted(STRATEGIES[name])) for name in chosen}
    else:
        options["answer_unsupported"] = rng.random() < 0.5
        options["line"] = rng.choice(("usb", "rs232"))
        options["quirks"] = rng.sample(sorted(QUIRKS), rng.choice((0, 0, 1, 2, len(QUIRKS))))
        if rng.random() < 0.3 and name != "TSC001":  # a solenoid has none
            options["travel"] = rng.choice((1, 200, 65535))
    controller: virtual.VirtualController = factory(**options)
    return controller


def _step(
    rng: Random, controller: virtual.VirtualController, hear: Callable[[bytes], object]
) -> None:
    """Do one thing that a host, or somebody at the bench, may do."""
    if not controller.link.connected:
        controller.plug_in()
    kind = rng.random()
    if kind < 0.75:
        controller.write(_bytes(rng, controller.instrument.unit.protocol.name))
    elif kind < 0.95:
        controller.advance(10 ** rng.uniform(-4, 2))
    elif kind < 0.97:
        controller.power_cycle()
    elif kind < 0.99:
        controller.instrument.rows()
    else:
        controller.unplug()
        return
    if controller.link.connected:
        hear(controller.read())


def _bytes(rng: Random, protocol: str) -> bytes:
    """Return what a host may say: frames or commands of the protocol, damaged at times, cut anywhere."""
    if rng.random() < 0.1:
        return rng.randbytes(rng.choice((1, 2, 7, 64, 4096)))
    one = command_streams.command if protocol == "asi_ms2000" else _frame_for_a_controller
    data = b"".join([one(rng) for _ in range(rng.choice((1, 1, 2, 5, 20)))])
    if rng.random() < 0.3:
        data = streams.damaged(rng, data)
    return data[: rng.randrange(len(data) + 1)] if rng.random() < 0.1 else data


def _frame_for_a_controller(rng: Random) -> bytes:
    """Return a frame, most often to the first channel at an address where something is."""
    data = bytearray(streams.frame(rng))
    if rng.random() < 0.8 and len(data) >= 6:
        long = data[4] & 0x80
        data[4:6] = bytes((rng.choice((0x50, 0x11, 0x21, 0x22)) | long, 0x01))
        where = 6 if long else 2
        data[where : where + (2 if long else 1)] = b"\x01\x00"[: 2 if long else 1]
    return bytes(data)


def held_by(seed: int, number: int, steps: int) -> int:
    """Run a long case and return how many bytes its controller holds; raise :class:`Broken` for too many."""
    tracemalloc.start()
    try:
        controller = one_case(seed, number, steps)
        gc.collect()
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    del controller
    if held > BOUND:
        raise Broken(seed, number, f"it holds {held:,} bytes, more than {BOUND:,}")
    return held


def main() -> int:
    """Run cases until the time is over; return 1 when one was not stood."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cases", type=int)
    given = parser.parse_args()
    last = None if given.cases is None else given.first + given.cases

    for number in range(len(UNITS)):  # what is loaded once is not a controller's
        one_case(given.seed, number)
    gc.collect()
    gc.freeze()
    end = time.perf_counter() + given.seconds
    most = done = 0
    for number in count(given.first):
        if number == last or (last is None and time.perf_counter() > end):
            break
        try:
            if number % 20 == 0:
                most = max(most, held_by(given.seed, number, LONG))
            else:
                one_case(given.seed, number)
        except Broken as broken:
            print(f"wrong: {broken}")
            return 1
        done += 1
    print(f"{done:,} cases of {len(UNITS)} units; a controller held {most:,} bytes at most")
    return 0


if __name__ == "__main__":
    sys.exit(main())
