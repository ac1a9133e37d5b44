"""Requests without a pause: each is answered, and each place answers in order (page 11)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.clean import is_error
from stagewire_conformance.device.checks.apt.replies import judge_unasked
from stagewire_conformance.device.checks.apt.requests import Request, requests_of
from stagewire_conformance.device.checks.apt.wording import described, raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.lines.dialogue import Heard
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_REQUESTS: Final = 200
_BURST: Final = 10
_WAIT: Final = 1.0
"""Seconds after the last answer in which the next one of a burst has to come."""

_ENOUGH: Final = 3
"""Bursts with something wrong after which no more are sent."""


KIND = Kind(
    name="back-to-back",
    title="Requests without a pause are all answered, in order",
    rules=("request-answered", "get-answers-request", "slot-source"),
)


def _claimed(declared: Declared, allowed: Permissions) -> Iterator[Case]:
    requests = [
        request
        for place in declared.places
        for request in requests_of(declared, place)
        if not request.skip
    ]
    if requests:
        messages = [name for request in requests for name in request.messages]
        yield Case(messages=messages, arguments={"requests": requests})


@KIND.check(
    f"{_REQUESTS} requests in bursts of {_BURST} are all answered, in order",
    seconds=2.0,
    each=_claimed,
)
def _run(trial: Trial, requests: Sequence[Request]) -> None:
    wrong = 0
    for _ in range(_REQUESTS // _BURST):
        burst = [trial.random.choice(requests) for _ in range(_BURST)]
        wrong += not _answered(trial, burst)
        if wrong == _ENOUGH:
            return
    _judge_surplus(trial, trial.line.drain())


def _answered(trial: Trial, burst: Sequence[Request]) -> bool:
    """Send requests at once; return whether all were answered as they should be."""
    line = trial.line
    for request in burst:
        line.send(request.message, request.place.address)
    came: list[Heard] = []
    surplus: list[Heard] = []
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
    """Return which requests were not answered yet."""
    return [at for at in range(len(burst)) if at not in order]


def _judge_lost(trial: Trial, lost: Sequence[Request], came: Sequence[Heard]) -> bool:
    return trial.must(
        not lost,
        f"of {_BURST} requests without a pause {len(lost)} were not answered: "
        f"{', '.join(request.about for request in lost[:3])}; each should be",
        came=raw_of(came),
    )


def _judge_surplus(trial: Trial, surplus: Sequence[Heard]) -> bool:
    for heard in surplus:
        if is_error(trial, heard):
            judge_unasked(trial, heard, "beside the answers to requests without a pause")
    surplus = [heard for heard in surplus if not is_error(trial, heard)]
    return trial.must(
        not surplus,
        f"beside the answers to requests without a pause there came {described(trial, surplus)}; each should "
        "be answered once",
        came=raw_of(surplus),
    )


def _judge_order(
    trial: Trial, burst: Sequence[Request], order: Sequence[int], came: Sequence[Heard]
) -> bool:
    """Say that a place answered in another order; places do not wait for each other."""
    for place in {burst[at].place.address for at in order}:
        theirs = [at for at in order if burst[at].place.address == place]
        for earlier, later in pairwise(theirs):
            if earlier > later:
                return trial.must(
                    False,
                    f"{burst[earlier].about} was answered before {burst[later].about}, which had been asked "
                    "first; requests without a pause should be answered in order",
                    came=raw_of(came),
                )
    return True


def _answers(request: Request, heard: Heard) -> bool:
    """Return whether something is the answer to a request; addresses that say nothing may be anybody's."""
    if heard.name not in request.answers or heard.channel not in (None, request.channel):
        return False
    mine = request.place.address
    return mine in (heard.source, heard.dest) or heard.source == heard.dest == 0
