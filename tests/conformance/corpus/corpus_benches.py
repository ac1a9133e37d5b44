"""The controllers of the corpus with their declarations and permissions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from corpus_lines import CorpusLink, Maker, SteppedCorpusLink
from corpus_ms2000 import Ms2000
from corpus_rack import Rack
from corpus_stepper import Stepper
from corpus_tdc001 import ShortTdc001, Tdc001
from corpus_z8 import Z8Tdc001

from declared_benches import DeclaredBench
from stagewire_conformance.device.permissions import Range
from stagewire_conformance.device.pics import ChannelPics, Pics, Timing
from stagewire_conformance.device.report import Report
from stagewire_conformance.device.run import run

_TIMING = Timing(reply_p99_ms=20.0)


@dataclass(frozen=True)
class CorpusBench(DeclaredBench):
    """A controller of the corpus with its declaration and permissions.

    :param make: makes the correct controller.
    """

    make: Maker

    def run(
        self, make: Maker | None = None, line: Callable[[Maker], CorpusLink] = SteppedCorpusLink
    ) -> Report:
        """Run the whole suite on a controller; on the correct one by default."""
        return run(line(make or self.make), self.checks, self.declared, self.allowed, 1)


BENCHES = {
    "tdc001": CorpusBench(
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
        Tdc001,
    ),
    "short": CorpusBench(
        Pics(
            unit="TDC001",
            line="usb",
            channels=(
                ChannelPics(
                    number=1,
                    counts_per_mm=Fraction(34304),
                    travel=Range.parse("-10291..171520counts"),
                ),
            ),
            timing=_TIMING,
        ),
        "-10291..171520counts",
        ShortTdc001,
    ),
    "z8": CorpusBench(
        Pics(
            unit="TDC001",
            line="usb",
            channels=(
                ChannelPics(number=1, stage="Z812", travel=Range.parse("-10291..428800counts")),
            ),
            timing=_TIMING,
        ),
        "-10291..171520counts",
        Z8Tdc001,
    ),
    "stepper": CorpusBench(
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
        Stepper,
    ),
    "rack": CorpusBench(
        Pics(
            unit="BSC102",
            line="rs232",
            channels=tuple(
                ChannelPics(
                    number=1,
                    bay=bay,
                    stage="APT_STEPPER",
                    travel=Range.parse("-7680..320000counts"),
                )
                for bay in (1, 2)
            ),
            timing=_TIMING,
        ),
        "-7680..128000counts",
        Rack,
    ),
    "ms2000": CorpusBench(
        Pics(
            unit="MS2000",
            channels=tuple(
                ChannelPics(axis=axis, travel=Range.parse("-20..20mm")) for axis in "XY"
            ),
            firmware="3.3",
            timing=_TIMING,
        ),
        "-20..20mm",
        Ms2000,
    ),
}
"""The controllers by name."""
