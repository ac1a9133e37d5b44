"""Checks that every request is answered by its own reply and nothing else (pages 8 to 11)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt import later_rules
from stagewire_conformance.device.checks.apt.replies import (
    Request,
    ask_all,
    judge_answer,
    requests_of,
)
from stagewire_conformance.registry import about

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_LIVE: Final = frozenset({"MOT_POSCOUNTER", "MOT_ENCCOUNTER", "PZ_OUTPUTVOLTS", "PZ_OUTPUTPOS"})
"""Sets that can be written but report a live value: a loop keeps it moving a little."""

_OF_BAYS: Final = frozenset({"slot-source", "bays-are-single-channel"})
_OF_ONE_CHANNEL: Final = frozenset(
    {
        "single-channel-chan1",
        "bays-are-single-channel",
        "motor-single-channel",
        "piezo-single-channel",
        "example-channel-one",
        "example-channel-one-solenoid",
        "tpz-channel",
        "tsg-channel",
    }
)
_OF_TWO_CHANNELS: Final = frozenset(
    {"module-channels", "dual-channel-idents", "piezo-dual-channel-idents"}
)
_OF_CHAPTERS: Final = {
    "motor": frozenset(
        {
            "motor-single-channel",
            "dual-channel-idents",
            "messages-for-any-channel",
            "example-channel-one",
        }
    ),
    "piezo": frozenset(
        {
            "piezo-single-channel",
            "piezo-dual-channel-idents",
            "piezo-messages-for-any-channel",
        }
    ),
}
"""Rules for the messages of one chapter, all of which have a channel."""


KIND = Kind(
    name="answers",
    title="Every request is answered by its own reply and nothing else",
    rules=(
        "reply-addresses-swapped",
        "slot-source",
        "format-sizes",
        "request-answered",
        "get-answers-request",
        "unit-messages",
        "no-error-in-normal-operation",
        "status-requested",
        "dc-status-requested",
        "status-bits-alone",
        "piezo-status-bits",
        "piezo-status-bits-integer",
        "rack-status-bits",
        "rack-status-integer",
        "hub-bay",
        "hub-bay-values",
        "max-travel",
        "max-travel-range",
        "stage-axis-read",
        "stage-part-number",
        "tsg-reading",
        "tsg-reading-range",
        "channel-idents",
        "single-channel-chan1",
        "bays-are-single-channel",
        "module-channels",
        "motor-single-channel",
        "dual-channel-idents",
        "messages-for-any-channel",
        "piezo-single-channel",
        "piezo-dual-channel-idents",
        "piezo-messages-for-any-channel",
        "example-channel-one",
        "example-channel-one-solenoid",
        "tpz-channel",
        "tsg-channel",
        "io-channel",
        "ppc-io-channel",
        "status-always-chan1",
        "dc-status-always-chan1",
        "lut-channel",
        "enable-states",
        "digital-outputs-bits",
        "minimum-velocity-zero",
        "jog-minimum-velocity-zero",
        "jog-mode-values",
        "jog-stop-mode-values",
        "button-modes",
        "led-modes",
        "pot-deflection-range",
        "dc-pid-ranges",
        "position-loop-ranges",
        "motor-output-ranges",
        "motor-bias-range",
        "settle-ranges",
        "profile-values",
        "current-loop-phase",
        "current-loop-ranges",
        "settled-current-loop-phase",
        "settled-current-loop-ranges",
        "solenoid-mode-values",
        "solenoid-cycle-times",
        "solenoid-cycle-count",
        "solenoid-state-values",
        "interlock-mode-values",
        "control-mode-values",
        "output-position-range",
        "volts-source-values",
        "pi-constants-range",
        "lut-index-range",
        "lut-modes-combined",
        "lut-cycle-length-range",
        "lut-cycle-count-range",
        "lut-delay-range",
        "lut-rest-ranges",
        "lut-trigger-start-range",
        "lut-trigger-repeat-range",
        "display-intensity-range",
        "tpz-voltage-limits",
        "tpz-feedback-inputs",
        "current-limits",
        "low-pass-filters",
        "bnc-modes",
        "max-voltage-range",
        "slew-rate-range",
        "tsg-outputs",
        "tsg-display-modes",
        "tsg-force-range",
        *later_rules.OF_VALUES,
        *later_rules.OF_REPLIES,
    ),
)


def _is_parameter_set(declared: Declaration, request: Request) -> bool:
    """Return whether a request reads a value that only a SET message changes."""
    place = declared.registry.messages[request.name]["set"]
    if place is None or place["name"] in _LIVE:
        return False
    return any(
        entry["set"] == {"name": place["name"], "role": "set"}
        for entry in declared.registry.messages.values()
    )


def _rules(declared: Declaration, request: Request) -> tuple[str, ...]:
    """Return the rules that a single reply can verify."""
    place = request.place
    excluded: set[str] = set()
    if place.bay is None:
        excluded |= _OF_BAYS
    if request.channel is None:
        excluded |= _OF_ONE_CHANNEL | _OF_TWO_CHANNELS
    else:
        excluded |= _OF_TWO_CHANNELS if len(place.channels) == 1 else _OF_ONE_CHANNEL
    for chapter, theirs in _OF_CHAPTERS.items():
        if declared.registry.messages[request.name]["chapter"] != chapter:
            excluded |= theirs
    rules = about(declared.registry, KIND.rules, request.messages)
    return tuple(rule for rule in rules if rule not in excluded)


def _requests(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        for request in requests_of(declared, place):
            if declared.registry.messages[request.name].get("tells") == "bays":
                continue  # the checks of bays ask about each bay, however the rack numbers them
            yield Case(
                name=request.id,
                words={"answers": " or ".join(request.answers)},
                arguments={"request": request, "again": _is_parameter_set(declared, request)},
                messages=request.messages,
                rules=_rules(declared, request),
                skip=request.skip,
            )


@KIND.check("{request.about} is answered by one {answers}", each=_requests)
def _ask(trial: Trial, request: Request, again: bool) -> None:
    address = request.place.address
    reply = judge_answer(trial, request, ask_all(trial, request))
    if reply is None or not again:
        return
    second: Incoming = trial.reply(request.message, address)
    trial.must(
        second.message == reply.message,
        f"{request.about} was answered with two different replies in a row, though nothing "
        "was set in between",
        rule="get-answers-request",
        cause=Cause(reply.name, "values"),
        wanted=reply.raw,
        came=second.raw,
    )
