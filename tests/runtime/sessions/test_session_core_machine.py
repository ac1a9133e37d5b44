"""The core against a model: loss, delay, duplication and cancellation never mismatch a reply.

The model has three bays with two channels each, on lines that keep the order of messages. Every reply holds
the number of its request, and every end the number of its move. Messages may be lost, duplicated or delayed.
But the answer to an exchange that was given up arrives within the quiet period or not at all, because a
later one could not be distinguished from an answer in time.
"""

from __future__ import annotations

import gc
import tracemalloc
from collections import deque

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from stepped_core import Framed, dc_status, said, vel_params

from stagewire._sessions.exchange import Exchange
from stagewire.errors import MotionStoppedError, MotionUnderWayError, StagewireError
from stagewire.sessions import Ends
from stagewire_apt import messages as m

QUIET = 0.5
BAYS = st.sampled_from((0x21, 0x22, 0x23))
CHANNELS = st.sampled_from((1, 2))
TIMEOUTS = st.sampled_from((0.2, 1.0, 3.0))
ENDS = Ends((m.MotMoveCompletedDc,), (m.MotMoveStoppedDc,))
STOPPED = Ends((m.MotMoveStoppedDc,))
NOISE = st.sampled_from(
    (
        said(dc_status(77)),
        said(dc_status(77), 0x22),
        said(m.HwResponse(), 0x21),
        bytes.fromhex("fe7f0c008121") + said(vel_params(10**9), 0x21)[:12],
        said(vel_params(10**9), 0x2A),
    )
)


class Lines(RuleBasedStateMachine):
    """The actions of a user and the events on the lines."""

    def __init__(self) -> None:
        super().__init__()
        self.talk = Framed(quiet=QUIET, pacing=0.01)
        for bay in (0x21, 0x22, 0x23):
            self.talk.core.tell(bay, status="dc")
        self.number = 0
        self.numbers: dict[Exchange, int] = {}
        self.ended_at: dict[Exchange, float] = {}
        self.moving: set[tuple[int, int]] = set()
        self.moved_last: dict[tuple[int, int], int] = {}
        # messages in transit: the bytes, and the exchange they answer if it may be given up
        self.coming: dict[int, deque[tuple[bytes, Exchange | None]]] = {
            0x21: deque(), 0x22: deque(), 0x23: deque(),
        }  # fmt: skip

    # Actions of the user

    def start(self, exchange: Exchange, on_written) -> None:
        self.number += 1
        self.numbers[exchange] = self.number
        exchange.on_written = on_written
        exchange.on_done = self.note_end
        self.talk.flush()

    def note_end(self, exchange: Exchange) -> None:
        assert exchange not in self.ended_at, "the exchange ended twice"
        self.ended_at[exchange] = self.talk.now

    @rule(bay=BAYS, channel=CHANNELS, timeout=TIMEOUTS)
    def ask(self, bay, channel, timeout) -> None:
        def answer(asked: Exchange) -> None:
            reply = vel_params(self.numbers[asked], channel)
            self.coming[bay].append((said(reply, bay), asked))

        talk = self.talk
        request = m.MotReqVelParams(channel)
        self.start(talk.core.ask(request, (m.MotGetVelParams,), bay, timeout, talk.now), answer)

    @rule(bay=BAYS)
    def send(self, bay) -> None:
        self.start(self.talk.core.send(m.ModIdentify(), bay, 1.0, self.talk.now), None)

    @rule(bay=BAYS, channel=CHANNELS, timeout=TIMEOUTS)
    def move(self, bay, channel, timeout) -> None:
        def begin(move: Exchange) -> None:
            assert (bay, channel) not in self.moving, "a second move"
            self.moving.add((bay, channel))
            self.moved_last[bay, channel] = self.numbers[move]

        talk = self.talk
        message = m.MotMoveAbsolute(channel, 5)
        try:
            move = talk.core.begin(message, ENDS, bay, timeout, talk.now)
        except MotionUnderWayError:
            return
        self.start(move, begin)

    @rule(bay=BAYS, channel=CHANNELS, timeout=TIMEOUTS)
    def halt(self, bay, channel, timeout) -> None:
        def stop(halt: Exchange) -> None:
            self.moving.discard((bay, channel))
            number = self.moved_last.get((bay, channel), -1)
            self.coming[bay].append((said(end(m.MotMoveStoppedDc, channel, number), bay), halt))

        talk = self.talk
        message = m.MotMoveStop(channel, 2)
        self.start(talk.core.halt(message, STOPPED, bay, timeout, talk.now), stop)

    @precondition(lambda self: any(not one.done for one in self.numbers))
    @rule(data=st.data())
    def cancel(self, data) -> None:
        waiting = [exchange for exchange in self.numbers if not exchange.done]
        self.talk.cancel(data.draw(st.sampled_from(waiting)))

    @rule(bay=BAYS, channel=CHANNELS)
    def read_that_nothing_moves(self, bay, channel) -> None:
        if (bay, channel) not in self.moving and not self.coming[bay]:
            self.talk.core.settled(bay, channel)

    # Events on the lines

    @rule(bay=BAYS, channel=CHANNELS)
    def complete(self, bay, channel) -> None:
        if (bay, channel) in self.moving:
            self.moving.remove((bay, channel))
            number = self.moved_last[bay, channel]
            self.coming[bay].append((said(end(m.MotMoveCompletedDc, channel, number), bay), None))

    @rule(bay=BAYS, times=st.sampled_from((0, 1, 1, 1, 2)))
    def come(self, bay, times) -> None:
        if self.coming[bay]:
            raw, owner = self.coming[bay].popleft()
            if owner is None or self.talk.now < self.ended_at.get(owner, self.talk.now) + QUIET:
                self.talk.hear(raw * times)

    @rule(noise=NOISE)
    def noise(self, noise) -> None:
        self.talk.hear(noise)

    @rule(seconds=st.sampled_from((0.005, 0.06, 0.4, 1.1)))
    def later(self, seconds) -> None:
        self.talk.later(seconds)

    # Invariants

    @invariant()
    def nobody_gets_what_is_another_s(self) -> None:
        for exchange, number in self.numbers.items():
            if (
                isinstance(exchange.error, MotionStoppedError)
                and exchange.error.message is not None
            ):
                assert exchange.error.message.position == number
            elif isinstance(exchange.message, m.MotMoveAbsolute) and exchange.result:
                assert exchange.result.message.position == number
            elif isinstance(exchange.message, m.MotReqVelParams) and exchange.result:
                assert exchange.result.message.max_velocity == number

    @invariant()
    def nothing_waits_beyond_its_time(self) -> None:
        for exchange in self.numbers:
            assert exchange.done or exchange.deadline > self.talk.now
            assert exchange.error is None or isinstance(exchange.error, StagewireError)

    @invariant()
    def an_address_answers_one_question_at_a_time(self) -> None:
        asked = [
            exchange.dest
            for exchange in self.numbers
            if isinstance(exchange.message, m.MotReqVelParams)
            and exchange.written
            and not exchange.done
        ]
        assert len(asked) == len(set(asked))

    def teardown(self) -> None:
        """In the end, a request still gets its own reply."""
        self.talk.later(5)
        assert all(exchange.done for exchange in self.numbers)
        assert self.talk.core.due is None
        asked = self.talk.ask(dest=0x21)
        self.talk.hear(said(vel_params(4711), 0x21))
        assert asked.value().message.max_velocity == 4711


def end(kind, channel: int, number: int):
    return kind(chan_ident=channel, position=number, velocity=0, status_bits=0)


TestLines = Lines.TestCase
TestLines.settings = settings(
    max_examples=100, stateful_step_count=60, deadline=None, derandomize=True
)


def test_losses_do_not_make_memory_grow():
    talk = Framed(quiet=0.5)
    news = talk.core.subscribe(limit=10)

    def work(rounds: int) -> None:
        for number in range(rounds):
            bay = 0x21 + number % 3
            talk.ask(dest=bay, timeout=0.2)
            if number % 3:
                talk.hear(said(vel_params(number), bay))
            move = talk.move(bay) if number % 7 == 0 else None
            talk.hear(said(dc_status(), bay), bytes((number % 256,)) * 7)
            talk.later(0.8)
            if move is not None:
                talk.halt(bay, timeout=0.1)
                talk.hear(said(m.MotMoveStoppedHeader(1), bay))
            talk.wrote = b""

    work(300)
    tracemalloc.start()
    try:
        work(100)
        gc.collect()  # after other tests, cycles are collected only rarely
        before, _ = tracemalloc.get_traced_memory()
        work(600)
        gc.collect()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert talk.core.statistics.timed_out > 200
    assert len(news) == 10
    assert after - before < 20_000
