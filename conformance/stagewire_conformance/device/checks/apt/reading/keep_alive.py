"""Whether a controller falls silent when its host does, and goes on with it (pages 80 and 105).

What the document leaves open is left open here: "about 50 commands" and "50 status messages" stand side by
side, and it does not say whether they are counted by channel, by bay or over the line, nor whether a sign of
life alone makes a controller go on that has fallen silent.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.clean import clean_request
from stagewire_conformance.device.checks.apt.streams import Stream, streams_of
from stagewire_conformance.device.checks.apt.wording import described, raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_DUE: Final = 50
_ABOUT: Final = 5
"""By how many the document's "~50" may be missed."""

_TOO_MANY: Final = 65
"""Status messages of one channel after which a controller plainly does not fall silent."""

_SILENCE: Final = 0.8
"""Seconds without a status message after which a controller has fallen silent: eight of them are missing."""

_FIRST: Final = 3.0
"""Seconds in which two of them come, however seldom they are."""

_SLICE: Final = 0.2
"""Seconds after which it is seen whether anything came."""

_SIGN_ALONE: Final = 0.1
"""Seconds in which an answer to a sign of life, of which there is none, would come."""

_LONGEST: Final = 15.0
"""Seconds that a controller is listened to, at most."""

_AGAIN: Final = 1.0
"""Seconds after a sign of life in which status messages have to come again."""

_WHILE_SILENT: Final = 0.5
"""Seconds in which a controller that has fallen silent may answer a question."""


KIND = Kind(
    name="keep-alive",
    title="The controller falls silent when the host does, and goes on when the host is there again",
    rules=(
        "keep-alive-fifty",
        "keep-alive-counts-status",
        "keep-alive-no-response",
        "piezo-keep-alive-fifty",
        "piezo-keep-alive-counts-status",
        "piezo-keep-alive-no-response",
    ),
)


def _on_usb(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    """Give one case, of all places at once: each of them takes six seconds."""
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


@KIND.check(
    "Status messages end about 50 after the last sign of life, and go on with the next one",
    seconds=8.0,
    each=_on_usb,
)
def _run(trial: Trial, streams: Sequence[Stream]) -> None:
    line = trial.line
    with line.silent():
        for stream in streams:
            stream.give_sign(trial)
            stream.begin(trial)
        heard, quiet = _until_silent(trial, streams)
        if _judge_silence(trial, streams, heard, quiet):
            _ask_while_silent(trial)
            _judge_return(trial, streams, _rate(heard, len(streams)))
        for stream in streams:
            stream.end(trial)
        line.drain()
        for stream in streams:
            stream.give_sign(trial)
            came = line.listen(_SIGN_ALONE)
            trial.must(
                not came,
                f"{stream.sign} to {stream.place.name} was answered with {described(trial, came)}; "
                "there is no response",
                came=raw_of(came),
            )


def _until_silent(trial: Trial, streams: Sequence[Stream]) -> tuple[list[Incoming], float]:
    """Return all status messages until none come any more, or it is plain that they go on.

    And for how long none may come while they do: longer where they are seldom.
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
    """Say what is wrong with when the places fell silent; return whether they did."""
    now = trial.line.now
    total = len(heard)
    silent = True
    for stream in streams:
        mine = stream.of_it(heard)
        counts = {number: len(came) for number, came in stream.by_channel(heard).items() if came}
        place, name = stream.place.name, stream.sign
        trial.need(
            bool(mine), f"no {stream.status} came from {place} after {stream.start.layout.message}"
        )
        goes_on = now - mine[-1].time < quiet
        silent = silent and not goes_on
        if goes_on and max(counts.values()) < _TOO_MANY:
            trial.inconclusive(
                f"{stream.status} came {len(mine)} times from {place} in {_LONGEST:g} s, too seldom to see "
                f"the {_DUE} after which it should end"
            )
            continue
        trial.must(
            not goes_on,
            f"{place} has sent {stream.status} {len(mine)} times without {name}, and goes on; it should "
            f"send no more after about {_DUE}",
            came=mine[-1].raw,
        )
        right = any(map(_is_due, (total, len(mine)))) or all(map(_is_due, counts.values()))
        trial.must(
            goes_on or right,
            f"{place} has sent {stream.status} {_counted(counts)} without {name}, and then no more; it "
            f"should end after about {_DUE}",
            came=mine[-1].raw,
        )
    return silent


def _is_due(count: int) -> bool:
    return abs(count - _DUE) <= _ABOUT


def _counted(counts: dict[int, int]) -> str:
    if len(counts) == 1:
        return f"{sum(counts.values())} times"
    of_each = ", ".join(f"{count} of channel {number}" for number, count in counts.items())
    return f"{sum(counts.values())} times ({of_each})"


def _rate(heard: Sequence[Incoming], places: int) -> float:
    """Return how many messages came a second from one place."""
    span = heard[-1].time - heard[0].time
    return (len(heard) - 1) / span / places if span > 0 else 1.0


def _ask_while_silent(trial: Trial) -> None:
    """Note whether questions are answered: "stop responding" and "status messages" stand side by side."""
    request = clean_request(trial.declared)
    if request is not None:
        reply = trial.line.ask(request.message, request.place.address, wait=_WHILE_SILENT)
        said = "not answered" if reply is None else "answered"
        trial.info(
            f"while the controller was silent, {request.about} was {said}; the document leaves it open"
        )


def _judge_return(trial: Trial, streams: Sequence[Stream], rate: float) -> None:
    """Give a sign of life: status messages have to come again, if need be when they are started again."""
    several = max(1, int(rate * _AGAIN * 0.4))
    for stream in streams:
        stream.give_sign(trial)
    mute = _mute(trial, streams, several)
    for stream in mute:
        stream.begin(trial)
    dead = _mute(trial, mute, several)
    for stream in mute:
        place, name, start = stream.place.name, stream.sign, stream.start.layout.message
        text = f"{place} had fallen silent, and did not send {stream.status} as before after {name}"
        if trial.must(
            stream not in dead,
            f"{text}, nor when {start} was sent again; it should go on",
        ):
            trial.should(
                False, f"{text}, but when {start} was sent again; it should go on by itself"
            )


def _mute(trial: Trial, streams: Sequence[Stream], several: int) -> list[Stream]:
    """Return those of which not even ``several`` status messages come within a second."""
    heard: list[Incoming] = []
    end = trial.line.now + _AGAIN
    mute = list(streams)
    while mute and (left := end - trial.line.now) > 0:
        heard += trial.line.listen(min(left, _SLICE))
        mute = [stream for stream in mute if len(stream.of_it(heard)) < several]
    return mute
