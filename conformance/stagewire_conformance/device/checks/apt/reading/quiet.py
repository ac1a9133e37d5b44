"""Whether nothing comes that nobody asked for (page 11).

Only status messages and errors come by themselves. Status messages that somebody else has started go on until
they are stopped: so they are, first of all.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.replies import judge_unasked
from stagewire_conformance.device.checks.apt.streams import Stream, streams_of
from stagewire_conformance.device.checks.apt.wording import described, joined, raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_SECONDS: Final = 0.8
_LATE: Final = 0.3
"""Seconds after a stop in which a status message may still be on its way."""


KIND = Kind(
    name="quiet",
    title="Nothing comes that nobody asked for",
    rules=(
        "get-answers-request",
        "no-error-in-normal-operation",
        "no-messages-between-modules",
        "updates-stop",
    ),
)


def _claimed(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    streams = [stream for stream in streams_of(declared) if not stream.skip]
    yield Case(
        arguments={"streams": streams},
        messages=[stream.stop.layout.message for stream in streams],
    )


@KIND.check("Nothing comes that nobody asked for", seconds=_SECONDS, each=_claimed)
def _listen(trial: Trial, streams: list[Stream]) -> None:
    heard = trial.line.listen(_SECONDS)
    running = [each for stream in streams for each in stream.of_it(heard)]
    for each in joined(heard):
        judge_unasked(trial, each, "though nothing was asked,")
    if not running:
        return
    trial.info(
        f"status updates were on when the run began ({described(trial, running[:1])}); they were stopped"
    )
    for stream in streams:
        stream.end(trial)
    trial.line.listen(_LATE)
    heard = trial.line.listen(_SECONDS)
    late = [each for stream in streams for each in stream.of_it(heard)]
    trial.must(
        not late,
        f"{len(late)} status messages came within {_SECONDS:g} s though they had been stopped, first "
        f"{described(trial, late[:1])}",
        came=raw_of(late[:1]),
    )
