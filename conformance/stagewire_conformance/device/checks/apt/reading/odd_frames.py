"""Frames that a controller has to leave alone, and whose end it finds all the same (pages 8 to 10).

The header alone says where a frame ends, whatever its id usually has. So a frame with an unknown id, or with
a packet where none belongs, costs a controller nothing: the request that follows is answered as ever.

A message that sets something with a byte too few carries a changed value, so that a controller that takes it
is seen; therefore this check needs the permission to change settings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire.errors import CodecError
from stagewire.protocols import DATA_FLAG, HEADER_SIZE
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
from stagewire_conformance.device.checks.apt.wording import described, raw_of
from stagewire_conformance.device.permissions import Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_LENGTHS: Final = range(3, 60)
"""Lengths of packets that are drawn; a length of 2 would look like the id of HW_DISCONNECT."""

_Send = Callable[["Trial", Request], None]
"""Sends an odd frame where a request could be sent, and sees what comes of it."""


UNKNOWN_ID: Final = Kind(
    name="unknown-id",
    title="A frame with an id that no message has is skipped, packet and all",
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
    title="A frame ends where its header says, whatever its id usually has",
    rules=(
        "length-in-header",
        "data-flag-checked-first",
        "data-length-bytes",
        "request-answered",
    ),
)
FOREIGN_DESTINATION: Final = Kind(
    name="foreign-destination",
    title="What is sent to somebody else is not answered",
    rules=(
        "slot-addressed-by-destination",
        "address-values",
        "generic-unit-address",
        "request-answered",
    ),
)


def _odd(kind: Kind, name: str, title: str) -> Callable[[_Send], _Send]:
    """Declare a function that sends an odd frame, to a place that is drawn, as a check; a decorator."""

    def declare(send: _Send) -> _Send:
        kind.check(title, name=name, seconds=0.5, each=before_clean_request)(
            partial(_run, send=send)
        )
        return send

    return declare


def _run(trial: Trial, send: _Send) -> None:
    places = [place for place in trial.declared.places if clean_request(trial.declared, place)]
    request = clean_request(trial.declared, trial.random.choice(places))
    assert request is not None  # the place was chosen for it
    with trial.line.silent():
        send(trial, request)


# An id that no message has


@_odd(UNKNOWN_ID, "header", "A header with an unknown id is skipped")
def _unknown_header(trial: Trial, request: Request) -> None:
    raw = unknown_frame(trial.declared, trial.random, request.place.address)
    _unknown(trial, request, raw, "a header with an id that no message has")


@_odd(UNKNOWN_ID, "packet", "A frame with an unknown id is skipped by its length")
def _unknown_packet(trial: Trial, request: Request) -> None:
    packet = harmless_bytes(trial.declared, trial.random, trial.random.choice(_LENGTHS))
    raw = unknown_frame(trial.declared, trial.random, request.place.address, packet)
    about = f"a frame with an id that no message has, and a packet of {len(packet)} bytes"
    _unknown(trial, request, raw, about)


@_odd(UNKNOWN_ID, "message-inside", "The packet of an unknown frame is not read as messages")
def _unknown_with_message(trial: Trial, request: Request) -> None:
    """Hide a request in the packet: who answers it reads packets as messages."""
    inside = request.message.pack(request.place.address, trial.declared.framed.host)
    before = harmless_bytes(trial.declared, trial.random, trial.random.randrange(3, 9))
    raw = unknown_frame(trial.declared, trial.random, request.place.address, before + inside)
    about = (
        f"a frame with an id that no message has, whose packet holds the bytes of {request.name}"
    )
    _unknown(trial, request, raw, about)


def _unknown(trial: Trial, request: Request, raw: bytes, about: str) -> None:
    unheeded(trial, raw, about)
    clean(trial, f"after {about}", request.place)


# A packet where none belongs


@_odd(WRONG_LENGTH, "empty", "A request that announces an empty packet ends with its header")
def _empty_packet(trial: Trial, request: Request) -> None:
    _with_packet(trial, request, b"")


@_odd(WRONG_LENGTH, "long", "A request with a packet ends with its packet")
def _packet(trial: Trial, request: Request) -> None:
    count = trial.random.choice(_LENGTHS)
    _with_packet(trial, request, harmless_bytes(trial.declared, trial.random, count))


def _with_packet(trial: Trial, request: Request, packet: bytes) -> None:
    """Send a request with a packet that it has not; whether it is answered is left open."""
    raw = request.message.pack(request.place.address, trial.declared.framed.host)
    length = len(packet).to_bytes(2, "little")
    frame = raw[:2] + length + bytes((raw[4] | DATA_FLAG, raw[5])) + packet
    about = f"{request.about} with a packet of {len(packet)} bytes, where it is a header of {HEADER_SIZE}"
    trial.line.send_bytes(frame, about)
    for heard in trial.line.listen(SILENCE):
        if heard.name in request.answers or is_error(trial, heard):
            trial.info(f"{about} was answered with {described(trial, [heard])}")
        else:
            judge_unasked(trial, heard, f"after {about}")
    clean(trial, f"after {about}", request.place)


# A destination where nobody is


@_odd(
    FOREIGN_DESTINATION,
    "undocumented",
    "Nothing answers at an address that the document does not have",
)
def _undocumented_address(trial: Trial, request: Request) -> None:
    address = harmless_bytes(trial.declared, trial.random, 1)[0] & ~DATA_FLAG
    about = f"{request.name} to {address:#04x}, an address that the document does not have,"
    unheeded(trial, request.message.pack(address, trial.declared.framed.host), about)
    clean(trial, f"after {about}", request.place)


@_odd(FOREIGN_DESTINATION, "documented", "Nothing answers where nothing is declared")
def _address_of_others(trial: Trial, request: Request) -> None:
    """Ask every documented address that is neither a place nor known to be answered as well.

    A unit with a USB node of its own is alone on it, so that the document does not forbid it to take all that
    comes. Of the bays of a rack the check of bays asks.
    """
    declared = trial.declared
    known = {place.address for place in declared.places} | set(declared.unit.also_at)
    bays = declared.registry.data["addresses"]["bays"]
    if declared.unit.kind != "generic_usb":
        known |= set(range(bays["first"], bays["last"] + 1))
    for address in sorted(declared.framed.devices - known):
        trial.line.send(request.message, address)
    came = trial.line.listen(SILENCE)
    trial.should(
        not came,
        f"{request.name} to addresses where nothing is declared was answered with {described(trial, came)}; "
        "nothing should answer",
        came=raw_of(came),
    )
    clean(trial, f"after {request.name} to addresses where nothing is declared", request.place)


def _settings(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    """Give a case for each place where a parameter set can be changed without a further thought."""
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
    layout = declared.registry.messages[placed.set.set]["layouts"][0]
    plain = placed.set.effect == "settings" and not placed.set.skip and care.when is When.ALWAYS
    return bool(plain and care.fields and layout["length"] > 1)


@WRONG_LENGTH.check(
    "A message to {place} whose packet is too short sets nothing",
    needs={Need.SETTINGS},
    does="sends a setting with a byte too few, which should change nothing, and puts it back",
    seconds=0.5,
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
            continue  # what was told cannot be set, which other checks say
        if not trial.line.refusal(raw):  # which looks for messages among the values, too
            break
    else:
        trial.inconclusive("none of the settings has a value that could be changed a little")
        return
    trial.undo(f"{placed.set.set} at {placed.text}", lambda: placed.put_back(trial, before))
    about = f"{placed.set.set} with a packet of {length} bytes, where it has {length + 1}"
    unheeded(trial, raw, about)
    if clean(trial, f"after {about}", placed.place):
        now = placed.read(trial)
        trial.should(
            now == before,
            f"{about}, changed {', '.join(name for name in now if now[name] != before[name])}; a message "
            "that is not whole should set nothing",
            came=raw,
        )


def _shortened(trial: Trial, placed: PlacedSet, values: Values) -> tuple[bytes, int]:
    """Return the frame that would write values, with a byte too few, and the length that it declares."""
    message = trial.declared.make(placed.set.set, placed.channel, **values)
    whole: bytes = message.pack(placed.place.address, trial.declared.framed.host)
    length = len(whole) - HEADER_SIZE - 1
    return whole[:2] + length.to_bytes(2, "little") + whole[4:-1], length
