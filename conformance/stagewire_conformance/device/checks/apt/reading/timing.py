"""Checks of response times, reported with the timing jitter of the computer.

The document sets no limit; a vendor may promise one in the PICS.

Requests that are sent without pauses must all be answered, and each target must answer in order (page 11).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import NOW_AND_THEN, UNSOLICITED, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.broken_rules import ANSWERED
from stagewire_conformance.device.checks.apt.clean import clean_request, is_error
from stagewire_conformance.device.checks.apt.replies import (
    Request,
    is_spoilt,
    judge_unasked,
    requests_of,
    spoils,
)
from stagewire_conformance.device.checks.apt.streams import unstopped
from stagewire_conformance.device.checks.apt.wording import described, raw_of
from stagewire_conformance.device.lines.line import jitter_of, percentile
from stagewire_conformance.device.lines.strays import cause_of_stray, known_bytes

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial

_SENT: Final = 200
_BURST: Final = 10
_WAIT: Final = 1.0
"""Seconds in which the next reply of a burst must follow the previous one."""

_ENOUGH: Final = 3
"""Bursts with errors after which the check stops."""


BURSTS = Kind(
    name="back-to-back",
    title="Requests sent without pauses are all answered, in order",
    rules=("request-answered", "get-answers-request", "slot-source"),
)


def _claimed(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    requests = [
        request
        for place in declared.places
        for request in requests_of(declared, place)
        if not request.skip
    ]
    if requests:
        messages = [name for request in requests for name in request.messages]
        yield Case(messages=messages, arguments={"requests": requests})


@BURSTS.check(
    f"{_SENT} requests in bursts of {_BURST} are all answered, in order",
    seconds=0.5,
    each=_claimed,
)
def _bursts(trial: Trial, requests: Sequence[Request]) -> None:
    wrong = 0
    sound = [each for each in requests if not is_spoilt(each, trial.causes)]
    if not sound:
        trial.depends_on(*spoils(requests[0]))
    requests = sound or requests
    for number in range(_SENT // _BURST):
        burst = [trial.random.choice(requests) for _ in range(_BURST)]
        wrong += not _answered(trial, burst, together=number % 2 == 1)
        if wrong == _ENOUGH:
            return
    _judge_surplus(trial, trial.line.drain())


def _answered(trial: Trial, burst: Sequence[Request], together: bool) -> bool:
    """Send requests without pauses; return whether all were answered correctly.

    :param together: whether to send them in a single write, if the bytes of neighbours form no message.
    """
    line = trial.line
    host = trial.declared.framed.host
    raw = b"".join(request.message.pack(request.place.address, host) for request in burst)
    if together and not line.refusal(raw):
        line.send_bytes(raw, f"{len(burst)} requests in one write")
    else:
        for request in burst:
            line.send(request.message, request.place.address)
    came: list[Incoming] = []
    surplus: list[Incoming] = []
    order: list[int] = []  # places of the requests in the burst, in the order of their answers
    while len(order) < len(burst):
        new = line.listen(_WAIT, until=lambda heard: True)
        if not new:
            break
        for heard in new:
            found = next((at for at in _open(burst, order) if _answers(burst[at], heard)), None)
            (surplus if found is None else came).append(heard)
            if found is not None:
                order.append(found)
    return all(
        [
            _judge_lost(trial, [burst[at] for at in _open(burst, order)], came),
            _judge_surplus(trial, surplus),
            _judge_order(trial, burst, order, came),
        ]
    )


def _open(burst: Sequence[Request], order: Sequence[int]) -> list[int]:
    """Return the positions of the requests that are not answered yet."""
    return [at for at in range(len(burst)) if at not in order]


def _judge_lost(trial: Trial, lost: Sequence[Request], came: Sequence[Incoming]) -> bool:
    return trial.must(
        not lost,
        f"{len(lost)} of {_BURST} requests sent without pauses got no reply: "
        f"{', '.join(request.about for request in lost[:3])}; each should get one",
        rule=ANSWERED,
        cause=Cause("back-to-back", "lost"),
        because=(Cause("back-to-back", UNSOLICITED), NOW_AND_THEN),
        came=raw_of(came),
    )


def _judge_surplus(trial: Trial, surplus: Sequence[Incoming]) -> bool:
    for heard in surplus:
        if is_error(trial, heard):
            judge_unasked(
                trial, heard, "in addition to the replies to requests sent without pauses"
            )
    surplus = [heard for heard in surplus if not is_error(trial, heard)]
    return trial.must(
        not surplus,
        "in addition to the replies to requests sent without pauses, the controller sent "
        f"{described(trial, surplus)}; each request should be answered once",
        rule="get-answers-request",
        cause=Cause("back-to-back", UNSOLICITED),
        because=[
            cause
            for heard in surplus
            for cause in (
                cause_of_stray(trial.declared, heard),
                *known_bytes(trial.causes, heard.raw),
                *unstopped(trial.declared),
                Cause("back-to-back", "lost"),
                NOW_AND_THEN,
            )
        ],
        came=raw_of(surplus),
    )


def _judge_order(
    trial: Trial, burst: Sequence[Request], order: Sequence[int], came: Sequence[Incoming]
) -> bool:
    """Report a target that answered out of order. Targets do not wait for each other."""
    for place in {burst[at].place.address for at in order}:
        theirs = [at for at in order if burst[at].place.address == place]
        for earlier, later in pairwise(theirs):
            if earlier > later:
                return trial.must(
                    False,
                    f"{burst[earlier].about} was answered before {burst[later].about}, which "
                    "was sent first; requests sent without pauses should be answered in order",
                    rule="get-answers-request",
                    because=(Cause("back-to-back", "lost"), NOW_AND_THEN),
                    came=raw_of(came),
                )
    return True


def _answers(request: Request, heard: Incoming) -> bool:
    """Return whether a message is the reply to a request. Addresses of 0 match any target."""
    if heard.name not in request.answers:
        return False
    if None not in (heard.channel, request.channel) and heard.channel != request.channel:
        return False
    mine = request.place.address
    return mine in (heard.source, heard.dest) or heard.source == heard.dest == 0


_MEASURED: Final = 100
"""Requests to each target; fewer would not show a delay that occurs once in a hundred."""


TIMING = Kind(
    name="timing",
    title="Requests are answered within the time that the PICS promises",
    rules=(),  # the document has none
)


def _places(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    found = [clean_request(declared, place) for place in declared.places]
    requests = [request for request in found if request is not None]
    if requests:
        yield Case(
            arguments={"requests": requests},
            messages=[name for each in requests for name in each.messages],
            seconds=0.2 + 0.2 * len(requests),
        )


@TIMING.check(
    "Requests are answered within the time that the PICS promises, if it promises one",
    name="reply",
    each=_places,
)
def _timing(trial: Trial, requests: Sequence[Request]) -> None:
    """Measure each target, and compare the slowest with the promise."""
    jitter = jitter_of(trial.line)
    sound = [clean_request(trial.declared, each.place, trial.causes) or each for each in requests]
    took = {request.about: _measure(trial, request) for request in sound}
    slowest = max(took, key=lambda about: percentile(took[about], 99))
    median, late = percentile(took[slowest], 50), percentile(took[slowest], 99)
    trial.figures |= {
        "p50_ms": round(median * 1e3, 3),
        "p99_ms": round(late * 1e3, 3),
        "jitter_ms": round(jitter.late * 1e3, 3),
    }
    said = (
        f"{slowest}: 99 % of the replies arrived within {late * 1e3:.2f} ms, half of them within "
        f"{median * 1e3:.2f} ms"
    )
    promised = trial.declared.pics.timing.reply_p99_ms
    if promised is None:
        trial.inconclusive(f"{said}; {jitter}. The PICS sets no limit (reply_p99_ms)")
    elif jitter.blurs(promised / 1e3):
        trial.inconclusive(
            f"{said}; {jitter}, which is too late to judge the promised {promised:g} ms"
        )
    else:
        trial.info(f"{said}; {jitter}")
        trial.must(late <= promised / 1e3, f"{said}; the PICS promises {promised:g} ms")


def _measure(trial: Trial, request: Request) -> list[float]:
    """Return how long each of many replies took, in seconds."""
    took = []
    for _ in range(_MEASURED):
        began = trial.line.now
        reply = trial.reply(request.message, request.place.address)
        took.append(reply.time - began)
    return took
