"""Bytes and frames that start nothing, whatever a controller takes them for."""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING

from stagewire.protocols import DATA_FLAG

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared


def harmless_bytes(declared: Declared, random: Random, count: int) -> bytes:
    """Return bytes in which no message begins, wherever one looks for it.

    The second byte of no id is among them, and no address, so that not even a receiver that is out of step
    finds a message that is meant for it.
    """
    return bytes(random.choices(_harmless(declared), k=count))


def unknown_frame(
    declared: Declared, random: Random, dest: int, packet: bytes | None = None
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


def _harmless(declared: Declared) -> list[int]:
    protocol = declared.framed
    ids = [entry["id"] for entry in declared.registry.messages.values() if entry["id"] is not None]
    addresses = {protocol.host, *protocol.devices}
    telling = {id >> 8 for id in ids} | addresses | {address | DATA_FLAG for address in addresses}
    return [byte for byte in range(256) if byte not in telling]
