"""After whatever was wrong with what was sent: a clean request has to be answered.

Where it is not, the line is put into step again as far as that can be done, so that the checks that follow
are not held to what this one found.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Case
from stagewire_conformance.device.checks.apt.replies import Request, a_request, judge_unasked
from stagewire_conformance.device.checks.apt.wording import described, joined, raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


SILENCE: Final = 0.2
"""Seconds in which an answer that should not come would have come."""

_PATIENCE: Final = 0.4
"""Seconds that a clean request is given when it is asked again."""

_LONGEST: Final = 300
"""Bytes that fill any packet that a controller may be waiting for, and a header."""


def identity_of(declared: Declaration) -> tuple[str, ...]:
    """Return the requests that ask what a unit is."""
    return tuple(
        name
        for name, entry in declared.registry.messages.items()
        if entry.get("tells") == "identity" and entry["exchange"].get("answered_by")
    )


def clean_request(declared: Declaration, place: Target | None = None) -> Request | None:
    """Return what is asked to see whether all is well: what a unit is, or else whatever can be asked.

    :param place: whom; None: the first that claims any request.
    """
    names = identity_of(declared)
    for each in declared.places if place is None else (place,):
        if found := a_request(declared, each, names):
            return found
    return None


def clean(trial: Trial, after: str, place: Target | None = None, *, tries: int = 1) -> bool:
    """See that a clean request is answered, and return whether it is.

    :param after: for the sentence: ``after 3 bytes of a header``.
    :param tries: how often it is asked at most, where the document leaves open how soon a controller has to
        find out that what came was no message.
    """
    request = clean_request(trial.declared, place)
    if request is None:
        trial.inconclusive("no request is claimed that could show whether the controller is well")
        return False
    address = request.place.address
    for attempt in range(1, tries + 1):
        wait = 1.0 if attempt == 1 else _PATIENCE
        if trial.line.ask(request.message, address, wait=wait) is not None:
            trial.should(
                attempt == 1,
                f"{after}, {request.about} was answered only when it was asked {attempt} times; it should "
                f"be answered the first time, since the controller had a second of silence to find out",
            )
            return True
    came = trial.line.drain()
    asked = "" if tries == 1 else f", though it was asked {tries} times"
    trial.must(
        False,
        f"{after}, {request.about} was not answered{asked}; {' or '.join(request.answers)} should have come, "
        f"there came {described(trial, came)}",
        came=raw_of(came),
    )
    _put_into_step(trial, request)
    return False


def unheeded(trial: Trial, raw: bytes, about: str, quiet: float = SILENCE) -> None:
    """Send what a controller has to leave alone, and see that nothing comes of it.

    An error message (page 19) may: the document does not say what counts as a fault.

    :param about: what is sent, for sentences and for the log.
    """
    trial.line.send_bytes(raw, about)
    for heard in joined(trial.line.listen(quiet)):
        if is_error(trial, heard):
            trial.info(f"{about} was answered with {described(trial, [heard])}")
        else:
            judge_unasked(trial, heard, f"after {about}")


def is_error(trial: Trial, heard: Incoming) -> bool:
    """Return whether a message reports a fault: it comes unasked, can be muted, and is no status."""
    exchange = trial.declared.registry.messages.get(heard.name, {}).get("exchange", {})
    return bool(exchange.get("muted_by")) and not exchange.get("counts_for_keep_alive")


def _put_into_step(trial: Trial, request: Request) -> None:
    """Fill up what the controller may be waiting for with zeros, which are no message and no address."""
    for zeros in (1, 1, 1, 1, 1, _LONGEST, 1, 1, 1, 1, 1):
        trial.line.send_bytes(bytes(zeros), "zeros, to end what the controller may be waiting for")
        if trial.line.ask(request.message, request.place.address, wait=_PATIENCE) is not None:
            return


def before_clean_request(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    """Give the case of a check that sends something odd before a clean request, which has to be answered.

    It is skipped where no request could show that all is well.
    """
    request = clean_request(declared)
    if request is None:
        yield Case(skip="no request is claimed that could show that all is well")
    else:
        yield Case(messages=request.messages)
