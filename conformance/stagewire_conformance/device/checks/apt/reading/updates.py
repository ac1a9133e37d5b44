"""Checks that status messages come between start and stop, and that nothing else comes.

- ``updates``: status messages come when they are started, and end when they are stopped (pages 11 and 20).
- ``quiet``: nothing unsolicited comes (page 11), except status and error messages. Status messages may still
  be running from another program, so this check stops them first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import CHANNEL, DELIVERY, EFFECT, ENDED, Cause, silence
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_channel, rule_of_stray
from stagewire_conformance.device.checks.apt.clean import clean_request
from stagewire_conformance.device.checks.apt.replies import (
    judge_addresses,
    judge_message,
    judge_unasked,
    wrong_addresses,
)
from stagewire_conformance.device.checks.apt.streams import (
    LATE,
    Stream,
    judge_ended,
    streams_of,
    unstopped,
)
from stagewire_conformance.device.checks.apt.wording import described, joined, raw_of
from stagewire_conformance.device.lines.line import Jitter, jitter_of, percentile
from stagewire_conformance.registry import about

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial

FIXED: Final = frozenset({"BBD101", "BBD102", "BBD103"})
"""Units whose rate the document calls fixed (page 20); for others it states a typical rate (page 11)."""

_TOLERANCE: Final = 0.1
"""The relative tolerance of the average rate."""

_SIGN_PERIOD: Final = 0.9
"""Seconds between keep-alive messages, which are due at least once a second (pages 80 and 105)."""

_GONE: Final = 1.0
"""Seconds without a message after which the stream has ended."""


def run_rate(trial: Trial, streams: Sequence[Stream], seconds: float) -> None:
    """Count status messages for ``seconds``, with as few keep-alive messages as the document allows."""
    jitter = jitter_of(trial.line)
    for stream in streams:
        trial.depends_on(
            Cause(stream.status, DELIVERY), silence(stream.place.name), *wrong_addresses(trial)
        )
        stream.begin(trial)
    began = trial.line.now
    heard = _listen(trial, streams, seconds)
    ended = trial.line.now
    for stream in streams:
        stream.end(trial)
    # Both ends of the measurement may be late, and the time between them wrong by as much.
    blurred = jitter.blurs(_TOLERANCE * seconds / 2)
    for stream in streams:
        for number, came in stream.by_channel(heard).items():
            if not came and stream.of_it(heard):
                continue  # the document describes status messages of channel 1 only
            if _goes_on(trial, stream, number, came, began, ended) and not blurred:
                judge_rate(trial, stream, number, came, _TOLERANCE)
    if blurred:
        trial.inconclusive(f"the rate of status messages cannot be judged: {jitter}")
    _measure(trial, [came for s in streams for came in s.by_channel(heard).values()], jitter)


def judge_rate(
    trial: Trial, stream: Stream, number: int, came: Sequence[Incoming], off: float
) -> None:
    """Report whether the status messages of one channel come at the right rate.

    :param off: the relative tolerance of the rate.
    """
    if len(came) < 2:
        return
    unit = stream.place.unit
    due = unit.update_rate_hz or 10
    rate = _rate(came)
    (trial.must if unit.name in FIXED else trial.should)(
        abs(rate - due) <= off * due,
        f"{stream.status} for channel {number} from {stream.place.name} came {rate:.2f} times a "
        f"second ({len(came)} messages in {_span(came):.2f} s); it should come {due} times a "
        f"second, within {off:.0%}",
        rule=_RATE if unit.name in FIXED else "status-updates-every-100-ms",
        cause=Cause(stream.status, "rate"),
        because=unstopped(trial.declared),
    )


def _listen(trial: Trial, streams: Sequence[Stream], seconds: float) -> list[Incoming]:
    """Return the received messages, and send as few keep-alive messages as the targets require."""
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
    """Report status messages that end before they are stopped; return whether they continue."""
    place = stream.place
    last = came[-1].time if came else began
    alive = stream.sign if trial.declared.wants_signs else ""
    said = f", though {alive} was sent every {_SIGN_PERIOD:g} s" if alive else ""
    # A unit without a keep-alive message may also fall silent on USB: pages 80 and 105 name no units.
    is_certain = alive or trial.declared.pics.line != "usb"
    return (trial.must if is_certain else trial.should)(
        last > ended - _GONE,
        f"{stream.status} for channel {number} from {place.name} came {len(came)} times, the "
        f"last one {last - began:.1f} s after the start{said}; it should continue until it is "
        "stopped",
        rule="updates-until-stop",
        cause=Cause(stream.status, ENDED if came else DELIVERY),
    )


def _measure(trial: Trial, series: Sequence[Sequence[Incoming]], jitter: Jitter) -> None:
    """Record the measurements of the channel whose rate is furthest off."""
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
"""Seconds during which only the first target is started, or only the first is stopped."""

_PERIOD: Final = 1.0
"""Seconds in which a running stream sends at least one message, even at a low rate."""

_ROUGHLY: Final = 0.4
"""The relative tolerance of the rate over so short a time."""

_RATE: Final = "update-rate-fixed"
"""The rule for the units that it names."""

_RATE_SECONDS: Final = 10.0


UPDATES = Kind(
    name="updates",
    title="Status messages arrive ten times a second from start to stop",
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
    """Return the rules that apply to the controller."""
    rules = [rule for rule in UPDATES.rules if rule != _RATE or declared.unit.name in FIXED]
    return about(
        declared.registry, rules, messages, bays=any(place.bay for place in declared.places)
    )


def _signs(streams: Sequence[Stream]) -> tuple[str, ...]:
    """Return the keep-alive messages of the streams."""
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
    "Status messages arrive from start to stop, and only from the targets that were started",
    name="start-stop",
    seconds=_SECONDS + 1.5,
    each=lambda declared, allowed: _streams(declared, signs=False),
)
def _run(trial: Trial, streams: Sequence[Stream]) -> None:
    line = trial.line
    trial.depends_on(*(silence(stream.place.name) for stream in streams), *wrong_addresses(trial))
    first, *others = streams
    first.begin(trial)
    heard: list[Incoming] = line.listen(_ALONE if others else 0)
    for other in others:
        trial.must(
            not (strays := other.surely(heard)),
            f"{first.start.layout.message} to {first.place.name} also started {other.status} "
            f"from {other.place.name}; a message to one bay should not affect another",
            rule="slot-addressed-by-destination",
            cause=first.shared_start,
            came=raw_of(strays[:1]),
        )
        other.begin(trial)
    heard += line.listen(_SECONDS / 2)
    if (request := clean_request(trial.declared)) is not None:  # requests are answered as usual
        trial.reply(request.message, request.place.address)
    heard += line.listen(_SECONDS / 2)
    _judge(trial, streams, heard)
    _stop(trial, first, [other for other in others if other.of_it(heard)])


def _judge(trial: Trial, streams: Sequence[Stream], heard: Sequence[Incoming]) -> None:
    """Report what is wrong with the received messages; of several with the same fault, only the first."""
    theirs: list[Incoming] = []
    lost = _of_no_stream(streams, heard)
    for stream in streams:
        mine = stream.of_it(heard)
        theirs += mine
        place = stream.place
        if not mine and lost:
            judge_addresses(trial, place, lost[0])
            continue
        kinds = {(each.raw[:6], each.channel): each for each in reversed(mine)}
        for each in kinds.values():
            judge_message(trial, place, None, each)
            trial.must(
                each.channel in (*place.channels, None),
                f"{each.name} from {place.name} is for channel {each.channel}; the target has "
                f"{' and '.join(map(str, place.channels))}",
                rule=rule_of_channel(trial, each.name),
                cause=Cause(each.name, CHANNEL),
                came=each.raw,
            )
        damaged = [
            each for each in joined(heard) if not each.name and _is_like(trial, stream, each)
        ]
        trial.must(
            len(mine) > 1,
            f"{place.name} sent {stream.status} {len(mine)} times within {_SECONDS:g} s after "
            f"{stream.start.layout.message}; it should be sent periodically, typically every "
            "100 ms",
            rule="status-updates-periodic"
            if mine
            else rule_of_stray(trial, damaged[0])
            if damaged
            else "updates-start",
            cause=trial.likely(Cause(stream.status, DELIVERY), silence(place.name)),
            came=raw_of(mine or damaged[:1]),
        )
        for number, came in stream.by_channel(mine).items():
            judge_rate(trial, stream, number, came, _ROUGHLY)
            if mine and not came:
                trial.info(
                    f"{place.name} sent no {stream.status} for channel {number}; the document "
                    "describes it for channel 1 only"
                )
    for each in heard:
        if each not in theirs:
            judge_unasked(trial, each, "while status messages were running")


def _of_no_stream(streams: Sequence[Stream], heard: Sequence[Incoming]) -> list[Incoming]:
    """Return the status messages from an address that has no stream, such as that of the motherboard."""
    mine = [each for stream in streams for each in stream.of_it(heard)]
    names = {stream.status for stream in streams}
    return [each for each in heard if each.name in names and each not in mine]


def _stop(trial: Trial, first: Stream, others: Sequence[Stream]) -> None:
    """Stop the first target, and then the others: each must end with its own stop."""
    line = trial.line
    first.end(trial)
    if others:
        line.listen(LATE)
        heard = line.listen(_ALONE)
        judge_ended(trial, first, heard)
        if not all(other.of_it(heard) for other in others):
            heard += line.listen(_PERIOD)
        for other in others:
            trial.must(
                bool(other.of_it(heard)),
                f"{first.stop.layout.message} to {first.place.name} also stopped {other.status} "
                f"from {other.place.name}; a message to one bay should not affect another",
                rule="slot-addressed-by-destination",
                because=(first.shared_start,),
            )
            other.end(trial)
    line.listen(LATE)
    heard = line.listen(_ALONE)
    for stream in others or (first,):
        judge_ended(trial, stream, heard)


def _is_like(trial: Trial, stream: Stream, heard: Incoming) -> bool:
    """Return whether bytes begin like the status message of a stream."""
    id: int = trial.declared.registry.messages[stream.status]["id"]
    return heard.raw[:2] == id.to_bytes(2, "little")


UPDATES.check(
    "Status messages arrive ten times a second, and continue while the host sends keep-alive "
    "messages",
    name="rate",
    seconds=_RATE_SECONDS + 1,
    each=lambda declared, allowed: _streams(declared, signs=True),
)(partial(run_rate, seconds=_RATE_SECONDS))


_QUIET_SECONDS: Final = 0.8


QUIET = Kind(
    name="quiet",
    title="The controller sends nothing unsolicited",
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


@QUIET.check("The controller sends nothing unsolicited", seconds=_QUIET_SECONDS, each=_claimed)
def _stay_quiet(trial: Trial, streams: list[Stream]) -> None:
    heard = trial.line.listen(_QUIET_SECONDS)
    running = [each for stream in streams for each in stream.of_it(heard)]
    for each in joined(heard):
        judge_unasked(trial, each, "without any request")
    if not running:
        return
    trial.info(
        f"status updates were running when the run began ({described(trial, running[:1])}); "
        "they were stopped"
    )
    for stream in streams:
        stream.end(trial)
    trial.line.listen(LATE)
    heard = trial.line.listen(_QUIET_SECONDS)
    late = [each for stream in streams for each in stream.of_it(heard)]
    trial.must(
        not late,
        f"{len(late)} status messages came within {_QUIET_SECONDS:g} s after they were stopped; "
        f"the first was {described(trial, late[:1])}",
        rule="updates-stop",
        cause=Cause(streams[0].stop.layout.message, EFFECT),
        because=unstopped(trial.declared),
        came=raw_of(late[:1]),
    )
