"""Checks that a controller stops its status messages without a host, and resumes them (pages 80 and 105).

The checks leave open what the document leaves open. It gives both "about 50 commands" and "50 status
messages", and does not say whether they are counted per channel, per bay or per line. It also does not say
whether a keep-alive message alone makes a silent controller resume.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import DELIVERY, ENDED, UNSOLICITED, Cause, silence
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.broken_rules import ANSWERED
from stagewire_conformance.device.checks.apt.clean import clean_request
from stagewire_conformance.device.checks.apt.streams import Stream, streams_of, unstopped
from stagewire_conformance.device.checks.apt.wording import described, raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_DUE: Final = 50
_DUE_OF: Final = {"PZMOT_ACK_STATUSUPDATE": 10}
"""The number of status messages for a keep-alive message with another number (Issue 37, page 406)."""

_SECONDS_OF_TEN: Final = 2.4
"""The duration of the check if ten messages are due."""

_ABOUT: Final = 5
"""The tolerance of the document's "~50"."""

_TOO_MANY: Final = 65
"""Status messages of one channel after which a controller clearly does not fall silent."""

_SILENCE: Final = 0.8
"""Seconds without a status message after which a controller has fallen silent: eight are missing."""

_FIRST: Final = 3.0
"""Seconds in which two status messages arrive, even at a low rate."""

_SLICE: Final = 0.2
"""Seconds between two looks at the received messages."""

_SIGN_ALONE: Final = 0.1
"""Seconds in which a reply to a keep-alive message would arrive; there should be none."""

_BEFORE_SIGN: Final = 0.25
"""Seconds without a message before a keep-alive message whose reply is looked for."""

_LONGEST: Final = 15.0
"""The maximum time in seconds to listen to a controller."""

_AGAIN: Final = 1.0
"""Seconds after a keep-alive message in which status messages must resume."""

_WHILE_SILENT: Final = 0.5
"""Seconds in which a silent controller may answer a request."""


_OF_SIGN: Final = {
    "LA_ACK_STATUSUPDATE": "laser-keep-alive",
    "LD_ACK_STATUSUPDATE": "laser-keep-alive",
    "TEC_ACK_STATUSUPDATE": "tec-keep-alive",
    "PZ_ACK_NTSTATUSUPDATE": "nanotrak-keep-alive",
    "PZMOT_ACK_STATUSUPDATE": "pzmot-keep-alive",
    "QUAD_ACK_STATUSUPDATE": "quad-keep-alive",
}

KIND = Kind(
    name="keep-alive",
    title="Status messages stop without keep-alive messages, and resume with the next one",
    rules=(
        "keep-alive-fifty",
        "keep-alive-counts-status",
        "piezo-keep-alive-fifty",
        "piezo-keep-alive-counts-status",
        "laser-keep-alive",
        "tec-keep-alive",
        "nanotrak-keep-alive",
        "pzmot-keep-alive",
        "quad-keep-alive",
    ),
)

REPLY = Kind(
    name="keep-alive-reply",
    title="A keep-alive message gets no response",
    rules=(
        "keep-alive-no-response",
        "piezo-keep-alive-no-response",
        "laser-keep-alive",
        "tec-keep-alive",
        "nanotrak-keep-alive",
        "pzmot-keep-alive",
        "quad-keep-alive",
    ),
)


def _on_usb(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    """Yield one case for all targets together: each of them would take six seconds."""
    if declared.pics.line != "usb":
        return
    streams = [each for each in streams_of(declared) if each.place.unit.keep_alive is not None]
    if not streams:
        return
    sign = streams[0].place.unit.keep_alive
    assert sign is not None
    name = sign.layout.message
    claimed = [each for each in streams if each.place.keep_alive is not None and not each.skip]
    yield Case(
        arguments={"streams": claimed},
        messages=(name, *(each for stream in streams for each in stream.messages)),
        skip="" if claimed else streams[0].place.why_not(name) or streams[0].skip,
    )


def _until_silent_on_usb(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    """Yield the same case, which is shorter if fewer messages are due."""
    for case in _on_usb(declared, allowed):
        short = next(iter(case.messages)) in _DUE_OF
        yield replace(case, seconds=_SECONDS_OF_TEN if short else None)


@REPLY.check("A keep-alive message gets no response", seconds=0.5, each=_on_usb)
def _reply(trial: Trial, streams: Sequence[Stream]) -> None:
    """Send each keep-alive message once. If status messages are running, nothing can show its reply."""
    line = trial.line
    with line.silent():
        for stream in streams:
            stream.end(trial)
        line.drain()
        if line.listen(_BEFORE_SIGN):
            trial.inconclusive(
                "messages come without a request, so a reply could not be recognised"
            )
            return
        for stream in streams:
            stream.give_sign(trial)
            came = line.listen(_SIGN_ALONE)
            trial.must(
                not came,
                f"{stream.sign} to {stream.place.name} was answered with "
                f"{described(trial, came)}; it should get no response",
                rule=_rule(stream, "no-response"),
                cause=Cause(stream.sign, UNSOLICITED),
                came=raw_of(came),
            )


@KIND.check(
    "Status messages stop without keep-alive messages, after about as many as the document states, and "
    "resume with the next one",
    seconds=6.4,
    each=_until_silent_on_usb,
)
def _run(trial: Trial, streams: Sequence[Stream]) -> None:
    line = trial.line
    with line.silent():
        trial.depends_on(*unstopped(trial.declared))
        for stream in streams:
            status = (Cause(stream.status, aspect) for aspect in (DELIVERY, ENDED))
            trial.depends_on(*status, silence(stream.place.name))
            stream.give_sign(trial)
            stream.begin(trial)
        heard, quiet = _until_silent(trial, streams)
        if _judge_silence(trial, streams, heard, quiet):
            _ask_while_silent(trial)
            _judge_return(trial, streams, _rate(heard, len(streams)))
        for stream in streams:
            stream.end(trial)


def _until_silent(trial: Trial, streams: Sequence[Stream]) -> tuple[list[Incoming], float]:
    """Return the status messages until they stop or clearly continue, and the longest pause to allow.

    The pause is longer for a lower rate.
    """
    line = trial.line
    heard: list[Incoming] = []
    quiet = _FIRST
    began = last = line.now
    while line.now - last < quiet and line.now - began < _LONGEST:
        new = line.listen(_SLICE)
        came = [each for stream in streams for each in stream.of_it(new)]
        heard += came
        last = line.now if came else last
        if any(len(each) >= _TOO_MANY for s in streams for each in s.by_channel(heard).values()):
            break
        if len(heard) > 1:
            gaps = [later.time - each.time for each, later in pairwise(heard)]
            quiet = max(_SILENCE, 4 * max(gaps))
    return heard, quiet


def _judge_silence(
    trial: Trial, streams: Sequence[Stream], heard: Sequence[Incoming], quiet: float
) -> bool:
    """Report what is wrong with the number of status messages; return whether all targets fell silent."""
    now = trial.line.now
    total = len(heard)
    silent = True
    for stream in streams:
        mine = stream.of_it(heard)
        counts = {number: len(came) for number, came in stream.by_channel(heard).items() if came}
        place, name = stream.place.name, stream.sign
        due = _DUE_OF.get(name, _DUE)
        trial.need(
            bool(mine),
            f"{place} sent no {stream.status} after {stream.start.layout.message}",
            rule=ANSWERED,
            cause=Cause(stream.status, DELIVERY),
        )
        goes_on = now - mine[-1].time < quiet
        silent = silent and not goes_on
        if goes_on and max(counts.values()) < _TOO_MANY:
            trial.inconclusive(
                f"{place} sent {stream.status} {len(mine)} times in {_LONGEST:g} s, too rarely "
                f"to show whether it stops after about {due}"
            )
            continue
        if goes_on and not _is_printed(trial, stream):
            trial.inconclusive(
                f"{place} sent {stream.status} {_counted(counts)} after the last {name} and did not "
                f"stop; that is allowed, because the document's lists of the messages of "
                f"{stream.place.unit.name} omit {name}"
            )
            continue
        trial.must(
            not goes_on,
            f"{place} sent {stream.status} {_counted(counts)} after the last {name} and did not stop; "
            f"it should stop after about {due} status messages",
            rule=_rule(stream, "fifty"),
            came=mine[-1].raw,
        )
        right = any(abs(count - due) <= _ABOUT for count in (total, len(mine))) or all(
            abs(count - due) <= _ABOUT for count in counts.values()
        )
        trial.must(
            goes_on or right,
            f"{place} stopped after it had sent {stream.status} {_counted(counts)} after the last {name}; it "
            f"should stop after about {due} status messages",
            rule=_rule(stream, "counts-status"),
            cause=Cause(stream.status, ENDED) if len(mine) < due else None,
            came=mine[-1].raw,
        )
    return silent


def _is_printed(trial: Trial, stream: Stream) -> bool:
    """Return whether a printed list of the unit has the keep-alive message, not only the registry."""
    registry = trial.declared.registry
    unit, lists = registry.table("units")[stream.place.unit.name], registry.data["lists"]
    own = [lists[name] for name in (unit.get("list"), *unit.get("more_lists", ())) if name in lists]
    return not any(stream.sign in each.get("completes", ()) for each in own) or any(
        stream.sign in each["messages"] for each in own
    )


def _rule(stream: Stream, name: str) -> str:
    """Return a rule about the keep-alive messages of motors or of piezo actuators."""
    if stream.sign in _OF_SIGN:
        return _OF_SIGN[stream.sign]  # their pages have one rule for all
    return f"piezo-keep-alive-{name}" if stream.sign.startswith("PZ_") else f"keep-alive-{name}"


def _counted(counts: dict[int, int]) -> str:
    if len(counts) == 1:
        return f"{sum(counts.values())} times"
    of_each = ", ".join(f"{count} for channel {number}" for number, count in counts.items())
    return f"{sum(counts.values())} times ({of_each})"


def _rate(heard: Sequence[Incoming], places: int) -> float:
    """Return how many messages per second came from one target."""
    span = heard[-1].time - heard[0].time
    return (len(heard) - 1) / span / places if span > 0 else 1.0


def _ask_while_silent(trial: Trial) -> None:
    """Note whether requests are answered: the document has both "stop responding" and "status messages"."""
    request = clean_request(trial.declared)
    if request is not None:
        reply = trial.line.ask(request.message, request.place.address, wait=_WHILE_SILENT)
        said = "not answered" if reply is None else "answered"
        trial.info(
            f"while the controller was silent, {request.about} was {said}; the document "
            "leaves this open"
        )


def _judge_return(trial: Trial, streams: Sequence[Stream], rate: float) -> None:
    """Send a keep-alive message: status messages must resume, if necessary after they are started again."""
    several = max(1, int(rate * _AGAIN * 0.4))
    for stream in streams:
        stream.give_sign(trial)
    mute = _mute(trial, streams, several)
    for stream in mute:
        stream.begin(trial)
    dead = _mute(trial, mute, several)
    for stream in mute:
        place, name, start = stream.place.name, stream.sign, stream.start.layout.message
        text = (
            f"{place} had fallen silent, and did not resume {stream.status} at its former rate "
            f"after {name}"
        )
        if trial.must(
            stream not in dead,
            f"{text}, nor after {start} was sent again; it should resume",
            rule=_rule(stream, "counts-status"),
        ):
            trial.should(
                False,
                f"{text}, only after {start} was sent again; {name} alone should be enough",
                rule=_rule(stream, "counts-status"),
            )


def _mute(trial: Trial, streams: Sequence[Stream], several: int) -> list[Stream]:
    """Return the streams with fewer than ``several`` status messages within a second."""
    heard: list[Incoming] = []
    end = trial.line.now + _AGAIN
    mute = list(streams)
    while mute and (left := end - trial.line.now) > 0:
        heard += trial.line.listen(min(left, _SLICE))
        mute = [stream for stream in mute if len(stream.of_it(heard)) < several]
    return mute
