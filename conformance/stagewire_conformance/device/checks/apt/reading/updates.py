"""Whether status messages come when they are started, and end when they are stopped (pages 11 and 20)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.clean import clean_request
from stagewire_conformance.device.checks.apt.reading.rates import FIXED, judge_rate, run_rate
from stagewire_conformance.device.checks.apt.replies import judge_message, judge_unasked
from stagewire_conformance.device.checks.apt.streams import Stream, streams_of
from stagewire_conformance.device.checks.apt.wording import described, raw_of
from stagewire_conformance.device.rules import about

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.lines.dialogue import Heard
    from stagewire_conformance.device.trial import Trial


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


KIND = Kind(
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


def _rules(declared: Declared, messages: Sequence[str]) -> tuple[str, ...]:
    """Return the rules that hold for the controller."""
    rules = [rule for rule in KIND.rules if rule != _RATE or declared.unit.name in FIXED]
    return about(
        declared.registry, rules, messages, bays=any(place.bay for place in declared.places)
    )


def _signs(streams: Sequence[Stream]) -> tuple[str, ...]:
    """Return the messages that keep places alive."""
    return tuple(dict.fromkeys(stream.sign for stream in streams if stream.sign))


def _streams(declared: Declared, signs: bool) -> Iterator[Case]:
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


@KIND.check(
    "Status messages come from the start to the stop, and from where they were started",
    name="start-stop",
    seconds=_SECONDS + 1.5,
    each=lambda declared, allowed: _streams(declared, signs=False),
)
def _run(trial: Trial, streams: Sequence[Stream]) -> None:
    line = trial.line
    first, *others = streams
    first.begin(trial)
    heard: list[Heard] = line.listen(_ALONE if others else 0)
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


def _judge(trial: Trial, streams: Sequence[Stream], heard: Sequence[Heard]) -> None:
    """Say what is wrong with what came; of messages that have the same thing wrong, of the first."""
    theirs: list[Heard] = []
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


def _judge_ended(trial: Trial, stream: Stream, heard: Sequence[Heard]) -> None:
    late = _surely(stream, heard)
    trial.must(
        not late,
        f"{stream.stop.layout.message} to {stream.place.name} was followed, more than {_LATE:g} s later, by "
        f"{described(trial, late)}; nothing should come any more",
        came=raw_of(late[:1]),
    )


def _surely(stream: Stream, heard: Sequence[Heard]) -> list[Heard]:
    """Return what came from the place of a stream and from no other."""
    mine = stream.place.address
    return [
        each for each in heard if each.name == stream.status and mine in (each.source, each.dest)
    ]


KIND.check(
    "Status messages come ten times a second, and go on as long as the host is alive",
    name="rate",
    seconds=_RATE_SECONDS + 1,
    each=lambda declared, allowed: _streams(declared, signs=True),
)(partial(run_rate, seconds=_RATE_SECONDS))
