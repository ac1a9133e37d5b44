"""Frames that a controller has to leave alone, and whose end it finds all the same (pages 8 to 10).

The header alone says where a frame ends, whatever its id usually has. So a frame with an unknown id, or with
a packet where none belongs, costs a controller nothing: the request that follows is answered as ever.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire.protocols import DATA_FLAG, HEADER_SIZE
from stagewire_conformance.device.check import Check, Kind
from stagewire_conformance.device.checks.apt.clean import (
    SILENCE,
    clean,
    clean_request,
    is_error,
    unheeded,
)
from stagewire_conformance.device.checks.apt.reading.harmless import harmless_bytes, unknown_frame
from stagewire_conformance.device.checks.apt.reading.making import checks_of
from stagewire_conformance.device.checks.apt.reading.short_frames import short_checks
from stagewire_conformance.device.checks.apt.replies import judge_unasked
from stagewire_conformance.device.checks.apt.requests import Request
from stagewire_conformance.device.checks.apt.wording import described, raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial

__all__ = ["KINDS"]

_LENGTHS: Final = range(3, 60)
"""Lengths of packets that are drawn; a length of 2 would look like the id of HW_DISCONNECT."""

_Send = Callable[["Trial", Request], None]
"""Sends an odd frame where a request could be sent, and sees what comes of it."""


def _checks(
    kind: str, frames: Mapping[str, tuple[_Send, str]], declared: Declared, allowed: Permissions
) -> Iterator[Check]:
    """Give a check for each of some odd frames; all are sent to a place that is drawn."""
    return checks_of(kind, frames, _run, declared, seconds=0.5)


def _wrong_length(declared: Declared, allowed: Permissions) -> Iterator[Check]:
    yield from _checks("wrong-length", _WRONG_LENGTH, declared, allowed)
    yield from short_checks(declared, allowed)


def _run(send: _Send, trial: Trial) -> None:
    places = [place for place in trial.declared.places if clean_request(trial.declared, place)]
    request = clean_request(trial.declared, trial.random.choice(places))
    assert request is not None  # the place was chosen for it
    with trial.line.silent():
        send(trial, request)


# An id that no message has


def _unknown_header(trial: Trial, request: Request) -> None:
    raw = unknown_frame(trial.declared, trial.random, request.place.address)
    _unknown(trial, request, raw, "a header with an id that no message has")


def _unknown_packet(trial: Trial, request: Request) -> None:
    packet = harmless_bytes(trial.declared, trial.random, trial.random.choice(_LENGTHS))
    raw = unknown_frame(trial.declared, trial.random, request.place.address, packet)
    about = f"a frame with an id that no message has, and a packet of {len(packet)} bytes"
    _unknown(trial, request, raw, about)


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


def _empty_packet(trial: Trial, request: Request) -> None:
    _with_packet(trial, request, b"")


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


def _undocumented_address(trial: Trial, request: Request) -> None:
    address = harmless_bytes(trial.declared, trial.random, 1)[0] & ~DATA_FLAG
    about = f"{request.name} to {address:#04x}, an address that the document does not have,"
    unheeded(trial, request.message.pack(address, trial.declared.framed.host), about)
    clean(trial, f"after {about}", request.place)


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


_WRONG_LENGTH: Final = {
    "empty": (_empty_packet, "A request that announces an empty packet ends with its header"),
    "long": (_packet, "A request with a packet ends with its packet"),
}

KINDS: Final = (
    Kind(
        name="unknown-id",
        title="A frame with an id that no message has is skipped, packet and all",
        rules=(
            "length-in-header",
            "data-flag",
            "data-follows-flag",
            "header-only-meaning",
            "request-answered",
        ),
        make=partial(
            _checks,
            "unknown-id",
            {
                "header": (_unknown_header, "A header with an unknown id is skipped"),
                "packet": (_unknown_packet, "A frame with an unknown id is skipped by its length"),
                "message-inside": (
                    _unknown_with_message,
                    "The packet of an unknown frame is not read as messages",
                ),
            },
        ),
    ),
    Kind(
        name="wrong-length",
        title="A frame ends where its header says, whatever its id usually has",
        rules=(
            "length-in-header",
            "data-flag-checked-first",
            "data-length-bytes",
            "request-answered",
        ),
        make=_wrong_length,
    ),
    Kind(
        name="foreign-destination",
        title="What is sent to somebody else is not answered",
        rules=(
            "slot-addressed-by-destination",
            "address-values",
            "generic-unit-address",
            "request-answered",
        ),
        make=partial(
            _checks,
            "foreign-destination",
            {
                "undocumented": (
                    _undocumented_address,
                    "Nothing answers at an address that the document does not have",
                ),
                "documented": (_address_of_others, "Nothing answers where nothing is declared"),
            },
        ),
    ),
)
