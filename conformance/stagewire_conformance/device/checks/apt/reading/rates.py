"""How often status messages come: ten times a second, as long as the host is alive (pages 11, 20, 80)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.checks.apt.streams import Stream
from stagewire_conformance.device.lines.line import Jitter, jitter_of, percentile

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Heard
    from stagewire_conformance.device.trial import Trial


FIXED: Final = frozenset({"BBD101", "BBD102", "BBD103"})
"""Units whose rate the document calls fixed (page 20); of others it says what is typical (page 11)."""

_TOLERANCE: Final = 0.1
"""By which part of itself the rate may be off in the long run."""

_SIGN_PERIOD: Final = 0.9
"""Seconds between two signs of life, which are due at least once a second (pages 80 and 105)."""

_GONE: Final = 1.0
"""Seconds without a message after which they have ended."""


def run_rate(trial: Trial, streams: Sequence[Stream], seconds: float) -> None:
    """Count status messages for ``seconds``, giving signs of life as seldom as the document allows."""
    jitter = jitter_of(trial.line)
    for stream in streams:
        stream.begin(trial)
    began = trial.line.now
    heard = _listen(trial, streams, seconds)
    ended = trial.line.now
    for stream in streams:
        stream.end(trial)
    # Both ends of what is counted may be late, and the time between them be wrong by as much.
    blurred = jitter.blurs(_TOLERANCE * seconds / 2)
    for stream in streams:
        for number, came in stream.by_channel(heard).items():
            if not came and stream.of_it(heard):
                continue  # of another channel: the document has status messages of channel 1 only
            if _goes_on(trial, stream, number, came, began, ended) and not blurred:
                judge_rate(trial, stream, number, came, _TOLERANCE)
    if blurred:
        trial.inconclusive(f"nothing can be said of the rate of status messages: {jitter}")
    _measure(trial, [came for s in streams for came in s.by_channel(heard).values()], jitter)


def judge_rate(
    trial: Trial, stream: Stream, number: int, came: Sequence[Heard], off: float
) -> None:
    """Say whether status messages of one channel come as often as they should.

    :param off: by which part of itself the rate may be wrong.
    """
    if len(came) < 2:
        return
    unit = stream.place.unit
    due = unit.update_rate_hz or 10
    rate = _rate(came)
    (trial.must if unit.name in FIXED else trial.should)(
        abs(rate - due) <= off * due,
        f"{stream.status} of channel {number} from {stream.place.name} came {rate:.2f} times a second "
        f"({len(came)} of them in {_span(came):.2f} s); it should come {due} times, give or take {off:.0%}",
    )


def _listen(trial: Trial, streams: Sequence[Stream], seconds: float) -> list[Heard]:
    """Return what comes; signs of life go to the places that want some, as seldom as may be."""
    heard: list[Heard] = []
    end = trial.line.now + seconds
    with trial.line.silent():
        while (left := end - trial.line.now) > 0:
            for stream in streams if trial.declared.wants_signs else ():
                stream.give_sign(trial)
            heard += trial.line.listen(min(left, _SIGN_PERIOD))
    return heard


def _goes_on(
    trial: Trial, stream: Stream, number: int, came: Sequence[Heard], began: float, ended: float
) -> bool:
    """Say that status messages end before they are stopped; return whether they do not."""
    place = stream.place
    last = came[-1].time if came else began
    alive = stream.sign if trial.declared.wants_signs else ""
    said = f", though {alive} was sent every {_SIGN_PERIOD:g} s" if alive else ""
    # On USB a unit whose list has no sign of life may fall silent all the same: pages 80 and 105 name none.
    is_certain = alive or trial.declared.pics.line != "usb"
    return (trial.must if is_certain else trial.should)(
        last > ended - _GONE,
        f"{stream.status} of channel {number} from {place.name} came {len(came)} times, the last one "
        f"{last - began:.1f} s after the start{said}; it should come until it is stopped",
    )


def _measure(trial: Trial, series: Sequence[Sequence[Heard]], jitter: Jitter) -> None:
    """Note what was measured, of the channel whose rate is the farthest off."""
    measured = [came for came in series if len(came) > 1]
    if not measured:
        return
    came = max(measured, key=lambda each: abs(_rate(each) - 10))
    gaps = [(later.time - each.time) * 1e3 for each, later in pairwise(came)]
    trial.info(
        f"status messages came {_rate(came):.2f} times a second; {jitter}",
        rate_hz=round(_rate(came), 3),
        interval_p50_ms=round(percentile(gaps, 50), 3),
        interval_p99_ms=round(percentile(gaps, 99), 3),
        jitter_ms=round(jitter.late * 1e3, 3),
    )


def _rate(came: Sequence[Heard]) -> float:
    return (len(came) - 1) / max(_span(came), 1e-9)


def _span(came: Sequence[Heard]) -> float:
    return came[-1].time - came[0].time
