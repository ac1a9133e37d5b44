"""A controller that never answers: every call of every unit ends within 1.1 times its timeout.

The other end reads everything and sends nothing. The program calls every method of each unit that has a
timeout, each on a new device that was opened without identification. Arguments follow from the signatures.
Opening a device with identification is also a call. Calls that end early, because they await nothing or are
refused, are counted separately.

    python benchmarks/silent.py
    python benchmarks/silent.py --units TDC001 BBD102 MS2000
"""

from __future__ import annotations

import argparse
import asyncio
import inspect
import sys
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from measure import holds
from peer import peer

import stagewire_apt.aio
import stagewire_apt.devices
import stagewire_ms2000.aio
import stagewire_ms2000.devices
from stagewire.errors import ReplyTimeoutError, StagewireError
from stagewire_apt.devices import facts as apt_facts
from stagewire_ms2000.devices import facts as ms2000_facts

TIMEOUT = 0.3
AT_MOST = 1.1
MOST_THAT_DO_NOT_WAIT = 0.7  # otherwise the run would prove little
AT_ONCE = 12
TRIES = 4
PARTS: dict[str, Callable[[Any], Any]] = {
    "bay_class": lambda device: device.bay(1),
    "channel_class": lambda device: device.channel(1),
    "axis_class": lambda device: device.axis("X"),
}
THREADS = (stagewire_apt.devices, stagewire_ms2000.devices)
ASYNCIO = (stagewire_apt.aio, stagewire_ms2000.aio)
UNITS = {
    package: facts.UNITS
    for packages in (THREADS, ASYNCIO)
    for package, facts in zip(packages, (apt_facts, ms2000_facts), strict=True)
}


@dataclass(frozen=True)
class Call:
    """A method of a unit or of one of its parts, with its arguments. Without a method, opening the unit."""

    unit: Any
    part: str = ""
    method: str = ""

    def __str__(self) -> str:
        return ".".join(
            filter(None, (self.unit.__name__, self.part.removesuffix("_class"), self.method))
        )

    @property
    def options(self) -> dict[str, Any]:
        """The options to open the unit: without identification, unless opening is the call."""
        return {"identify": False} if self.method else {"timeout": TIMEOUT}

    def made(self, device: Any) -> Any:
        """Call the method of an open device."""
        target = PARTS[self.part](device) if self.part else device
        method = getattr(target, self.method)
        return method(**arguments(method), timeout=TIMEOUT)


@dataclass(frozen=True)
class Outcome:
    """The outcome of a call, and its time in multiples of its timeout."""

    call: Call
    kind: str
    share: float


def calls(packages: tuple[Any, ...], names: list[str]) -> Iterator[Call]:
    """Yield every call of the named units, or of all."""
    for package in packages:
        for name in UNITS[package]:
            if names and name not in names:
                continue
            unit = getattr(package, name)
            if not hasattr(unit, "axis_class"):
                yield Call(unit)
            for part in ("", *PARTS):
                cls = getattr(unit, part, None) if part else unit
                for method in dir(cls) if cls else ():
                    if not method.startswith("_") and takes_a_timeout(getattr(cls, method)):
                        yield Call(unit, part, method)


def takes_a_timeout(method: Any) -> bool:
    """Return whether a method of a class has a timeout and is not a context manager."""
    made = inspect.unwrap(method)
    block = inspect.isgeneratorfunction(made) or inspect.isasyncgenfunction(made)
    return (
        inspect.isfunction(made) and not block and "timeout" in inspect.signature(made).parameters
    )


def arguments(method: Any) -> dict[str, Any]:
    """Return a value for every required argument of a method; counts for values with a unit."""
    given: dict[str, Any] = {}
    for name, parameter in inspect.signature(method).parameters.items():
        annotation = str(parameter.annotation)
        if name == "timeout" or (parameter.default is not None and not is_needed(parameter)):
            continue
        if annotation.startswith("bytes"):
            given[name] = b""
        elif annotation.startswith("str"):
            given[name] = ""
        elif "int" in annotation:
            given[name] = 1
    return given


def is_needed(parameter: inspect.Parameter) -> bool:
    """Return whether a parameter has no default."""
    return parameter.default is inspect.Parameter.empty


def judged(call: Call, start: float, error: BaseException | None) -> Outcome:
    """Return the outcome of a call that began at ``start``."""
    share = (time.perf_counter() - start) / TIMEOUT
    if isinstance(error, ReplyTimeoutError):
        return Outcome(call, "waited", share)
    if isinstance(error, StagewireError):
        return Outcome(call, "refused", share)
    if error is not None:
        raise RuntimeError(f"{call} ended with {error!r}") from error
    return Outcome(call, "done", share)


def ask(call: Call, url: str) -> Outcome:
    """Open a device, make a call, and close it."""
    start = time.perf_counter()
    try:
        with call.unit.open(url, **call.options) as device:
            if call.part == "axis_class":
                device.switch_to_low_level()
            start = time.perf_counter()
            call.made(device)
    except Exception as error:
        return judged(call, start, error)
    return judged(call, start, None)


async def ask_asyncio(call: Call, url: str) -> Outcome:
    """Open a device, await a call, and close it."""
    start = time.perf_counter()
    try:
        async with call.unit.open(url, **call.options) as device:
            if call.part == "axis_class":
                await device.switch_to_low_level()
            start = time.perf_counter()
            await call.made(device)
    except Exception as error:
        return judged(call, start, error)
    return judged(call, start, None)


async def all_asyncio(made: list[Call], url: str) -> list[Outcome]:
    """Make asyncio calls, several at a time."""
    room = asyncio.Semaphore(AT_ONCE)

    async def one(call: Call) -> Outcome:
        async with room:
            return await ask_asyncio(call, url)

    waited: list[Awaitable[Outcome]] = [one(call) for call in made]
    return await asyncio.gather(*waited)


def patiently(make: Callable[[list[Call]], list[Outcome]], made: list[Call]) -> dict[Call, Outcome]:
    """Make the calls, and repeat those that were late because another program used the core."""
    best: dict[Call, Outcome] = {}
    for _ in range(TRIES):
        for outcome in make(made):
            if outcome.call not in best or outcome.share < best[outcome.call].share:
                best[outcome.call] = outcome
        made = [call for call in made if best[call].share > AT_MOST]
    return best


def report(title: str, best: dict[Call, Outcome]) -> bool:
    """Print the outcomes of the calls; return whether the bound holds."""
    outcomes = list(best.values())
    kinds = Counter(outcome.kind for outcome in outcomes)
    late = [outcome for outcome in outcomes if outcome.share > AT_MOST]
    print(
        f"{title}: {len(outcomes)} calls: {kinds['waited']} waited, {kinds['done']} had nothing to await, "
        f"{kinds['refused']} refused"
    )
    for outcome in late:
        print(f"  {outcome.call} {outcome.kind} after {outcome.share:.3f} of its timeout")
    most = max(outcome.share for outcome in outcomes)
    waited = kinds["waited"] / len(outcomes)
    return all(
        [
            holds("longest call, of its timeout", most, AT_MOST),
            holds("share of calls that did not wait", 1 - waited, MOST_THAT_DO_NOT_WAIT),
        ]
    )


def main(names: list[str]) -> bool:
    """Make every call; return whether the bounds hold."""
    with peer("ignore") as other, ThreadPoolExecutor(AT_ONCE) as pool:

        def threads(made: list[Call]) -> list[Outcome]:
            return list(pool.map(lambda call: ask(call, other.url), made))

        def tasks(made: list[Call]) -> list[Outcome]:
            return asyncio.run(all_asyncio(made, other.url))

        kept = report("threads", patiently(threads, list(calls(THREADS, names))))
        kept &= report("asyncio", patiently(tasks, list(calls(ASYNCIO, names))))
    return kept


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--units", nargs="+", default=[], help="only these")
    sys.exit(0 if main(parser.parse_args().units) else 1)
