"""Virtual controllers as declared by a vendor: with stages, travel, and empty bays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import stagewire_virtual
from declared_benches import DeclaredBench
from stagewire import FramedMessage
from stagewire.links import Link
from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_conformance.device.declaration import known_units
from stagewire_conformance.device.permissions import Range
from stagewire_conformance.device.pics import BayPics, ChannelPics, Pics, Timing
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.run import run
from stagewire_virtual import VirtualController
from stagewire_virtual.factory import simulated_units
from stagewire_virtual.linking import SteppedLink

HOST, USB = 0x01, 0x50

REPLY_MS = 20.0
"""The reply time that every vendor promises here."""


@dataclass(frozen=True)
class Bench(DeclaredBench):
    """A unit with its declaration and permissions.

    :param make: makes the controller; ``seed`` seeds its random choices.
    """

    make: Callable[..., VirtualController]

    @property
    def unit(self) -> str:
        """The name of the unit."""
        return self.pics.unit

    @property
    def status(self) -> str:
        """The status layout of the unit; for a rack of modules, that of the first module."""
        return next((place.status for place in self.declared.places if place.status), "")

    def line(self, seed: int = 0) -> SteppedLink:
        """Make the controller, and a line to it in stepped time."""
        return SteppedLink(self.make(seed=seed))

    def run(self, link: Link, kinds: frozenset[str] = frozenset(), seed: int = 1) -> Report:
        """Run the suite with all permissions.

        :param kinds: the kinds to run; empty for all.
        """
        checks = [c for c in self.checks if not kinds or (c.kind and c.kind.name in kinds)]
        return run(link, checks, self.declared, self.allowed, seed)


def _counts(low: int, high: int) -> Range:
    return Range.parse(f"{low}..{high}counts")


def _plain(unit: str, motion: int) -> Bench:
    """Return a unit with only its name declared, which may move from 0 to ``motion`` counts."""
    pics = Pics(unit=unit, timing=Timing(reply_p99_ms=REPLY_MS))
    return Bench(pics, f"0..{motion}counts", getattr(stagewire_virtual, unit))


def _on_stage(unit: str, stage: str, travel: str, motion: str, bays: int = 0) -> Bench:
    """Return a motor controller with the same stage on every channel."""
    channels = tuple(
        ChannelPics(number=1, bay=bay, stage=stage, travel=Range.parse(travel))
        for bay in (range(1, bays + 1) if bays else (None,))
    )
    pics = Pics(unit=unit, channels=channels, timing=Timing(reply_p99_ms=REPLY_MS))
    factory = getattr(stagewire_virtual, unit)
    return Bench(pics, motion, lambda **given: factory(stage=getattr(stages, stage), **given))


def _in_counts(unit: str, channels: int = 1, bays: int = 0, **given: Any) -> Bench:
    """Return a motor controller with a travel in counts."""
    travel = 100_000
    declared = tuple(
        ChannelPics(number=number, bay=bay, travel=_counts(0, travel))
        for bay in (range(1, bays + 1) if bays else (None,))
        for number in range(1, channels + 1)
    )
    pics = Pics(unit=unit, channels=declared, timing=Timing(reply_p99_ms=REPLY_MS))
    factory = getattr(stagewire_virtual, unit)
    return Bench(pics, f"0..{travel}counts", lambda **more: factory(travel=travel, **given, **more))


def _prepared(
    unit: str, *messages: FramedMessage, bays: Sequence[int] = (USB,), **given: Any
) -> Bench:
    """Return a unit with settings and outputs of its own; each bay gets all messages."""
    plain = _plain(unit, 30_000)

    def make(seed: int = 0) -> VirtualController:
        controller = plain.make(seed=seed, **given)
        for message in messages:
            for bay in bays:
                controller.write(message.pack(bay, HOST))
        controller.advance(0.5)
        controller.read()
        return controller

    return replace(plain, make=make)


def _rack() -> Bench:
    """Return a rack with a motor module, an empty bay and a piezo module."""
    bays = (BayPics(number=1, unit="MST601"), BayPics(number=3, unit="MPZ601"))
    pics = Pics(unit="RACK", bays=bays, timing=Timing(reply_p99_ms=REPLY_MS))

    def make(seed: int = 0) -> VirtualController:
        return stagewire_virtual.rack("MST601", None, "MPZ601", seed=seed)

    return Bench(pics, "0..20000counts", make)


def _with_an_empty_bay() -> Bench:
    bays = (BayPics(number=1), BayPics(number=3))
    pics = Pics(unit="BSC103", bays=bays, timing=Timing(reply_p99_ms=REPLY_MS))
    return Bench(
        pics,
        "0..100000counts",
        lambda **given: stagewire_virtual.BSC103(empty_bays={2}, **given),
    )


def _on_rs232() -> Bench:
    pics = Pics(unit="TDC001", line="rs232", timing=Timing(reply_p99_ms=REPLY_MS))
    return Bench(
        pics, "0..100000counts", lambda **given: stagewire_virtual.TDC001(line="rs232", **given)
    )


def _ms2000(unit: str) -> Bench:
    channels = tuple(ChannelPics(axis=axis) for axis in ("X", "Y"))
    pics = Pics(unit=unit, channels=channels, timing=Timing(reply_p99_ms=REPLY_MS))
    return Bench(pics, "-20..20mm", getattr(stagewire_virtual, unit))


_BAYS = (0x21, 0x22, 0x23)
_THIRD = m.PzSetOutputVolts(1, 10_000)
"""An output voltage of about a third of the maximum."""
_HIGHEST = m.PzSetOutputMaxVolts(1, voltage=1500, flags=0)
_IO = m.KpcSetIoSettings(
    1,
    voltage_limit=150,
    analog_input=3,
    filter=0,
    voltage_range=150,
    force_sense=100,
    strain_gauge_option=0,
)

_ALIGNERS = ("KPA101", "TPA101", "TQD001")
_SPECIAL: Mapping[str, Bench] = {
    "TDC001": _on_stage("TDC001", "Z8", "0..12mm", "0..5mm"),
    "BBD102": _on_stage("BBD102", "MLS203", "0..110mm", "0..40mm", bays=2),
    "BBD101": _on_stage("BBD101", "MLS203", "0..110mm", "0..40mm", bays=1),
    "TST001": _in_counts("TST001"),
    "OST001": _in_counts("OST001"),
    "ODC001": _in_counts("ODC001"),
    "BSC002": _in_counts("BSC002", channels=2),
    "BSC102": _in_counts("BSC102", bays=2),
    "KPZ101": _prepared("KPZ101", m.PzSetTpzIoSettings(1, 3, 1), _THIRD),
    "KPC101": _prepared("KPC101", _IO, _THIRD),
    "KSG101": _prepared("KSG101", position=50),
    "BPC302": _prepared("BPC302", _HIGHEST, _THIRD, bays=_BAYS[:2]),
    "BPC303": _prepared("BPC303", _HIGHEST, _THIRD, bays=_BAYS),
    "PPC001": _prepared("PPC001", _HIGHEST, _THIRD),
    "PPC102": _prepared("PPC102", _HIGHEST, _THIRD, bays=_BAYS[:2]),
    "CT1P": _prepared("CT1P", _THIRD),
    **{unit: replace(_plain(unit, 0), motion="-30000..30000counts") for unit in _ALIGNERS},
    "RACK": _rack(),
    "BSC103 with an empty bay": _with_an_empty_bay(),
    "TDC001 on RS-232": _on_rs232(),
    "MS2000": _ms2000("MS2000"),
    "MFC2000": _ms2000("MFC2000"),
}
_FAR = {"BBD201": 800_000, **dict.fromkeys(("LTS150", "LTS300", "MLJ050", "MLJ150"), 8_000_000)}
"""Unit -> how far it may move in counts, if 100,000 counts are a small part of its travel."""
BENCHES: Mapping[str, Bench] = {
    **{
        unit: _plain(unit, _FAR.get(unit, 100_000))
        for unit in known_units()
        if unit not in _SPECIAL and unit in simulated_units()
    },
    **_SPECIAL,
}
"""Every unit that can be simulated by name, some of them also in another state."""


def bench(name: str) -> Bench:
    """Return a unit by its name."""
    return BENCHES[name]
