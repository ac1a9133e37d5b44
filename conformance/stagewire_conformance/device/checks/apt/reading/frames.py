"""Checks that a target sends whole headers, with the right lengths and addresses (pages 8 to 12)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import ADDRESSES, DELIVERY, Cause, silence
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.broken_rules import ANSWERED, rule_of_stray
from stagewire_conformance.device.checks.apt.replies import (
    Request,
    ask_all,
    judge_addresses,
    judge_fault,
    judge_strangers,
    report_lost,
    requests_of,
)
from stagewire_conformance.device.checks.apt.undocumented import unused_parameters
from stagewire_conformance.device.checks.apt.wording import described, joined
from stagewire_conformance.device.lines.strays import bytes_of, cause_of_stray, wrong_addresses

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


_WAIT: Final = 0.3
_LATE: Final = 1.5
"""Seconds to wait for late replies after a request was not answered."""
_ENOUGH: Final = 3
"""Unanswered requests after which the check stops; each request also has its own check."""


KIND = Kind(
    name="frames",
    title="The controller sends complete frames with the correct addresses",
    rules=(
        "header-six-bytes",
        "length-in-header",
        "little-endian",
        "least-significant-first",
        "data-flag",
        "header-only-meaning",
        "unused-parameters-zero",
        "data-follows-flag",
        "data-length-bytes",
        "data-length-maximum",
        "destination-with-flag",
        "format-sizes",
        "reply-addresses-swapped",
        "address-values",
        "no-messages-between-modules",
        "get-messages-to-host",
        "never-set-or-request-to-host",
        "generic-unit-address",
        "motherboard-address",
        "one-line-for-bays",
        "slot-addressed-by-destination",
        "slot-source",
    ),
)


def _places(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        requests = list(requests_of(declared, place))
        claimed = [request for request in requests if not request.skip]
        if requests:
            yield Case(
                name=place.name,
                arguments={"place": place, "requests": claimed},
                messages=[name for each in requests for name in each.messages],
                skip="" if claimed else requests[0].skip,
                seconds=0.01 * len(requests),
            )


@KIND.check(
    "{place.name} sends complete frames with the correct lengths and addresses", each=_places
)
def _run(trial: Trial, place: Target, requests: Sequence[Request]) -> None:
    """Send every request once, and examine the frames of the replies, whatever their content."""
    silent, answered = 0, False
    seen: set[tuple[int | None, int | None]] = set()  # one message per pair of addresses is enough
    for request in requests:
        heard = ask_all(trial, request, wait=_WAIT, after=0)
        silent += not heard
        answered = answered or bool(heard)
        if answered and silent == _ENOUGH:
            break
        if not judge_strangers(trial, request, heard):
            heard = [each for each in heard if each.source == place.address]
        for each in joined(heard):
            if each.kind not in ("message", "undocumented"):
                trial.causes.report(bytes_of(each.raw), trial.check)
            cause = _cause(trial, request, each)
            if trial.must(
                each.kind in ("message", "undocumented"),
                f"{request.about} was answered with {described(trial, [each])}; a message has a "
                "header of six bytes, followed by as many bytes as the header states",
                rule=rule_of_stray(trial, each),
                cause=cause,
                came=each.raw,
            ):
                if (each.dest, each.source) not in seen:
                    judge_addresses(trial, place, each)
                seen.add((each.dest, each.source))
                for fault in unused_parameters(each.message):
                    judge_fault(trial, each, fault)
            elif cause.subject == ADDRESSES:
                report_lost(trial, request.answers[0], cause)
    if silent:  # the next check could take a late reply for its own
        trial.line.drain(quiet=_LATE, limit=2 * _LATE)
    trial.must(
        answered or not requests,
        f"{place.name} answered none of its requests",
        rule=ANSWERED,
        cause=silence(place.name),
    )


def _cause(trial: Trial, request: Request, heard: Incoming) -> Cause:
    """Return the cause of received bytes. Those that come instead of a reply, or before it, belong to it."""
    wrong = wrong_addresses(trial.declared, heard, request.answers, request.place.address)
    if wrong is not None:
        return wrong
    cause = cause_of_stray(trial.declared, heard)
    is_reply = heard.kind in ("message", "undocumented") or heard.after in request.answers
    return cause if is_reply or not request.answers else Cause(request.answers[0], DELIVERY)
