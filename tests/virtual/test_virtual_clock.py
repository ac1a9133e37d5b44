"""Clocks: the order and instants of timers, and cancelled timers."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stagewire.errors import BadValueError
from stagewire_virtual.clock import SECOND, RealClock, SteppedClock


@given(st.lists(st.integers(0, 50), max_size=40), st.lists(st.integers(0, 20), max_size=10))
def test_timers_run_in_order_at_their_own_instants(times: list[int], steps: list[int]) -> None:
    clock = SteppedClock()
    ran: list[tuple[int, int, int]] = []
    for index, when in enumerate(times):
        clock.call_at(when, lambda w=when, i=index: ran.append((w, i, clock.now)))
    for step in [*steps, 0]:
        clock.run_until(clock.now + step)
    expected = sorted((w, i) for i, w in enumerate(times) if w <= sum(steps))
    assert [(w, i) for w, i, _ in ran] == expected
    assert all(w == now for w, _, now in ran)


def test_a_timer_may_set_the_next_one_within_the_same_step() -> None:
    clock = SteppedClock()
    ticks: list[int] = []

    def tick() -> None:
        ticks.append(clock.now)
        clock.call_later(SECOND // 10, tick)

    clock.call_later(SECOND // 10, tick)
    clock.advance(1.05)
    assert ticks == [SECOND // 10 * n for n in range(1, 11)]
    assert clock.next_due == SECOND * 11 // 10


def test_a_cancelled_timer_does_not_run_and_is_not_due() -> None:
    clock = SteppedClock()
    timer = clock.call_later(5, lambda: pytest.fail("it was cancelled"))
    later = clock.call_later(9, lambda: None)
    timer.cancel()
    timer.cancel()
    assert clock.next_due == 9
    clock.run_until(7)
    later.cancel()
    assert clock.next_due is None


def test_cancelled_timers_do_not_pile_up() -> None:
    clock = SteppedClock()
    kept = [clock.call_later(SECOND * 1000, lambda: None) for _ in range(10)]
    for _ in range(100_000):
        clock.call_later(SECOND * 3600, lambda: None).cancel()
    assert len(clock._due) < 500
    assert clock.next_due == kept[0].when


def test_a_sleeping_server_is_notified_only_of_an_earlier_timer() -> None:
    clock = SteppedClock()
    told: list[int | None] = []
    clock.on_earlier = lambda: told.append(clock.next_due)
    for when in (50, 70, 20, 20, 60):
        clock.call_at(when, lambda: None)
    assert told == [50, 20]


def test_time_does_not_go_back() -> None:
    clock = SteppedClock()
    clock.advance(1)
    clock.run_until(5)
    assert clock.now == SECOND
    for wrong in (-0.1, float("nan"), float("inf")):
        with pytest.raises(BadValueError, match="seconds must be a finite number of at least 0"):
            clock.advance(wrong)


def test_a_late_timer_on_the_real_clock_runs_at_its_own_instant() -> None:
    clock = RealClock()
    seen: list[int] = []
    clock.call_at(1, lambda: seen.append(clock.now))
    while clock.now < 1000:
        pass
    clock.run_until(clock.now)
    assert seen == [1]
    assert clock.now >= 1000
