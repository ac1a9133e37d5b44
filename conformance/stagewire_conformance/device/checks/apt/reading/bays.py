"""Checks that a rack reports its bays, and that empty bays do not reply (pages 9, 10 and 23)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import DELIVERY, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.clean import identity_of
from stagewire_conformance.device.checks.apt.replies import judge_message
from stagewire_conformance.device.checks.apt.wording import described, raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


_ASK: Final = "RACK_REQ_BAYUSED"
_ANSWER: Final = "RACK_GET_BAYUSED"
_WAIT: Final = 0.3
"""Seconds in which the motherboard must report whether a bay is used."""

_SILENCE: Final = 0.1
"""Seconds in which a reply from an empty bay would arrive."""


KIND = Kind(
    name="bays",
    title="The rack reports its bays, and empty bays do not reply",
    rules=(
        "bay-used",
        "bay-idents",
        "bay-states",
        "one-line-for-bays",
        "motherboard-address",
        "slot-addressed-by-destination",
        "address-values",
    ),
)


def _boards(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        if place.is_motherboard and _ASK in place.listed:
            yield Case(
                arguments={"board": place}, skip=place.why_not(_ASK) or place.why_not(_ANSWER)
            )


@KIND.check(
    "The motherboard reports each bay as occupied or empty, as declared",
    messages=(_ASK, _ANSWER),
    name="used",
    seconds=0.6,
    each=_boards,
)
def _ask_used(trial: Trial, board: Target) -> None:
    """Request the state of every bay. The rack may leave requests for bays that it lacks unanswered."""
    declared = trial.declared
    states = {ident: state for ident in _idents(declared) if (state := _state(trial, board, ident))}
    occupied = {place.bay - 1 for place in declared.places if place.bay is not None}
    table = declared.registry.fields(_ANSWER, "header")["bay_state"]["enum"]
    if _counts_from_one(states, occupied, table["OCCUPIED"]):
        trial.should(
            False,
            f"{_ANSWER} numbers the first bay 1, as printed in the table on page 23; the "
            "example on that page numbers it 0",
            rule="bay-idents",
            cause=Cause(_ANSWER, "bay_ident"),
        )
        return
    whole = declared.unit.kind == "rack"
    for ident in range(len(declared.unit.bays)) if whole else sorted(occupied):
        trial.must(
            ident in states,
            f"{_ASK} for bay ident {ident} was not answered",
            rule="bay-used",
            cause=Cause(_ANSWER, DELIVERY),
        )
    for ident, state in states.items():
        due = table["OCCUPIED" if ident in occupied else "EMPTY"]
        if state in table.values() and (whole or ident in occupied):
            trial.must(
                state == due,
                f"{_ANSWER} has the state {state} for bay ident {ident}; the PICS declares that "
                f"bay {'occupied' if ident in occupied else 'empty'}, so the state should be "
                f"{due}",
                rule="bay-states",
                cause=Cause(_ANSWER, "bay_state"),
            )


def _state(trial: Trial, board: Target, ident: int) -> int | None:
    """Return the state that the motherboard reports for a bay; None without a reply."""
    request = trial.declared.make(_ASK, bay_ident=ident)
    heard = trial.line.ask_all(request, board.address, wait=_WAIT)
    replies = [each for each in heard if each.name == _ANSWER]
    trial.must(
        len(replies) <= 1 and len(heard) == len(replies),
        f"{_ASK} for bay ident {ident}: expected one {_ANSWER}, received {described(trial, heard)}",
        came=raw_of(heard),
        rule="bay-used",
        cause=Cause(_ANSWER, DELIVERY),
    )
    if not replies:
        return None
    reply = replies[0]
    judge_message(trial, board, None, reply)
    trial.must(
        reply.message.bay_ident == ident,
        f"{_ANSWER} is for bay ident {reply.message.bay_ident}; {ident} was requested",
        came=reply.raw,
        rule="bay-idents",
        cause=Cause(_ANSWER, "bay_ident"),
    )
    state: int = reply.message.bay_state
    return state


def _idents(declared: Declaration) -> list[int]:
    return sorted(declared.registry.fields(_ASK, "header")["bay_ident"]["enum"].values())


def _counts_from_one(states: Mapping[int, int], occupied: set[int], state: int) -> bool:
    said = {ident for ident, each in states.items() if each == state}
    return bool(said) and said == {ident + 1 for ident in occupied}


def _rack(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    if declared.unit.kind == "rack":  # for a single module, the other bays are not declared
        yield Case(messages=identity_of(declared))


@KIND.check("Empty bays do not reply", name="empty", seconds=0.8, each=_rack)
def _ask_empty(trial: Trial) -> None:
    """Request the identity of every bay that is declared empty, and of a motherboard declared missing."""
    declared = trial.declared
    (name, *_) = identity_of(declared)
    bays = declared.registry.data["addresses"]["bays"]
    board = declared.unit.address
    for address in (board, *range(bays["first"], bays["last"] + 1)):
        if declared.place_at(address) is not None:
            continue
        what = "declared without a motherboard" if address == board else "a bay declared empty"
        came = trial.line.ask_all(declared.request(name), address, wait=_SILENCE, after=0)
        trial.must(
            not came,
            f"{name} to {address:#04x}, {what}, was answered with {described(trial, came)}; nothing "
            "should reply",
            came=raw_of(came),
            rule="slot-addressed-by-destination",
        )
