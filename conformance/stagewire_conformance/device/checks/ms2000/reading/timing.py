"""How fast replies come; the document promises nothing, a vendor may."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.axis_check import AxisCase, axis_check, first_place
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.lines.line import jitter_of, percentile
from stagewire_conformance.device.permissions import Permissions
from stagewire_ms2000 import messages as m

_REQUESTS: Final = 200


KIND: Final = Kind(
    name="timing",
    title="Replies come as fast as the vendor promises",
    rules=(),
)


def _first(declared: Declared, allowed: Permissions) -> Iterator[AxisCase]:
    yield AxisCase(place=first_place(declared, "READ_MOTOR_POSITION"))


@axis_check(
    KIND,
    f"99 in 100 of {_REQUESTS} replies of {{axis}} come within what the vendor promises",
    messages=("READ_MOTOR_POSITION",),
    name="reply",
    seconds=2.0,
    each=_first,
)
def _look(axis: Axis) -> None:
    trial, line = axis.trial, axis.line
    promised = trial.declared.pics.timing.reply_p99_ms
    jitter = jitter_of(line)
    times = []
    for _ in range(_REQUESTS):
        began = line.now
        axis.ask(m.ReadMotorPosition(), quiet=0.0)
        times.append((line.now - began) * 1000)
    p50, p99 = percentile(times, 50), percentile(times, 99)
    figures = {"p50_ms": p50, "p99_ms": p99, "jitter_ms": jitter.late * 1000}
    told = f"half of {_REQUESTS} replies came within {p50:.2f} ms, 99 in 100 within {p99:.2f} ms; {jitter}"
    if promised is None:
        trial.inconclusive(f"{told}; neither the document nor the PICS has a bound", **figures)
    elif jitter.blurs(promised / 1000):
        trial.inconclusive(f"{told}, too much to judge the promised {promised:g} ms", **figures)
    else:
        trial.info(told, **figures)
        trial.must(
            p99 <= promised,
            f"99 in 100 replies came within {p99:.2f} ms; the PICS promises {promised:g} ms",
        )
