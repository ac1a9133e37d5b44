"""Checks of response times; the document sets no limit, a vendor may promise one in the PICS.

Requests sent without pauses between them are also sent.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle, islice
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.causes import DELIVERY, UNSOLICITED, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis, Clean, line_of
from stagewire_conformance.device.checks.ms2000.axis_check import (
    SETTINGS_READ,
    AxisCase,
    axis_check,
    first_place,
    requests_of,
)
from stagewire_conformance.device.checks.ms2000.harmless import END
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.lines.command_line import QUIET
from stagewire_conformance.device.lines.line import jitter_of, percentile
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.targets import Target
from stagewire_conformance.device.trial import Trial
from stagewire_ms2000 import messages as m

_MEASURED: Final = 200


TIMING: Final = Kind(
    name="timing",
    title="Replies arrive within the time that the PICS promises",
    rules=(),
)


def _first(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    yield AxisCase(place=first_place(declared, "READ_MOTOR_POSITION"))


@axis_check(
    TIMING,
    f"99 % of {_MEASURED} replies of {{axis}} arrive within the time that the PICS promises",
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
    for _ in range(_MEASURED):
        began = line.now
        axis.ask(m.ReadMotorPosition(), quiet=0.0)
        times.append((line.now - began) * 1000)
    p50, p99 = percentile(times, 50), percentile(times, 99)
    figures = {"p50_ms": p50, "p99_ms": p99, "jitter_ms": jitter.late * 1000}
    told = (
        f"half of {_MEASURED} replies arrived within {p50:.2f} ms, 99 % within {p99:.2f} ms; "
        f"{jitter}"
    )
    if promised is None:
        trial.inconclusive(f"{told}; neither the document nor the PICS sets a limit", **figures)
    elif jitter.blurs(promised / 1000):
        trial.inconclusive(
            f"{told}, which is too late to judge the promised {promised:g} ms", **figures
        )
    else:
        trial.info(told, **figures)
        trial.must(
            p99 <= promised,
            f"99 % of the replies arrived within {p99:.2f} ms; the PICS promises {promised:g} ms",
        )


_SENT: Final = 200
_BURSTS: Final = 10
_BURST: Final = 8


def _sound(trial: Trial) -> list[tuple[Target, Command]]:
    """Return the claimed requests without those whose reply has a reported defect, unless all have one."""
    every = _claimed(trial.declared)
    found = [
        each for each in every if not trial.causes.check_of(Cause(each[1].layout.message, DELIVERY))
    ]
    return found or every


def _claimed(declared: Declaration) -> list[tuple[Target, Command]]:
    """Return the claimed requests with their axes: each request to all axes, then the next."""
    return [
        (place, request)
        for name, request in requests_of(declared).items()
        for place in declared.places
        if name in place.messages
    ]


BACK_TO_BACK: Final = Kind(
    name="back-to-back",
    title="Requests sent without pauses are answered",
    rules=("no-blanks-in-replies", "commands-processed-at-colon"),
)


def _all(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    yield Case(messages=[request.layout.message for _, request in _claimed(declared)])


@BACK_TO_BACK.check(
    f"Each of {_SENT} requests, sent immediately after the previous reply, is answered",
    name="one-by-one",
    seconds=2.0,
    each=_all,
)
def _one_by_one(trial: Trial) -> None:
    first: dict[tuple[int, str], bytes] = {}
    for number, (place, request) in enumerate(islice(cycle(_sound(trial)), _SENT), 1):
        axis, name = Axis(trial, place), request.layout.message
        came = axis.ask(request, quiet=0.0, after=f"request {number} of {_SENT}").pack()
        if name in SETTINGS_READ:
            was = first.setdefault((place.address, name), came)
            trial.must(
                came == was,
                f"request {number} of {_SENT}, {name} of axis {place.name}, was answered with "
                "other bytes than before, though nothing was set in between",
                wanted=was,
                came=came,
                rule="commands-processed-at-colon",
                cause=Cause(name, "values"),
            )
    behind = line_of(trial).listen(QUIET)
    trial.must(
        not behind,
        f"{len(behind)} bytes arrived after the last reply",
        came=behind,
        rule="no-blanks-in-replies",
        cause=Cause("the line", UNSOLICITED),
    )


@BACK_TO_BACK.check(
    f"{_BURST} requests sent without pauses get their replies and no other bytes",
    name="bursts",
    seconds=1.5,
    each=_all,
)
def _bursts(trial: Trial) -> None:
    """Send several requests sent without pauses. Some may be lost, because a colon clears the buffers."""
    line, clean = line_of(trial), Clean(trial)
    requests = cycle(_sound(trial))
    missing = 0
    for _ in range(_BURSTS):
        due = 0
        for place, request in islice(requests, _BURST):
            line.send(request, place.address)
            assert request.reply is not None
            due += request.reply.layout.length
        came = line.collect(due, about="replies to all of them")
        trial.must(
            len(came) <= due,
            f"{_BURST} requests sent without pauses should get {due} bytes; {len(came)} came",
            came=came,
            rule="commands-processed-at-colon",
        )
        missing += max(0, due - len(came))
    trial.info(
        f"in {_BURSTS} bursts of {_BURST} requests, "
        + (f"{missing} bytes are missing" if missing else "all were answered"),
        missing_bytes=missing,
    )
    if missing:  # half a request may be pending after a loss
        line.send_bytes(END, "ends a pending command")
        line.listen(QUIET)
    clean.again(f"after {_BURSTS} bursts of requests")
