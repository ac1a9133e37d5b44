"""Whether status messages come when they are started, end when they are stopped, and nothing else comes.

- ``updates``: status messages come when they are started, and end when they are stopped (pages 11 and 20).
- ``quiet``: nothing comes that nobody asked for (page 11). Only status messages and errors come by
  themselves. Status messages that somebody else has started go on until they are stopped: so they are,
  first of all.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.clean import clean_request
from stagewire_conformance.device.checks.apt.replies import judge_message, judge_unasked
from stagewire_conformance.device.checks.apt.streams import Stream, streams_of
from stagewire_conformance.device.checks.apt.wording import described, joined, raw_of
from stagewire_conformance.device.lines.line import Jitter, jitter_of, percentile
from stagewire_conformance.registry import about

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
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
    trial: Trial, stream: Stream, number: int, came: Sequence[Incoming], off: float
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


def _listen(trial: Trial, streams: Sequence[Stream], seconds: float) -> list[Incoming]:
    """Return what comes; signs of life go to the places that want some, as seldom as may be."""
    heard: list[Incoming] = []
    end = trial.line.now + seconds
    with trial.line.silent():
        while (left := end - trial.line.now) > 0:
            for stream in streams if trial.declared.wants_signs else ():
                stream.give_sign(trial)
            heard += trial.line.listen(min(left, _SIGN_PERIOD))
    return heard


def _goes_on(
    trial: Trial, stream: Stream, number: int, came: Sequence[Incoming], began: float, ended: float
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


def _measure(trial: Trial, series: Sequence[Sequence[Incoming]], jitter: Jitter) -> None:
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


def _rate(came: Sequence[Incoming]) -> float:
    return (len(came) - 1) / max(_span(came), 1e-9)


def _span(came: Sequence[Incoming]) -> float:
    return came[-1].time - came[0].time


_SECONDS: Final = 2.0
_ALONE: Final = 0.35
"""Seconds in which the first place is the only one that was started, or that was stopped."""

_LATE: Final = 0.3
"""Seconds after a stop in which a message may still be on its way."""

_PERIOD: Final = 1.0
"""Seconds in which one more message comes from what goes on, however seldom that is."""

_ROUGHLY: Final = 0.4
"""By which part of itself the rate may be off in so short a time."""

_RATE: Final = "update-rate-fixed"
"""The rule that holds for the units that it names."""

_RATE_SECONDS: Final = 30.0


UPDATES = Kind(
    name="updates",
    title="Status messages come ten times a second from the start to the stop",
    rules=(
        "status-updates-periodic",
        "status-updates-every-100-ms",
        "updates-start",
        "updates-until-stop",
        _RATE,
        "updates-stop",
        "slot-source",
        "slot-addressed-by-destination",
        "keep-alive-once-a-second",
        "keep-alive-usb-only",
        "piezo-keep-alive-once-a-second",
        "piezo-keep-alive-usb-only",
    ),
)


def _rules(declared: Declaration, messages: Sequence[str]) -> tuple[str, ...]:
    """Return the rules that hold for the controller."""
    rules = [rule for rule in UPDATES.rules if rule != _RATE or declared.unit.name in FIXED]
    return about(
        declared.registry, rules, messages, bays=any(place.bay for place in declared.places)
    )


def _signs(streams: Sequence[Stream]) -> tuple[str, ...]:
    """Return the messages that keep places alive."""
    return tuple(dict.fromkeys(stream.sign for stream in streams if stream.sign))


def _streams(declared: Declaration, signs: bool) -> Iterator[Case]:
    streams = streams_of(declared)
    claimed = [stream for stream in streams if not stream.skip]
    if streams:
        messages = [name for stream in streams for name in stream.messages]
        used = tuple(dict.fromkeys((*messages, *(_signs(claimed) if signs else ()))))
        yield Case(
            arguments={"streams": claimed},
            messages=used,
            rules=_rules(declared, used),
            skip="" if claimed else streams[0].skip,
        )


@UPDATES.check(
    "Status messages come from the start to the stop, and from where they were started",
    name="start-stop",
    seconds=_SECONDS + 1.5,
    each=lambda declared, allowed: _streams(declared, signs=False),
)
def _run(trial: Trial, streams: Sequence[Stream]) -> None:
    line = trial.line
    first, *others = streams
    first.begin(trial)
    heard: list[Incoming] = line.listen(_ALONE if others else 0)
    for other in others:
        trial.must(
            not (strays := _surely(other, heard)),
            f"{first.start.layout.message} to {first.place.name} started {other.status} from "
            f"{other.place.name}; what goes to one bay concerns no other",
            came=raw_of(strays[:1]),
        )
        other.begin(trial)
    heard += line.listen(_SECONDS / 2)
    if (request := clean_request(trial.declared)) is not None:  # is answered as ever
        trial.reply(request.message, request.place.address)
    heard += line.listen(_SECONDS / 2)
    _judge(trial, streams, heard)
    _stop(trial, first, others)


def _judge(trial: Trial, streams: Sequence[Stream], heard: Sequence[Incoming]) -> None:
    """Say what is wrong with what came; of messages that have the same thing wrong, of the first."""
    theirs: list[Incoming] = []
    for stream in streams:
        mine = stream.of_it(heard)
        theirs += mine
        place = stream.place
        kinds = {(each.raw[:6], each.channel): each for each in reversed(mine)}
        for each in kinds.values():
            judge_message(trial, place, None, each)
            trial.must(
                each.channel in place.channels,
                f"{each.name} from {place.name} is about channel {each.channel}; it has "
                f"{' and '.join(map(str, place.channels))}",
                came=each.raw,
            )
        trial.must(
            len(mine) > 1,
            f"{stream.start.layout.message} to {place.name} was followed by {stream.status} {len(mine)} "
            f"times within {_SECONDS:g} s; it should come again and again, typically every 100 ms",
            came=raw_of(mine),
        )
        for number, came in stream.by_channel(mine).items():
            judge_rate(trial, stream, number, came, _ROUGHLY)
            if mine and not came:
                trial.info(
                    f"no {stream.status} of channel {number} came from {place.name}; the document has "
                    "channel 1 only"
                )
    for each in heard:
        if each not in theirs:
            judge_unasked(trial, each, "while status messages were on,")


def _stop(trial: Trial, first: Stream, others: Sequence[Stream]) -> None:
    """Stop the first place, and then the others: each ends with its own stop."""
    line = trial.line
    first.end(trial)
    if others:
        line.listen(_LATE)
        heard = line.listen(_ALONE)
        _judge_ended(trial, first, heard)
        if not all(other.of_it(heard) for other in others):
            heard += line.listen(_PERIOD)
        for other in others:
            trial.must(
                bool(other.of_it(heard)),
                f"{first.stop.layout.message} to {first.place.name} ended {other.status} from "
                f"{other.place.name}; what goes to one bay concerns no other",
            )
            other.end(trial)
    line.listen(_LATE)
    heard = line.listen(_ALONE)
    for stream in others or (first,):
        _judge_ended(trial, stream, heard)


def _judge_ended(trial: Trial, stream: Stream, heard: Sequence[Incoming]) -> None:
    late = _surely(stream, heard)
    trial.must(
        not late,
        f"{stream.stop.layout.message} to {stream.place.name} was followed, more than {_LATE:g} s later, by "
        f"{described(trial, late)}; nothing should come any more",
        came=raw_of(late[:1]),
    )


def _surely(stream: Stream, heard: Sequence[Incoming]) -> list[Incoming]:
    """Return what came from the place of a stream and from no other."""
    mine = stream.place.address
    return [
        each for each in heard if each.name == stream.status and mine in (each.source, each.dest)
    ]


UPDATES.check(
    "Status messages come ten times a second, and go on as long as the host is alive",
    name="rate",
    seconds=_RATE_SECONDS + 1,
    each=lambda declared, allowed: _streams(declared, signs=True),
)(partial(run_rate, seconds=_RATE_SECONDS))


_QUIET_SECONDS: Final = 0.8


QUIET = Kind(
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


@QUIET.check("Nothing comes that nobody asked for", seconds=_QUIET_SECONDS, each=_claimed)
def _stay_quiet(trial: Trial, streams: list[Stream]) -> None:
    heard = trial.line.listen(_QUIET_SECONDS)
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
    heard = trial.line.listen(_QUIET_SECONDS)
    late = [each for stream in streams for each in stream.of_it(heard)]
    trial.must(
        not late,
        f"{len(late)} status messages came within {_QUIET_SECONDS:g} s though they had been stopped, first "
        f"{described(trial, late[:1])}",
        came=raw_of(late[:1]),
    )
