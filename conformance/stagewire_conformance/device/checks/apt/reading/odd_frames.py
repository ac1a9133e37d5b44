"""Frames that a controller must ignore, and whose end it must find (pages 8 to 10).

Only the header determines where a frame ends, whatever packet its id usually has. So a controller must skip a
frame with an unknown id or an unexpected packet, and answer the next request.

One check sends a SET message that lacks a byte. It contains a changed value, which shows whether the
controller applied it. Therefore that check needs permission to change settings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire.errors import CodecError
from stagewire.protocols import DATA_FLAG, HEADER_SIZE
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.clean import (
    SILENCE,
    before_clean_request,
    clean,
    clean_request,
    is_error,
    unheeded,
)
from stagewire_conformance.device.checks.apt.reading.damage import harmless_bytes, unknown_frame
from stagewire_conformance.device.checks.apt.replies import Request, judge_unasked
from stagewire_conformance.device.checks.apt.settings.care import CARE, Care, When
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, Values, placed_sets
from stagewire_conformance.device.checks.apt.settings.variants import first_variant
from stagewire_conformance.device.checks.apt.streams import unstopped
from stagewire_conformance.device.checks.apt.wording import described, raw_of
from stagewire_conformance.device.permissions import Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_LENGTHS: Final = range(3, 60)
"""Lengths of packets to choose from; a length of 2 would look like the id of HW_DISCONNECT."""

_Send = Callable[["Trial", Request], None]
"""Sends an odd frame to the target of a request, and judges the reaction."""


UNKNOWN_ID: Final = Kind(
    name="unknown-id",
    title="A frame with an unknown id is skipped, including its packet",
    rules=(
        "length-in-header",
        "data-flag",
        "data-follows-flag",
        "header-only-meaning",
        "request-answered",
    ),
)
WRONG_LENGTH: Final = Kind(
    name="wrong-length",
    title="The header alone determines where a frame ends",
    rules=(
        "length-in-header",
        "data-flag-checked-first",
        "data-length-bytes",
        "request-answered",
    ),
)
FOREIGN_DESTINATION: Final = Kind(
    name="foreign-destination",
    title="A message to another address is not answered",
    rules=(
        "slot-addressed-by-destination",
        "address-values",
        "generic-unit-address",
        "request-answered",
    ),
)


def _odd(kind: Kind, name: str, title: str) -> Callable[[_Send], _Send]:
    """Declare a function that sends an odd frame to a random target as a check; a decorator."""

    def declare(send: _Send) -> _Send:
        kind.check(title, name=name, seconds=0.25, each=before_clean_request)(
            partial(_run, send=send)
        )
        return send

    return declare


def _run(trial: Trial, send: _Send) -> None:
    places = [place for place in trial.declared.places if clean_request(trial.declared, place)]
    request = clean_request(trial.declared, trial.random.choice(places), trial.causes)
    assert request is not None  # the target was chosen for it
    with trial.line.silent():
        send(trial, request)


# Frames with an unknown id


@_odd(UNKNOWN_ID, "header", "A header with an unknown id is skipped")
def _unknown_header(trial: Trial, request: Request) -> None:
    raw = unknown_frame(trial.declared, trial.random, request.place.address)
    _unknown(trial, request, raw, "a header with an unknown id")


@_odd(UNKNOWN_ID, "packet", "A frame with an unknown id is skipped by its length")
def _unknown_packet(trial: Trial, request: Request) -> None:
    packet = harmless_bytes(trial.declared, trial.random, trial.random.choice(_LENGTHS))
    raw = unknown_frame(trial.declared, trial.random, request.place.address, packet)
    about = f"a frame with an unknown id and a packet of {len(packet)} bytes"
    _unknown(trial, request, raw, about)


@_odd(
    UNKNOWN_ID, "message-inside", "The packet of a frame with an unknown id is not read as messages"
)
def _unknown_with_message(trial: Trial, request: Request) -> None:
    """Hide a request in the packet. A controller that answers it reads packets as messages."""
    inside = request.message.pack(request.place.address, trial.declared.framed.host)
    before = harmless_bytes(trial.declared, trial.random, trial.random.randrange(3, 9))
    raw = unknown_frame(trial.declared, trial.random, request.place.address, before + inside)
    about = f"a frame with an unknown id, whose packet contains the bytes of {request.name}"
    _unknown(trial, request, raw, about, rule="data-follows-flag")


def _unknown(trial: Trial, request: Request, raw: bytes, about: str, rule: str = "") -> None:
    unheeded(trial, raw, about, rule=rule)
    clean(trial, f"after {about}", request.place)


# Unexpected packets


@_odd(WRONG_LENGTH, "empty", "A request with an announced but empty packet ends with its header")
def _empty_packet(trial: Trial, request: Request) -> None:
    _with_packet(trial, request, b"")


@_odd(WRONG_LENGTH, "long", "A request with an unexpected packet ends with that packet")
def _packet(trial: Trial, request: Request) -> None:
    count = trial.random.choice(_LENGTHS)
    _with_packet(trial, request, harmless_bytes(trial.declared, trial.random, count))


def _with_packet(trial: Trial, request: Request, packet: bytes) -> None:
    """Send a request with an unexpected packet. Whether it is answered is left open."""
    raw = request.message.pack(request.place.address, trial.declared.framed.host)
    length = len(packet).to_bytes(2, "little")
    frame = raw[:2] + length + bytes((raw[4] | DATA_FLAG, raw[5])) + packet
    about = (
        f"{request.about} with a packet of {len(packet)} bytes instead of only its header of "
        f"{HEADER_SIZE}"
    )
    trial.line.send_bytes(frame, about)
    for heard in trial.line.listen(SILENCE):
        if heard.name in request.answers or is_error(trial, heard):
            trial.info(f"{about} was answered with {described(trial, [heard])}")
        else:
            judge_unasked(trial, heard, f"after {about}")
    clean(trial, f"after {about}", request.place)


# Destinations without a target


@_odd(
    FOREIGN_DESTINATION,
    "undocumented",
    "An undocumented address is not answered",
)
def _undocumented_address(trial: Trial, request: Request) -> None:
    """Send a request to an address that the document does not list. No sentence forbids a reply."""
    address = harmless_bytes(trial.declared, trial.random, 1)[0] & ~DATA_FLAG
    about = f"{request.name} to the undocumented address {address:#04x}"
    trial.line.send_bytes(request.message.pack(address, trial.declared.framed.host), about)
    _judge_foreign(trial, about, trial.line.listen(SILENCE))
    clean(trial, f"after {about}", request.place)


def _judge_foreign(trial: Trial, about: str, came: list[Incoming]) -> None:
    """Report an answer at an address without a target.

    The document only states at which address a target is reached: none of its sentences forbids a unit that
    is alone on its line to accept other addresses.
    """
    has_bays = any(place.bay is not None for place in trial.declared.places)
    came = [each for each in came if not is_error(trial, each)]
    trial.should(
        not came,
        f"{about} was answered with {described(trial, came)}; nothing should reply",
        rule="slot-addressed-by-destination" if has_bays else "generic-unit-address",
        cause=Cause(trial.declared.unit.name, "foreign addresses"),
        because=unstopped(trial.declared),
        came=raw_of(came),
    )


@_odd(FOREIGN_DESTINATION, "documented", "Addresses without a declared target are not answered")
def _address_of_others(trial: Trial, request: Request) -> None:
    """Send a request to every documented address without a target, except those known to be answered.

    A unit that is alone on its USB node may accept all messages: the document does not forbid it. The check
    of bays covers the bays of a rack.
    """
    declared = trial.declared
    known = {place.address for place in declared.places} | set(declared.unit.also_at)
    bays = declared.registry.data["addresses"]["bays"]
    if declared.unit.kind != "generic_usb":
        known |= set(range(bays["first"], bays["last"] + 1))
    for address in sorted(declared.framed.devices - known):
        trial.line.send(request.message, address)
    about = f"{request.name} to addresses without a declared target"
    _judge_foreign(trial, about, trial.line.listen(SILENCE))
    clean(trial, f"after {about}", request.place)


def _settings(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    """Yield a case for each target with a parameter set that can always be changed safely."""
    for place in declared.places:
        of_place = [
            placed
            for placed in placed_sets(declared)
            if placed.place is place and _is_fit(declared, placed)
        ]
        if of_place:
            yield Case(
                name=f"short/{place.name}",
                words={"place": place.name},
                arguments={"of_place": of_place},
                messages=[name for each in of_place for name in each.set.messages],
            )


def _is_fit(declared: Declaration, placed: PlacedSet) -> bool:
    care = CARE.get(placed.set.name, Care())
    layout, *others = declared.registry.messages[placed.set.set]["layouts"]
    plain = placed.set.needs == {Need.SETTINGS} and not placed.set.skip and care.when is When.ALWAYS
    # with two lengths, a packet that is too short for the long one may be a valid short one
    return bool(plain and care.fields and layout["length"] > 1 and not others)


@WRONG_LENGTH.check(
    "A SET message to {place} whose packet is too short changes nothing",
    needs={Need.SETTINGS},
    does="sends a SET message that is a byte too short and should change nothing, and restores the setting",
    seconds=0.25,
    each=_settings,
)
def _short_settings_are_ignored(trial: Trial, of_place: Sequence[PlacedSet]) -> None:
    for placed in trial.random.sample(of_place, len(of_place)):
        before = placed.read(trial)
        variant = first_variant(placed.set, CARE[placed.set.name], before, trial.random)
        if variant is None:
            continue
        changed = {**before, variant[0]: variant[1]}
        try:
            raw, length = _shortened(trial, placed, changed)
        except CodecError:
            continue  # the current values cannot be set; other checks report this
        if not trial.line.refusal(raw):  # this also looks for messages among the values
            break
    else:
        trial.inconclusive("no setting has a value that could be changed slightly")
        return
    placed.undo(trial, before)
    about = f"{placed.set.set} with a packet of {length} bytes instead of {length + 1}"
    unheeded(trial, raw, about)
    if clean(trial, f"after {about}", placed.place):
        now = placed.read(trial)
        trial.should(
            now == before,
            f"{about} changed {', '.join(name for name in now if now[name] != before[name])}; "
            "an incomplete message should change nothing",
            came=raw,
            rule="data-length-bytes",
        )


def _shortened(trial: Trial, placed: PlacedSet, values: Values) -> tuple[bytes, int]:
    """Return the frame that would write the values, with a byte missing, and the length in its header."""
    message = trial.declared.make(placed.set.set, placed.channel, **values)
    whole: bytes = message.pack(placed.place.address, trial.declared.framed.host)
    length = len(whole) - HEADER_SIZE - 1
    return whole[:2] + length.to_bytes(2, "little") + whole[4:-1], length
