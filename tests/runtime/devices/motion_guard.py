"""A model test of the motion guard: no move is sent while another may be under way, even after line losses.

To choose the number of examples, run it as a program: ``python motion_guard.py --examples 20000``.
"""

from __future__ import annotations

import argparse
import logging
from contextlib import ExitStack, suppress
from importlib import import_module
from typing import Any, ClassVar

from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    precondition,
    rule,
    run_state_machine_as_test,
)
from reopened_link import URL, KeptController, Side, lines_to

from stagewire.errors import (
    LinkOpenError,
    MotionStoppedError,
    MotionUnderWayError,
    ReplyTimeoutError,
    SessionClosedError,
    StagewireError,
    TransportLostError,
)

GONE = (TransportLostError, SessionClosedError)
TARGETS = st.sampled_from((0, 500, 40_000, 340_000))
FAILURES = st.sampled_from(("unreachable", "no answer", "cut"))
SECONDS = st.sampled_from((0.01, 0.3, 0.6, 2.5, 30.0))


class MotionGuard(RuleBasedStateMachine):
    """Actions of a user on one device, and events on its line.

    The controller itself fails the example if it receives a move that should have been refused.
    """

    asynchronous: ClassVar[bool]

    def __init__(self) -> None:
        super().__init__()
        self.stack = ExitStack()
        self.kept = KeptController()
        self.stack.enter_context(lines_to(lambda: self.kept))
        self.side = Side(self.asynchronous)
        self.tdc: Any = None
        self.motion: Any = None

    @initialize(on_close=st.sampled_from(("stop", "leave")))
    def open(self, on_close: str) -> None:
        cls = import_module(self.side.package).TDC001
        self.tdc = self.side.run(
            lambda: cls.open(URL, background=False, motion_timeout=2, on_close=on_close)
        )

    @property
    def is_open(self) -> bool:
        session = self.tdc.session
        return not (session.closed or session.lost or self.kept.deaf) and (
            self.kept.controller.link.connected and not self.kept.cut_at_write
        )

    # Actions of the user

    @rule(counts=TARGETS)
    def move(self, counts: int) -> None:
        try:
            self.motion = self.side.run(lambda: self.tdc.start_move_absolute(counts=counts))
        except (MotionUnderWayError, *GONE):
            return

    @rule(forward=st.booleans())
    def run_on(self, forward: bool) -> None:
        try:
            self.motion = self.side.run(
                lambda: self.tdc.start_move_velocity(direction=1 if forward else 2)
            )
        except (MotionUnderWayError, *GONE):
            return

    @precondition(lambda self: self.motion is not None)
    @rule(seconds=SECONDS)
    def wait(self, seconds: float) -> None:
        try:
            self.side.run(lambda: self.motion.wait(timeout=seconds))
        except (MotionStoppedError, ReplyTimeoutError, *GONE):
            return

    @rule()
    def stop(self) -> None:
        was_open = self.is_open
        try:
            self.side.run(lambda: self.tdc.stop(timeout=5))
        except GONE:
            assert not was_open
        except ReplyTimeoutError:
            assert self.kept.deaf
        else:
            self.move_is_accepted()

    @rule()
    def ask_whether_it_moves(self) -> None:
        try:
            moves = self.side.run(lambda: self.tdc.is_moving())
        except (ReplyTimeoutError, *GONE):
            return
        if not moves:
            self.move_is_accepted()

    def move_is_accepted(self) -> None:
        """Check that the guard no longer refuses a move."""
        self.motion = self.side.run(lambda: self.tdc.start_move_absolute(counts=1000))

    @rule()
    def close(self) -> None:
        self.side.run(lambda: self.tdc.close())

    @rule()
    def reconnect(self) -> None:
        """Reconnect over a working line."""
        self.kept.reachable, self.kept.deaf, self.kept.cut_at_write = True, False, False
        self.side.run(lambda: self.tdc.reconnect())

    @rule(failures=st.lists(FAILURES, max_size=2), closes=st.booleans())
    def lose_the_line_and_get_it_back(self, failures: list[str], closes: bool) -> None:
        self.unplug()
        for how in failures:
            self.fail_to_reconnect(how)
        if closes:
            self.close()
        self.reconnect()

    @rule(how=FAILURES)
    def fail_to_reconnect(self, how: str) -> None:
        self.kept.reachable = how != "unreachable"
        self.kept.deaf, self.kept.cut_at_write = how == "no answer", how == "cut"
        with suppress(LinkOpenError, ReplyTimeoutError, TransportLostError):
            self.side.run(lambda: self.tdc.reconnect())

    # Events on the line

    @rule()
    def unplug(self) -> None:
        self.kept.unplug()

    @rule()
    def cut_at_the_next_write(self) -> None:
        self.kept.cut_at_write = True

    @rule(seconds=SECONDS)
    def later(self, seconds: float) -> None:
        self.side.pass_time(self.kept, seconds)

    def teardown(self) -> None:
        """Check that a working line and a status at rest lift the guard."""
        try:
            self.reconnect()
            self.side.run(lambda: self.tdc.stop(timeout=10))
            assert not self.side.run(lambda: self.tdc.is_moving())
            self.move_is_accepted()
            self.side.run(lambda: self.tdc.close())
        finally:
            self.side.close()
            self.stack.close()


class Threads(MotionGuard):
    asynchronous = False


class Asyncio(MotionGuard):
    asynchronous = True


MACHINES = (Threads, Asyncio)


def limits(examples: int) -> settings:
    """Return settings for a number of examples with up to 20 steps each."""
    phases = (Phase.reuse, Phase.generate, Phase.shrink)
    return settings(max_examples=examples, stateful_step_count=20, deadline=None, phases=phases)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, default=20_000)
    examples = parser.parse_args().examples
    logging.getLogger("stagewire").setLevel(logging.ERROR)  # losses of lines are expected here
    for machine in MACHINES:
        share = examples // len(MACHINES)
        run_state_machine_as_test(machine, settings=settings(limits(share), database=None))
        print(f"motion guard, {machine.__name__}: {share} examples, no move overtook another")


if __name__ == "__main__":
    try:
        main()
    except StagewireError as error:  # hypothesis has shown the example
        raise SystemExit(f"the guard failed: {error}") from error
