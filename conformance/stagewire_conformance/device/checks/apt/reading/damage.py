"""What is no frame: one that is cut short, and bytes that never were any; afterwards all is well again.

The document does not say how soon a controller has to find out. So a second of silence is left after what was
damaged, and what comes then has to be answered at last; at once is what it should be.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from random import Random
from typing import TYPE_CHECKING, Final

from stagewire.protocols import DATA_FLAG, HEADER_SIZE
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.clean import (
    before_clean_request,
    clean,
    clean_request,
    unheeded,
)
from stagewire_conformance.device.checks.apt.replies import Request

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.trial import Trial


def harmless_bytes(declared: Declaration, random: Random, count: int) -> bytes:
    """Return bytes in which no message begins, wherever one looks for it.

    The second byte of no id is among them, and no address, so that not even a receiver that is out of step
    finds a message that is meant for it.
    """
    return bytes(random.choices(_harmless(declared), k=count))


def unknown_frame(
    declared: Declaration, random: Random, dest: int, packet: bytes | None = None
) -> bytes:
    """Return a frame with an id that no message has.

    :param packet: what follows the header; None: nothing does.
    """
    host = declared.framed.host
    id = harmless_bytes(declared, random, 2)
    if packet is None:
        return id + harmless_bytes(declared, random, 2) + bytes((dest, host))
    length = len(packet).to_bytes(2, "little")
    return id + length + bytes((dest | DATA_FLAG, host)) + packet


def _harmless(declared: Declaration) -> list[int]:
    protocol = declared.framed
    ids = [entry["id"] for entry in declared.registry.messages.values() if entry["id"] is not None]
    addresses = {protocol.host, *protocol.devices}
    telling = {id >> 8 for id in ids} | addresses | {address | DATA_FLAG for address in addresses}
    return [byte for byte in range(256) if byte not in telling]


_SILENCE: Final = 1.1
"""Seconds after something damaged in which a controller gives up waiting for the rest."""

_TRIES: Final = 6
"""Requests after which one has to be answered, even if a controller takes them for the rest of a packet."""

_PACKET: Final = 24

_Damage = Callable[["Trial", Request], tuple[bytes, str]]
"""Makes what is sent instead of a request, and says what it is."""


TRUNCATED: Final = Kind(
    name="truncated",
    title="After a frame that was cut short, a clean request is answered",
    rules=("header-six-bytes", "data-length-bytes", "request-answered"),
)
GARBAGE: Final = Kind(
    name="garbage",
    title="After bytes that are no frame, a clean request is answered",
    rules=("header-six-bytes", "request-answered"),
)


def _damage(kind: Kind, name: str, title: str) -> Callable[[_Damage], _Damage]:
    """Declare a way to damage a request as a check; a decorator."""

    def declare(damage: _Damage) -> _Damage:
        kind.check(title, name=name, seconds=_SILENCE + 0.1, each=before_clean_request)(
            partial(_run, damage=damage)
        )
        return damage

    return declare


def _run(trial: Trial, damage: _Damage) -> None:
    request = clean_request(trial.declared)
    assert request is not None  # else there is no check
    raw, about = damage(trial, request)
    with trial.line.silent():  # a sign of life would be taken for the rest
        unheeded(trial, raw, about, _SILENCE)
        clean(trial, f"after {about}", request.place, tries=_TRIES)


@_damage(TRUNCATED, "header", "A clean request is answered after a part of a header")
def _part_of_header(trial: Trial, request: Request) -> tuple[bytes, str]:
    raw = request.message.pack(request.place.address, trial.declared.framed.host)
    count = trial.random.randrange(1, HEADER_SIZE)
    return raw[:count], f"{count} of the {HEADER_SIZE} bytes of {request.name}"


@_damage(TRUNCATED, "packet", "A clean request is answered after a part of a packet")
def _part_of_packet(trial: Trial, request: Request) -> tuple[bytes, str]:
    """Cut a frame that nothing can be made of, whatever comes as its rest."""
    packet = harmless_bytes(trial.declared, trial.random, _PACKET)
    raw = unknown_frame(trial.declared, trial.random, request.place.address, packet)
    missing = trial.random.randrange(1, _PACKET)
    return raw[:-missing], f"a frame whose packet lacks {missing} of {_PACKET} bytes"


def _garbage(trial: Trial, request: Request, counts: range) -> tuple[bytes, str]:
    count = trial.random.choice(counts)
    return harmless_bytes(trial.declared, trial.random, count), f"{count} bytes of garbage"


_damage(GARBAGE, "one", "A stray byte does no harm")(partial(_garbage, counts=range(1, 2)))
_damage(GARBAGE, "many", "Many stray bytes do no harm")(partial(_garbage, counts=range(7, 90)))
