"""The controllers of the corpus with their declarations and permissions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from corpus_lines import CorpusLink, Maker, SteppedCorpusLink
from corpus_ms2000 import Ms2000
from corpus_stepper import Stepper
from corpus_tdc001 import Tdc001

from stagewire_conformance.device.check import Check
from stagewire_conformance.device.declaration import Declaration, declare
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.pics import ChannelPics, Pics, Timing
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.run import run

_TIMING = Timing(reply_p99_ms=20.0)


@dataclass(frozen=True)
class CorpusBench:
    """A controller as its vendor declares it, with everything allowed.

    :param make: makes the correct controller.
    :param motion: the range of ``--allow-motion``.
    """

    make: Maker
    pics: Pics
    motion: str

    @cached_property
    def declared(self) -> Declaration:
        return declare(self.pics)

    @cached_property
    def allowed(self) -> Permissions:
        return Permissions(settings=True, motion=Range.parse(self.motion), eeprom=True)

    @cached_property
    def checks(self) -> list[Check]:
        return plan(self.declared, self.allowed)

    def run(
        self, make: Maker | None = None, line: Callable[[Maker], CorpusLink] = SteppedCorpusLink
    ) -> Report:
        """Run the whole suite on a controller; on the correct one by default."""
        return run(line(make or self.make), self.checks, self.declared, self.allowed, 1)


BENCHES = {
    "tdc001": CorpusBench(
        Tdc001,
        Pics(
            unit="TDC001",
            line="usb",
            channels=(
                ChannelPics(
                    number=1,
                    counts_per_mm=Fraction(34304),
                    travel=Range.parse("-10291..428800counts"),
                ),
            ),
            timing=_TIMING,
        ),
        "-10291..171520counts",
    ),
    "stepper": CorpusBench(
        Stepper,
        Pics(
            unit="BSC101",
            line="rs232",
            channels=(
                ChannelPics(
                    number=1, stage="APT_STEPPER", travel=Range.parse("-7680..320000counts")
                ),
            ),
            timing=_TIMING,
        ),
        "-7680..128000counts",
    ),
    "ms2000": CorpusBench(
        Ms2000,
        Pics(
            unit="MS2000",
            channels=tuple(
                ChannelPics(axis=axis, travel=Range.parse("-20..20mm")) for axis in "XY"
            ),
            firmware="3.3",
            timing=_TIMING,
        ),
        "-20..20mm",
    ),
}
"""The controllers by name."""
