"""Truncated frames and stray bytes, after which the controller must recover.

No sentence of the document demands it, so the findings are about robustness, and are not part of the
verdict. The checks wait for a second of silence, and then repeat a request several times. One of them must be
answered; it should be the first.
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
    """Return bytes that contain no message at any offset.

    They include neither the high byte of an id nor an address, so that even a receiver that is out of step
    does not find a message for it.
    """
    return bytes(random.choices(_harmless(declared), k=count))


def unknown_frame(
    declared: Declaration, random: Random, dest: int, packet: bytes | None = None
) -> bytes:
    """Return a frame with an unknown id.

    :param packet: the data after the header; None: there is none.
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
"""Seconds after a damaged frame in which a controller gives up waiting for the rest."""

_TRIES: Final = 6
"""The most requests before one must be answered, even if a controller takes some for the rest of a packet."""

_PACKET: Final = 24

_Damage = Callable[["Trial", Request], tuple[bytes, str]]
"""Makes the bytes to send instead of a request, and their description."""


TRUNCATED: Final = Kind(
    name="truncated",
    title="A valid request after a truncated frame is answered",
    robustness=True,
)
GARBAGE: Final = Kind(
    name="garbage",
    title="A valid request after stray bytes is answered",
    robustness=True,
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
    request = clean_request(trial.declared, causes=trial.causes)
    assert request is not None  # else there is no check
    raw, about = damage(trial, request)
    with trial.line.silent():  # a keep-alive message would be taken for the rest
        unheeded(trial, raw, about, _SILENCE)
        clean(trial, f"after {about}", request.place, tries=_TRIES)


@_damage(TRUNCATED, "header", "A valid request after part of a header is answered")
def _part_of_header(trial: Trial, request: Request) -> tuple[bytes, str]:
    raw = request.message.pack(request.place.address, trial.declared.framed.host)
    count = trial.random.randrange(1, HEADER_SIZE)
    return raw[:count], f"{count} of the {HEADER_SIZE} bytes of {request.name}"


@_damage(TRUNCATED, "packet", "A valid request after part of a packet is answered")
def _part_of_packet(trial: Trial, request: Request) -> tuple[bytes, str]:
    """Truncate a frame that is harmless, whatever completes it."""
    packet = harmless_bytes(trial.declared, trial.random, _PACKET)
    raw = unknown_frame(trial.declared, trial.random, request.place.address, packet)
    missing = trial.random.randrange(1, _PACKET)
    return raw[:-missing], f"a frame whose packet lacks {missing} of {_PACKET} bytes"


def _garbage(trial: Trial, request: Request, counts: range) -> tuple[bytes, str]:
    count = trial.random.choice(counts)
    return harmless_bytes(trial.declared, trial.random, count), f"{count} stray bytes"


_damage(GARBAGE, "one", "A valid request after one stray byte is answered")(
    partial(_garbage, counts=range(1, 2))
)
_damage(GARBAGE, "many", "A valid request after many stray bytes is answered")(
    partial(_garbage, counts=range(7, 90))
)
