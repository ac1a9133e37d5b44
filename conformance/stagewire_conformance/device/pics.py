"""What a vendor declares of a controller (a PICS): plain data, as a file says it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from stagewire_conformance.device.permissions import Range


@dataclass(frozen=True, kw_only=True)
class ChannelPics:
    """What is connected to one channel, or to one axis.

    :param number: of the channel, from 1 on; of an axis 1.
    :param bay: from 1 on; None for what is in no bay.
    :param axis: by its name, such as ``X``.
    :param stage: a stage of the registry, by its name; empty: none of them.
    :param counts_per_mm: of another stage; None: not known.
    :param travel: where the stage can go; None: not known.
    :param homes: whether it can be sent home.
    :param limit_switches: whether its ends have switches.
    """

    number: int = 1
    bay: int | None = None
    axis: str | None = None
    stage: str = ""
    counts_per_mm: Fraction | None = None
    travel: Range | None = None
    homes: bool = True
    limit_switches: bool = True


@dataclass(frozen=True, kw_only=True)
class BayPics:
    """A bay of a rack that holds a card or a module.

    :param number: from 1 on.
    :param unit: the module, by its name; empty: a card of the rack's own kind.
    :param unsupported: messages that it does not take, with the reasons.
    """

    number: int
    unit: str = ""
    unsupported: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Timing:
    """What the vendor promises.

    :param reply_p99_ms: within which 99 of 100 replies come; None: nothing is promised.
    """

    reply_p99_ms: float | None = None


@dataclass(frozen=True, kw_only=True)
class Pics:
    """All that is declared.

    :param unit: its name; ``RACK`` is a rack of modules.
    :param protocol: empty: that of the unit.
    :param line: ``usb``, where a controller wants signs of life, or ``rs232``.
    :param unsupported: messages of the unit's list that it does not take, with the reasons.
    :param bays: those that are occupied; None: all, by cards of the rack's own kind.
    :param firmware: its version, such as ``3.3``; empty: not known.
    :param digest: SHA-256 of the file; empty where there is none.
    """

    unit: str
    protocol: str = ""
    line: str = "usb"
    unsupported: Mapping[str, str] = field(default_factory=dict)
    channels: tuple[ChannelPics, ...] = ()
    bays: tuple[BayPics, ...] | None = None
    timing: Timing = field(default_factory=Timing)
    firmware: str = ""
    digest: str = ""
