"""However a run ends, motion is stopped first, and then changes are undone."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable

import pytest
from watched_links import ALL, WatchedLink, declared_as, lost, made, run_made

import stagewire_virtual
from parts import every_nth
from stagewire.errors import TransportLostError
from stagewire.links import open_link
from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.report import Outcome, Report
from stagewire_conformance.device.results import Result
from stagewire_conformance.device.run import RunInterrupted, run
from stagewire_conformance.device.trial import Trial
from stagewire_virtual.linking import SteppedLink

MOVE = m.MotMoveAbsolute(1, 34304).pack(0x50, 0x01)
STOP = m.MotMoveStop(1, 2).pack(0x50, 0x01)
LOOK = m.MotReqDcStatusUpdate(1).pack(0x50, 0x01)
CHANGED = m.MotSetVelParams(1, 0, 1000, 1_000_000)
ORIGINAL = m.MotSetVelParams(1, 0, 1048, 1_534_735).pack(0x50, 0x01)
SIGNS = m.MotAckDcStatusUpdate().pack(0x50, 0x01)


def moves(trial: Trial) -> None:
    """Change the velocity, move while polling the status until the end message, and return."""
    line = trial.line
    before = trial.reply(m.MotReqVelParams(1), 0x50).message
    original = m.MotSetVelParams(
        before.chan_ident, before.min_velocity, before.acceleration, before.max_velocity
    )
    trial.undo("velocity of channel 1", lambda: line.send(original, 0x50))
    line.send(CHANGED, 0x50)
    trial.undo("position of channel 1", lambda: go(trial, 0), moves=True)
    go(trial, 34304)


def go(trial: Trial, to: int) -> None:
    trial.line.send(m.MotMoveAbsolute(1, to), 0x50)
    for _ in range(100):
        trial.reply(m.MotReqDcStatusUpdate(1), 0x50)
        came = trial.line.listen(0.2, until=lambda heard: heard.name == "MOT_MOVE_COMPLETED")
        if any(heard.name == "MOT_MOVE_COMPLETED" for heard in came):
            return
    trial.must(False, "MOT_MOVE_COMPLETED did not come")


def watched() -> WatchedLink:
    return WatchedLink(SteppedLink(stagewire_virtual.TDC001(stage=stages.Z8)))


def after(writes: list[bytes], at: int) -> list[bytes]:
    """Return the writes from an index on, without keep-alive messages."""
    return [data for data in writes[at:] if data != SIGNS]


def acts(outcome: Outcome) -> list[bytes]:
    """Return what a check sent, without keep-alive messages and requests for the status."""
    sent = (entry.raw for entry in outcome.entries if entry.sent and not entry.keep_alive)
    return [raw for raw in sent if raw != LOOK]


def count(run_it: Callable[[WatchedLink], object], what: str) -> int:
    link = watched()
    run_it(link)
    return link.reads if what == "reads" else len(link.writes)


def test_the_check_itself_passes_and_undoes_everything() -> None:
    link = watched()
    report = run_made(link, moves)
    [outcome] = report.outcomes
    assert outcome.result is Result.PASS
    assert outcome.restored == ("position of channel 1", "velocity of channel 1")
    assert link.writes.count(MOVE) == 1
    assert after(link.writes, -1) == [ORIGINAL]
    assert STOP not in link.writes


READS = range(1, count(lambda link: run_made(link, moves), "reads") + 1)
WRITES = range(count(lambda link: run_made(link, moves), "writes"))
SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]
assert len(READS) > 60


def happens(link: WatchedLink, at: int, what: Callable[[], None]) -> dict[str, int]:
    """Run a callback at a certain read, once; return the number of writes at that time, afterwards."""
    seen = {}

    def before_read() -> None:
        if link.reads == at:
            seen["writes"] = len(link.writes)
            what()

    link.before_read = before_read
    return seen


def interrupt() -> None:
    raise KeyboardInterrupt


def check_what_follows(writes: list[bytes], at: int) -> None:
    """Expect stops first if something moves, then restored settings, and no move."""
    before, behind = after(writes[:at], 0), after(writes, at)
    moved = any(data[:2] == MOVE[:2] for data in before)
    changed = CHANGED.pack(0x50, 0x01) in before
    restored = ORIGINAL in before
    expected = [STOP] if moved and not over(before) else []
    assert behind[: len(expected)] == expected
    if changed and not restored:
        assert ORIGINAL in behind
    assert not any(data[:2] == MOVE[:2] for data in behind)


def over(before: list[bytes]) -> bool:
    """Return whether the check had finished, so that there was nothing to stop."""
    return bool(before) and before[-1] == ORIGINAL


@pytest.mark.parametrize("at", READS)
def test_ctrl_c_at_any_read_stops_first_and_then_restores(at: int) -> None:
    link = watched()
    seen = happens(link, at, interrupt)
    with pytest.raises(RunInterrupted) as caught:
        run_made(link, moves)
    check_what_follows(link.writes, seen["writes"])
    assert caught.value.report.unfinished == "ended by SIGINT"


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("at", READS[::7])
def test_a_signal_at_any_read_stops_first_and_then_restores(at: int, number: int) -> None:
    link = watched()
    seen = happens(link, at, lambda: signal.raise_signal(number))
    handlers = [signal.getsignal(each) for each in SIGNALS]
    with pytest.raises(RunInterrupted) as caught:
        run_made(link, moves)
    check_what_follows(link.writes, seen["writes"])
    assert caught.value.signal == number
    assert [signal.getsignal(each) for each in SIGNALS] == handlers


@pytest.mark.parametrize("at", WRITES)
def test_a_signal_during_a_write_leaves_no_half_frame(at: int) -> None:
    link = watched()
    seen = {}

    def before_write(data: bytes) -> None:
        if len(link.writes) == at:
            seen["writes"] = at + 1  # the current write is completed
            signal.raise_signal(signal.SIGINT)

    link.before_write = before_write
    with pytest.raises(RunInterrupted):
        run_made(link, moves, moves)  # a second check is still pending
    check_what_follows(link.writes, seen["writes"])


@pytest.mark.parametrize("at", READS[::5])
def test_an_error_of_the_check_at_any_read_stops_first(at: int) -> None:
    link = watched()

    def breaks() -> None:
        raise ZeroDivisionError("a defect")

    seen = happens(link, at, breaks)
    report = run_made(link, moves)
    check_what_follows(link.writes, seen["writes"])
    assert isinstance(report.defect, ZeroDivisionError)
    assert report.unfinished == "the suite has a defect: ZeroDivisionError: a defect"


def test_earlier_findings_are_in_the_report() -> None:
    link = watched()

    def finds(trial: Trial) -> None:
        trial.must(False, "it is wrong")
        raise KeyboardInterrupt

    never = made(lambda trial: None, "never")
    with pytest.raises(RunInterrupted) as caught:
        run_made(link, lambda trial: None, finds, never)
    report = caught.value.report
    assert [outcome.result for outcome in report.outcomes] == [Result.PASS, Result.FAIL]
    texts = [finding.text for finding in report.outcomes[1].findings]
    assert texts == ["it is wrong", "the check did not finish: the run was interrupted"]
    assert [why for _, why in report.not_run] == ["not reached: ended by SIGINT"]


def test_a_second_ctrl_c_ends_restoring_and_names_the_rest() -> None:
    link = watched()

    def changes(trial: Trial) -> None:
        trial.undo("the first", lambda: None)
        trial.undo("the second", lambda: trial.line.listen(1.0))
        link.before_read = lambda: signal.raise_signal(signal.SIGINT)
        trial.line.listen(1.0)

    with pytest.raises(RunInterrupted) as caught:
        run_made(link, changes)
    [outcome] = caught.value.report.outcomes
    texts = [finding.text for finding in outcome.findings if finding.result is Result.FAIL]
    assert texts == [
        "not restored: the second (interrupted)",
        "not restored: the first (interrupted)",
    ]


@pytest.mark.parametrize("at", READS[::5])
def test_a_lost_line_ends_the_run_and_keeps_the_findings(at: int) -> None:
    link = watched()

    def dies() -> None:
        link.before_read = lost
        link.before_write = lambda data: lost()
        lost()

    happens(link, at, dies)
    report = run_made(link, moves, made(lambda trial: None, "never"))
    assert report.unfinished == "the line was lost: the other end hung up"
    assert report.defect is None
    assert len(report.outcomes) + len(report.not_run) == 2
    for outcome in report.outcomes:
        left = [finding.text for finding in outcome.findings if "not restored" in finding.text]
        assert all(
            text.endswith(("(the line was lost)", "(not everything is known to be at rest)"))
            for text in left
        )
    moving = any(data[:2] == MOVE[:2] for data in link.writes) and not over(after(link.writes, 0))
    assert any("may still be moving: the line was lost" in text for text in report.adrift) is moving


def test_a_failing_undo_is_a_finding_and_the_others_run() -> None:
    done = []

    def changes(trial: Trial) -> None:
        trial.undo("the first", lambda: done.append("first"))
        trial.undo("the second", lambda: trial.line.send(m.MotGetVelParams(1, 0, 0, 0), 0x50))
        trial.undo("the third", lambda: trial.need(False, "the third is not as it was: write 3"))
        trial.undo("the fourth", lambda: go(trial, -1), moves=True)

    [outcome] = run_made(watched(), changes).outcomes
    assert done == ["first"]
    assert outcome.restored == ("the first",)
    assert outcome.result is Result.FAIL
    assert [finding.text for finding in outcome.findings] == [
        "not restored: the fourth (MOT_MOVE_ABSOLUTE to 0x50 is not allowed: absolute_distance -1 "
        "is outside 0..100000)",
        "the third is not as it was: write 3",
        "not restored: the second (MOT_GET_VELPARAMS to 0x50 is not allowed: controllers do not receive it)",
    ]


def test_a_failing_undo_with_motion_is_stopped_and_no_other_one_moves() -> None:
    link = watched()

    def changes(trial: Trial) -> None:
        trial.undo("the first", lambda: go(trial, 5), moves=True)
        trial.undo("the second", lambda: trial.line.send(CHANGED, 0x50))

        def fails() -> None:
            trial.line.send(m.MotMoveAbsolute(1, 34304), 0x50)
            trial.need(False, "it is not there")

        trial.undo("the third", fails, moves=True)

    [outcome] = run_made(link, changes).outcomes
    assert acts(outcome) == [MOVE, STOP, CHANGED.pack(0x50, 0x01)]
    assert outcome.restored == ("the second",)
    assert [(finding.result, finding.text) for finding in outcome.findings[:2]] == [
        (Result.FAIL, "it is not there"),
        (Result.PASS, "left as it is, because nothing may move now: the first"),
    ]


def test_a_check_that_cannot_continue_is_a_fail_and_the_run_continues() -> None:
    link = watched()

    def cannot_go_on(trial: Trial) -> None:
        trial.undo("position of channel 1", lambda: go(trial, 0), moves=True)
        trial.undo("velocity of channel 1", lambda: trial.line.send(CHANGED, 0x50))
        trial.line.send(m.MotMoveVelocity(1, 1), 0x50)
        m.MotMoveAbsolute(1, 2**40)  # the received value does not fit into the message

    report = run_made(link, cannot_go_on, lambda trial: None)
    assert not report.unfinished
    first, second = report.outcomes
    assert (first.result, second.result) == (Result.FAIL, Result.PASS)
    assert "the check could not continue: MOT_MOVE_ABSOLUTE.absolute_distance must be" in (
        first.findings[0].text
    )
    assert first.restored == ("velocity of channel 1",)
    assert acts(first)[1:3] == [STOP, CHANGED.pack(0x50, 0x01)]


def test_a_defect_of_an_undo_ends_the_run_and_the_others_run() -> None:
    def changes(trial: Trial) -> None:
        trial.undo("the first", lambda: None)
        trial.undo("the second", lambda: 1 // 0)

    report = run_made(watched(), changes)
    [outcome] = report.outcomes
    assert isinstance(report.defect, ZeroDivisionError)
    assert outcome.restored == ("the first",)
    assert outcome.findings[-1].text.startswith(
        "not restored: the second (the suite has a defect: ZeroDivisionError"
    )


def test_remaining_motion_is_stopped_before_the_next_check() -> None:
    link = watched()

    def leaves(trial: Trial) -> None:
        trial.undo("velocity of channel 1", lambda: trial.line.send(CHANGED, 0x50))
        trial.line.send(m.MotMoveVelocity(1, 1), 0x50)
        trial.line.listen(0.1)

    report = run_made(link, leaves, lambda trial: None)
    assert not report.unfinished
    velocity = m.MotMoveVelocity(1, 1).pack(0x50, 0x01)
    sent = acts(report.outcomes[0])
    assert sent == [velocity, STOP, CHANGED.pack(0x50, 0x01)]  # before anything is restored


def test_the_end_message_of_one_bay_does_not_end_the_motion_of_another() -> None:
    link = WatchedLink(SteppedLink(stagewire_virtual.BBD102()))

    def stops_one(trial: Trial) -> None:
        for address in (0x21, 0x22):
            trial.line.send(m.MotMoveVelocity(1, 1), address)
        trial.line.send(m.MotMoveStop(1, 1), 0x22)
        trial.line.listen(5, until=lambda heard: heard.name == "MOT_MOVE_STOPPED")

    report = run_made(link, stops_one, declared=declared_as("BBD102"))
    assert not report.unfinished
    stops = [data for data in link.writes if data[:2] == STOP[:2]]
    assert stops[-1] == m.MotMoveStop(1, 2).pack(0x21, 0x01)


def test_completed_motion_is_also_stopped_when_a_check_is_interrupted() -> None:
    link = watched()

    def is_over(trial: Trial) -> None:
        go(trial, 34304)
        raise KeyboardInterrupt

    with pytest.raises(RunInterrupted) as caught:
        run_made(link, is_over)
    assert [data for data in after(link.writes, 0) if data != LOOK][-1] == STOP
    assert caught.value.report.stops == ("0x01->0x50 MOT_MOVE_STOP chan_ident=1 stop_mode=2",)


@pytest.mark.skipif(sys.platform == "win32", reason="os.kill ends a process there")
def test_a_signal_ends_a_wait_in_real_time() -> None:
    def waits(trial: Trial) -> None:
        threading.Timer(0.05, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        trial.line.listen(20)

    with open_link("virtual://TPZ001") as link, pytest.raises(RunInterrupted) as caught:
        run_made(link, waits, declared=declared_as("TPZ001"))
    assert caught.value.report.outcomes[0].seconds < 10


def test_stops_go_to_every_moved_channel_and_bay() -> None:
    link = WatchedLink(SteppedLink(stagewire_virtual.BBD102()))

    def both(trial: Trial) -> None:
        for address in (0x21, 0x22):
            trial.line.send(m.MotMoveVelocity(1, 1), address)
        raise KeyboardInterrupt

    with pytest.raises(RunInterrupted):
        run_made(link, both, declared=declared_as("BBD102"))
    stops = [m.MotMoveStop(1, 2).pack(address, 0x01) for address in (0x21, 0x22)]
    assert [data for data in link.writes if data[:2] == STOP[:2]] == stops


def test_only_started_motion_is_stopped() -> None:
    link = watched()
    with pytest.raises(RunInterrupted):
        run_made(link, lambda trial: interrupt())
    assert STOP not in link.writes


def test_in_another_thread_signals_are_left_to_the_program() -> None:
    found: list[Report] = []
    before = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=lambda: found.append(run_made(watched(), moves)))
    thread.start()
    thread.join()
    assert not found[0].unfinished
    assert signal.getsignal(signal.SIGINT) is before


def test_a_signal_handler_of_the_program_is_kept() -> None:
    heard: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: heard.append(number))
    try:
        report = run_made(watched(), lambda trial: signal.raise_signal(signal.SIGINT))
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == [signal.SIGINT]
    assert not report.unfinished


@pytest.fixture(scope="module")
def reads_of_a_whole_run() -> int:
    declared = declared_as("TDC001")
    return count(lambda link: run(link, plan(declared, ALL), declared, ALL, seed=1), "reads")


@pytest.mark.parametrize("part", every_nth(range(20), 4))
def test_ctrl_c_anywhere_in_a_run_moves_nothing_afterwards(
    part: int, reads_of_a_whole_run: int
) -> None:
    declared = declared_as("TDC001")
    checks = plan(declared, ALL)
    at = reads_of_a_whole_run * part // 20 + 1
    link = watched()
    seen = happens(link, at, interrupt)
    with pytest.raises(RunInterrupted):
        run(link, checks, declared, ALL, seed=1)
    effects = {entry["id"]: entry["effect"] for entry in declared.registry.messages.values()}
    behind = [
        effects.get(int.from_bytes(data[:2], "little"))
        for data in after(link.writes, seen["writes"])
    ]
    first_other = next((i for i, effect in enumerate(behind) if effect != "stop"), len(behind))
    assert "stop" not in behind[first_other:]  # stops come before anything else


def test_the_text_of_a_line_error_is_kept() -> None:
    link = watched()

    def dies(trial: Trial) -> None:
        raise TransportLostError("the cable was pulled")

    report = run_made(link, dies)
    assert report.unfinished == "the line was lost: the cable was pulled"
    assert report.outcomes[0].result is Result.INFO
