"""Send anything to virtual controllers: nothing raises, memory is bounded, and later requests are answered.

    python tests/fuzz/virtual_controllers.py                          # all units, one minute in total
    python tests/fuzz/virtual_controllers.py --seconds 10 --seed 7
    python tests/fuzz/virtual_controllers.py --first 1234 --cases 1   # one case again

A case is one unit with random options and a random sequence of actions: the host sends random bytes, or whole
and damaged frames or commands of the protocol, somebody unplugs the line or switches the power off and on,
and time passes. In a third of the cases the line also has faults. At the end, the host waits until the
controller has given up on every incomplete frame, and sends a request. On a line without faults the reply
must arrive. Case ``n`` depends only on the seed and on ``n``.

Every twentieth case is long. At its end, ``tracemalloc`` measures how much memory the controller holds.
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
from stagewire_virtual.factory import simulated_units
from stagewire_virtual.thorlabs_apt.quirks import QUIRKS

UNITS = tuple(sorted(simulated_units()))
WITHOUT_TRAVEL = frozenset(
    (
        "MFF101",
        "MFF102",
        "TSC001",
        "KSC101",
        "KLD101",
        "TLD001",
        "KLS101",
        "KLS635",
        "KLS1550",
        "TLS001",
        "TTC001",
    )
)
"""Flippers, which have two positions, solenoids, lasers, and coolers."""
SHORT = 40
LONG = 1000
"""Number of steps: fewer than SHORT in a short case, exactly LONG in a long one."""
BOUND = 4 << 20
"""Limit of the bytes that a controller holds, most of them in waveform tables."""

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
_COLONS = b":" * 300  # ends any pending command, including its data
_LONG_ENOUGH = 2.0  # longer than any controller waits for the rest of a frame


class Broken(Exception):
    """A case in which a controller failed, with everything needed to repeat it."""

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
    """Run a case and return its controller; raise :class:`Broken` if the controller fails.

    :param steps: number of actions; by default a small random number.
    :param hear: called with the bytes that the controller sends.
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
    """Send a request that every controller answers; raise if the reply is missing or has another size."""
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
        raise AssertionError(
            f"reply to {asked.hex(' ')}: {found.hex(' ')!r}, expected {size} bytes"
        )


def _made(rng: Random, name: str, faults: list[str]) -> virtual.VirtualController:
    """Return a controller with random options."""
    factory = getattr(virtual, name)
    options = {"seed": rng.randrange(1000), "faults": faults}
    if factory.unit.protocol.name == "asi_ms2000":
        chosen = rng.sample(sorted(STRATEGIES), rng.randrange(len(STRATEGIES) + 1))
        options["strategies"] = {name: rng.choice(sorted(STRATEGIES[name])) for name in chosen}
    else:
        options["answer_unsupported"] = rng.random() < 0.5
        options["line"] = rng.choice(("usb", "rs232"))
        options["quirks"] = rng.sample(sorted(QUIRKS), rng.choice((0, 0, 1, 2, len(QUIRKS))))
        if rng.random() < 0.3 and name not in WITHOUT_TRAVEL:
            options["travel"] = rng.choice((1, 200, 65535))
    controller: virtual.VirtualController = factory(**options)
    return controller


def _step(
    rng: Random, controller: virtual.VirtualController, hear: Callable[[bytes], object]
) -> None:
    """Perform one action of a host or of a person at the bench."""
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
    """Return bytes from a host: random, or frames or commands, sometimes damaged or cut."""
    if rng.random() < 0.1:
        return rng.randbytes(rng.choice((1, 2, 7, 64, 4096)))
    one = command_streams.command if protocol == "asi_ms2000" else _frame_for_a_controller
    data = b"".join([one(rng) for _ in range(rng.choice((1, 1, 2, 5, 20)))])
    if rng.random() < 0.3:
        data = streams.damaged(rng, data)
    return data[: rng.randrange(len(data) + 1)] if rng.random() < 0.1 else data


def _frame_for_a_controller(rng: Random) -> bytes:
    """Return a frame, usually to the first channel of an existing address."""
    data = bytearray(streams.frame(rng))
    if rng.random() < 0.8 and len(data) >= 6:
        long = data[4] & 0x80
        data[4:6] = bytes((rng.choice((0x50, 0x11, 0x21, 0x22)) | long, 0x01))
        where = 6 if long else 2
        data[where : where + (2 if long else 1)] = b"\x01\x00"[: 2 if long else 1]
    return bytes(data)


def held_by(seed: int, number: int, steps: int) -> int:
    """Run a case and return how many bytes its controller holds; raise :class:`Broken` for too many."""
    tracemalloc.start()
    try:
        controller = one_case(seed, number, steps)
        gc.collect()
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    del controller
    if held > BOUND:
        raise Broken(seed, number, f"the controller holds {held:,} bytes; the limit is {BOUND:,}")
    return held


def main() -> int:
    """Run cases until the time is up; return 1 if one failed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cases", type=int)
    given = parser.parse_args()
    last = None if given.cases is None else given.first + given.cases

    # Load shared data first, so that it does not count as a controller's memory.
    for number in range(len(UNITS)):
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
            print(f"problem: {broken}")
            return 1
        done += 1
    print(f"{done:,} cases of {len(UNITS)} units; a controller held {most:,} bytes at most")
    return 0


if __name__ == "__main__":
    sys.exit(main())
