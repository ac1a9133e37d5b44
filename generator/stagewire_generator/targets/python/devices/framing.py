"""What device classes look like by the framing of their protocol: levels of classes, and addresses."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

from stagewire_generator.framing import part
from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.python.brackets import Source
from stagewire_generator.targets.python.devices.plan import Call

Shape: TypeAlias = Mapping[str, tuple[str, str]]
"""Level (channel, bay, device) -> what the name of its class ends with, and its base in the runtime."""

DEVICE: Final = "device"
"""The level of the device itself."""


@dataclass(frozen=True, slots=True)
class DeviceFraming:
    """What differs between device classes by their framing.

    :param shape: returns the levels of the classes of a unit, whose entry is given.
    :param addresses: yields where a unit is reached, as arguments of its facts.
    :param names_channel: tells whether a call names a channel of its unit.
    """

    shape: Callable[[Protocol, Json], Shape]
    addresses: Callable[[Protocol, Json], Iterator[Source]]
    names_channel: Callable[[Protocol, Sequence[Call]], bool]


def device_framing_of(protocol: Protocol) -> DeviceFraming:
    """Return what the framing of a protocol makes of its device classes."""
    framing: DeviceFraming = part(protocol.framing["kind"], "devices")
    return framing
