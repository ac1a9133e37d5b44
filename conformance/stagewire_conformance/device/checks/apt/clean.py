"""The check after invalid data: a clean request must be answered.

If it is not, this module tries to resynchronise the line, so that the failure does not affect later checks.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from stagewire.protocols import HEADER_SIZE
from stagewire_conformance.device.causes import NOW_AND_THEN, Cause, Causes, silence
from stagewire_conformance.device.check import Case
from stagewire_conformance.device.checks.apt.broken_rules import ANSWERED
from stagewire_conformance.device.checks.apt.replies import Request, a_request, judge_unasked
from stagewire_conformance.device.checks.apt.wording import described, joined, raw_of
from stagewire_conformance.device.lines.strays import cause_of_silence

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


SILENCE: Final = 0.2
"""Seconds to listen for a reply that must not come."""

_PATIENCE: Final = 0.4
"""Seconds to wait for the reply when a clean request is repeated."""

_LONGEST: Final = 300
"""Enough bytes to complete the longest documented packet and a header."""
_LONGER: Final = 0x10000
"""Enough bytes to complete any packet whose length a header can state, and a header."""
_PER_SECOND: Final = 11_520
"""Bytes per second on the line (page 8)."""


def identity_of(declared: Declaration) -> tuple[str, ...]:
    """Return the requests for the identity of a unit."""
    return tuple(
        name
        for name, entry in declared.registry.messages.items()
        if entry.get("tells") == "identity" and entry["exchange"].get("answered_by")
    )


def clean_request(
    declared: Declaration, place: Target | None = None, causes: Causes | None = None
) -> Request | None:
    """Return the request that shows whether the controller still replies.

    This is the request for its identity or, if that is not claimed, any request.

    :param place: the target of the request; None: the first target that claims a request.
    :param causes: the reported defects. A request whose reply has one is used only if there is no other.
    """
    names = identity_of(declared)
    for each in declared.places if place is None else (place,):
        if found := a_request(declared, each, names, causes):
            return found
    return None


def clean(trial: Trial, after: str, place: Target | None = None, *, tries: int = 1) -> bool:
    """Check that a clean request is answered, and return whether it is.

    :param after: the beginning of the sentence: ``after 3 bytes of a header``.
    :param tries: the most times to send the request. The document leaves open how soon a controller must
        notice that it received no message.
    """
    request = clean_request(trial.declared, place, trial.causes)
    if request is None:
        trial.inconclusive(
            "the PICS leaves no supported request, so nothing can show whether the controller still replies"
        )
        return False
    address = request.place.address
    for attempt in range(1, tries + 1):
        wait = 1.0 if attempt == 1 else _PATIENCE
        if trial.line.ask(request.message, address, wait=wait) is not None:
            trial.should(
                attempt == 1,
                f"{after}, {request.about} was answered only at attempt {attempt}; the "
                "controller had a second of silence to recover, so it should answer the first",
                cause=_recovery(trial),
                because=(NOW_AND_THEN,),
                rule=ANSWERED,
            )
            return True
    came = trial.line.drain()
    asked = "" if tries == 1 else f" in {tries} attempts"
    trial.must(
        False,
        f"{after}, {request.about} was not answered{asked}; expected "
        f"{' or '.join(request.answers)}, received {described(trial, came)}",
        rule=ANSWERED,
        cause=trial.likely(
            _recovery(trial),
            cause_of_silence(trial.declared, came, request.answers, address),
            silence(request.place.name),
        ),
        because=(NOW_AND_THEN,),
        came=raw_of(came),
    )
    if not _put_into_step(trial, request):
        for silent in _silent_places(trial, request.place):
            trial.causes.report(silence(silent.name), trial.check)
    return False


def _recovery(trial: Trial) -> Cause:
    """Return the cause that a controller does not recover from the input that checks of this kind send."""
    return Cause(trial.check.partition("/")[0], "recovery")


def unheeded(
    trial: Trial, raw: bytes, about: str, quiet: float = SILENCE, *, rule: str = ""
) -> None:
    """Send bytes that the controller must ignore, and check that nothing comes back.

    An error message (page 19) is allowed: the document does not define what counts as a fault.

    :param about: a description of the bytes, for sentences and the log.
    :param rule: the rule that a message in reply breaks; by default that of a message without a request.
    """
    kind = trial.check.partition("/")[0]
    trial.line.send_bytes(raw, about)
    for heard in joined(trial.line.listen(quiet)):
        if is_error(trial, heard):
            trial.info(f"{about} was answered with {described(trial, [heard])}")
        else:
            judge_unasked(trial, heard, f"after {about}", rule=rule, cause=Cause(kind, "answered"))


def is_error(trial: Trial, heard: Incoming) -> bool:
    """Return whether a message reports a fault: it is unsolicited, can be muted, and is not a status."""
    exchange = trial.declared.registry.messages.get(heard.name, {}).get("exchange", {})
    return bool(exchange.get("muted_by")) and not exchange.get("counts_for_keep_alive")


def _put_into_step(trial: Trial, request: Request) -> bool:
    """Bring the controller back into step, and return whether it answers again.

    Zeros contain no message and no address. They complete a frame that may be pending. If they do not help,
    the link is drained and opened again, if it can be.
    """
    singles = (1,) * (HEADER_SIZE - 1)
    for zeros in (*singles, _LONGEST, *singles, _LONGER, *singles):
        trial.line.send_bytes(
            bytes(zeros), "zeros, to complete what the controller may be waiting for"
        )
        wait = _PATIENCE + zeros / _PER_SECOND
        if trial.line.ask(request.message, request.place.address, wait=wait) is not None:
            return True
    trial.line.drain()
    if not trial.line.reopen():
        return False
    if trial.line.ask(request.message, request.place.address, wait=_PATIENCE) is None:
        return False
    trial.info("the controller answered again only after the connection was opened again")
    return True


def _silent_places(trial: Trial, silent: Target) -> Iterator[Target]:
    """Yield a place that does not answer, and all others that do not answer either."""
    yield silent
    for place in trial.declared.places:
        request = clean_request(trial.declared, place, trial.causes)
        if place is silent or request is None:
            continue
        if trial.line.ask(request.message, place.address, wait=_PATIENCE) is None:
            yield place


def before_clean_request(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    """Yield the case of a check that sends an odd frame before a clean request, which must be answered.

    The case is skipped if no request could show that the controller still replies.
    """
    request = clean_request(declared)
    if request is None:
        yield Case(
            skip="the PICS leaves no supported request that could show whether the controller still replies"
        )
    else:
        yield Case(messages=request.messages)
