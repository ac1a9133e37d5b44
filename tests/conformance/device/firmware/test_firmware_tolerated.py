"""Known differences of real controllers from virtual ones are not failures, and motion stays in the range."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from firmware_bench import Bench, bench
from firmware_frames import Frame
from firmware_line import FaultyLink, Firmware

from stagewire_conformance.device.report import Report
from stagewire_conformance.device.results import Result
from stagewire_virtual.linking import SteppedLink

STATUS = ("MOT_GET_STATUSUPDATE", "MOT_GET_DCSTATUSUPDATE")
ENDS = ("MOT_MOVE_COMPLETED", "MOT_MOVE_STOPPED", "MOT_MOVE_HOMED")
MOVING = 0xF0
HOMING = 0x200
MOVES = frozenset({"home", "move-absolute", "move-relative", "move-velocity", "move-stop"})


class LateBits(Firmware):
    """Motion bits appear 50 ms after the motion began."""

    def __init__(self) -> None:
        self.began: dict[int, float] = {}

    def says(self, frame: Frame) -> None:
        if frame.name in STATUS:
            bits, now = frame["status_bits"], self.now()
            if bits & (MOVING | HOMING):
                if now - self.began.setdefault(frame.source, now) < 0.05:
                    frame = frame.with_("status_bits", bits & ~(MOVING | HOMING))
            else:
                self.began.pop(frame.source, None)
        self.say(frame.raw)


class SlowToSettle(Firmware):
    """A motion bit remains set for 0.1 s after the end message."""

    def __init__(self) -> None:
        self.ended: dict[int, float] = {}

    def says(self, frame: Frame) -> None:
        if frame.name in ENDS:
            self.ended[frame.source] = self.now()
        if frame.name in STATUS and self.now() - self.ended.get(frame.source, -1.0) < 0.1:
            frame = frame.with_("status_bits", frame["status_bits"] | 0x10)
        self.say(frame.raw)


class Trembles(Firmware):
    """A servo holds its stage within three counts, also at the end of the range."""

    def __init__(self) -> None:
        self.count = 0

    def says(self, frame: Frame) -> None:
        if frame.name in (*STATUS, *ENDS) and "position" in frame.fields:
            self.count += 1
            frame = frame.with_("position", frame["position"] + self.count % 7 - 3)
        self.say(frame.raw)


class StaleEnd(Firmware):
    """The end message of a move has both motion bits, as known from the K10CR1."""

    def says(self, frame: Frame) -> None:
        if frame.name in ENDS and "status_bits" in frame.fields:
            frame = frame.with_("status_bits", frame["status_bits"] | 0x30)
        self.say(frame.raw)


class StopsReportedForAll(Firmware):
    """The stop of a channel is reported for all channels, as by the simulated KIM101 of the vendor."""

    def says(self, frame: Frame) -> None:
        stopped = frame.name == "PZMOT_MOVE_STOPPED"
        for channel in (1, 2, 4, 8) if stopped else ():
            self.say(frame.with_("chan_ident", channel).raw)
        if not stopped:
            self.say(frame.raw)


class Frozen(Firmware):
    """The status always reports the same position."""

    def says(self, frame: Frame) -> None:
        if frame.name in STATUS:
            frame = frame.with_("position", 0)
        self.say(frame.raw)


class Late(Firmware):
    """All messages are 0.9 s late."""

    def says(self, frame: Frame) -> None:
        self.say(frame.raw, after=0.9)


def run_on(unit: Bench, firmware: Firmware, kinds: frozenset[str]) -> Report:
    return unit.run(FaultyLink(unit.line(), firmware, unit.status), kinds)


def worst_of(report: Report) -> dict[str, list[str]]:
    return {
        f"{outcome.result} {outcome.check.id}": [finding.text for finding in outcome.findings]
        for outcome in report.outcomes
        if outcome.result in (Result.FAIL, Result.NON_STRICT)
    }


@pytest.mark.parametrize("make", [LateBits, SlowToSettle, Trembles])
@pytest.mark.parametrize("unit", ["TDC001", "BSC103"])
def test_known_behaviour_of_real_controllers_passes(
    unit: str, make: Callable[[], Firmware]
) -> None:
    report = run_on(bench(unit), make(), MOVES)
    assert not report.unfinished
    assert not worst_of(report)


def test_a_stop_reported_for_all_channels_of_a_drive_is_a_note() -> None:
    report = run_on(bench("KIM101"), StopsReportedForAll(), frozenset({"actuator-stop"}))
    assert not worst_of(report)
    notes = [finding.text for outcome in report.outcomes for finding in outcome.findings]
    assert len([text for text in notes if "PZMOT_MOVE_STOPPED also came for channel" in text]) >= 4


def test_stale_bits_in_an_end_message_are_non_strict() -> None:
    report = run_on(bench("TDC001"), StaleEnd(), frozenset({"move-absolute"}))
    results = [outcome.result for outcome in report.outcomes]
    assert results.count(Result.NON_STRICT) == 1
    assert Result.FAIL not in results


@pytest.mark.parametrize("firmware", [Frozen(), Late()])
def test_motion_stays_in_the_range_with_stale_or_late_messages(firmware: Firmware) -> None:
    unit = bench("BBD102")
    controller = unit.make()
    link = FaultyLink(SteppedLink(controller), firmware, unit.status)
    places = []
    axis = controller.instrument.channel(1, 1).behaviour._axis
    ask = link.write

    def write(data: bytes) -> None:
        places.append(axis.place)
        ask(data)

    link.write = write  # type: ignore[method-assign]
    unit.run(link, frozenset({"move-velocity"}))
    assert max(places) > min(places)  # something did move
    assert max(places) - places[0] <= 800_000
