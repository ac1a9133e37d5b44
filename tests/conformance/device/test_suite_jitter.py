"""The jitter of the computer, and conclusions that it rules out."""

from __future__ import annotations

import pytest

from stagewire_conformance.device.lines.line import Jitter, jitter_of, percentile


class LateLine:
    """A line whose waits end late, by a list of delays."""

    def __init__(self, *late: float) -> None:
        self.now = 100.0
        self.waits: list[float] = []
        self._late = late

    def listen(self, seconds: float) -> list[object]:
        self.now += seconds + self._late[len(self.waits) % len(self._late)]
        self.waits.append(seconds)
        return []


def test_fifty_short_waits_are_measured() -> None:
    line = LateLine(0.001, 0.003)
    jitter = jitter_of(line)
    assert line.waits == [0.005] * 50
    assert jitter.typical == pytest.approx(0.001)
    assert jitter.late == pytest.approx(0.003)


def test_a_wait_that_ends_early_counts_as_on_time() -> None:
    jitter = jitter_of(LateLine(-0.004))
    assert (jitter.typical, jitter.late) == (0.0, 0.0)


def test_jitter_above_a_fifth_of_a_tolerance_rules_out_a_conclusion() -> None:
    jitter = Jitter(typical=0.0005, late=0.002)
    assert jitter.blurs(0.009)
    assert not jitter.blurs(0.01)
    assert "2.00 ms late" in str(jitter)


@pytest.mark.parametrize(
    ("share", "value"), [(0, 1.0), (1, 1.0), (50, 50.0), (99, 99.0), (100, 100.0)]
)
def test_percentile_is_the_smallest_value_that_covers_the_share(share: int, value: float) -> None:
    assert percentile([float(number) for number in range(100, 0, -1)], share) == value


def test_percentile_of_few_values() -> None:
    assert percentile([7.0], 99) == 7.0
    assert percentile([1.0, 2.0], 50) == 1.0
    with pytest.raises(ValueError, match="nothing was measured"):
        percentile([], 50)
