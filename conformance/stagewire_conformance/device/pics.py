"""A vendor's declaration of a controller (a PICS, protocol implementation conformance statement), as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from stagewire import Stage
from stagewire_conformance.device.permissions import Range


@dataclass(frozen=True, kw_only=True)
class ChannelPics:
    """The stage or actuator on a channel or axis.

    :param number: of the channel, counted from 1; always 1 for an axis.
    :param bay: counted from 1; None outside a rack.
    :param axis: its name, such as ``X``.
    :param stage: the name of a stage in the registry, or of the user; empty for any other stage.
    :param own: the stage of the user with this name; None for a stage in the registry.
    :param counts_per_mm: of a stage that is not in the registry; None if unknown.
    :param travel: of the stage; None if unknown.
    :param homes: whether the stage can home.
    :param limit_switches: whether the stage has limit switches.
    """

    number: int = 1
    bay: int | None = None
    axis: str | None = None
    stage: str = ""
    own: Stage | None = None
    counts_per_mm: Fraction | None = None
    travel: Range | None = None
    homes: bool = True
    limit_switches: bool = True


@dataclass(frozen=True, kw_only=True)
class BayPics:
    """An occupied bay of a rack.

    :param number: counted from 1.
    :param unit: the name of the module; empty for a card of the rack.
    :param unsupported: messages that it does not support, with the reasons.
    """

    number: int
    unit: str = ""
    unsupported: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Promises of the vendor.

    :param reply_p99_ms: the time within which 99 of 100 replies arrive; None without a promise.
    """

    reply_p99_ms: float | None = None


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """The lines of a report that identify the controller and the tester; empty if not stated."""

    vendor: str = ""
    product: str = ""
    revision: str = ""
    tester: str = ""


@dataclass(frozen=True, kw_only=True)
class Pics:
    """A complete declaration.

    :param unit: its name; ``RACK`` for a rack of modules.
    :param protocol: empty for that of the unit.
    :param line: ``usb`` if the controller needs keep-alive messages, otherwise ``rs232``.
    :param unsupported: documented messages that the unit does not support, with the reasons.
    :param bays: the occupied bays; None if all are occupied by cards of the rack.
    :param motherboard: whether a controller with bays has a motherboard.
    :param issue: the issue of the document that the firmware follows, such as ``37``; empty for the first
        one that describes the unit.
    :param firmware: its version, such as ``3.3``; empty if unknown.
    :param digest: SHA-256 of the file; empty without a file.
    """

    unit: str
    protocol: str = ""
    line: str = "usb"
    unsupported: Mapping[str, str] = field(default_factory=dict)
    channels: tuple[ChannelPics, ...] = ()
    bays: tuple[BayPics, ...] | None = None
    motherboard: bool = True
    certificate: Certificate = field(default_factory=Certificate)
    timing: Timing = field(default_factory=Timing)
    issue: str = ""
    firmware: str = ""
    digest: str = ""
