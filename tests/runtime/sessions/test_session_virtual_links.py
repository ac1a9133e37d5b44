"""``virtual://``: controllers in this process, in real time and in stepped time."""

from __future__ import annotations

import asyncio
import itertools
import threading
import time
from pathlib import Path
from typing import Any

import pytest

import stagewire_virtual as virtual
from stagewire.errors import LinkOpenError, ReplyTimeoutError, TransportLostError
from stagewire.links import open_async_link, open_link
from stagewire.sessions import AsyncFramedSession, Ends, FramedSession
from stagewire_apt import PROTOCOL, stages
from stagewire_apt import messages as m
from stagewire_virtual import stepped
from stagewire_virtual.linking import SteppedLink

REQUEST = m.HwReqInfo().pack(0x50, 1)
HOMED = Ends((m.MotMoveHomed,), ())
CUT = "virtual://TDC001?faults=to_host disconnect frame message=MOT_MOVE_HOMED"


def info(url: str, dest: int = 0x50) -> m.HwGetInfo:
    with FramedSession(PROTOCOL, open_link(url)) as session:
        message = session.ask(m.HwReqInfo(), (m.HwGetInfo,), dest, 5).message
        assert isinstance(message, m.HwGetInfo)
        return message


# URLs


def test_a_unit_is_opened_by_its_name() -> None:
    assert info("virtual://TDC001").model_number == info("virtual://tdc001").model_number
    assert info("virtual://TDC001?seed=1") != info("virtual://TDC001?seed=2")
    assert info("virtual://TDC001?serial_number=83000042").serial_number == 83000042


def test_a_rack_has_a_module_in_each_named_bay() -> None:
    with FramedSession(PROTOCOL, open_link("virtual://rack?bays=MST601,,MPZ601")) as session:
        states = [
            session.ask(m.RackReqBayUsed(bay), (m.RackGetBayUsed,), 0x11, 5).message
            for bay in range(3)
        ]
    occupied = [m.RackGetBayUsed(bay, state).bay_state for bay, state in ((0, 1), (1, 2), (2, 1))]
    assert [state.bay_state for state in states] == occupied  # type: ignore[attr-defined]


def test_a_unit_of_a_bench_file_is_selected_by_label_or_number(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(
        '[[unit]]\nname = "TDC001"\nlabel = "focus"\nserial_number = 83000001\n'
        '[[unit]]\nname = "TDC001"\nserial_number = 83000002\n'
    )
    assert info(f"virtual://{path.as_posix()}#focus").serial_number == 83000001
    assert info(f"virtual://{path.as_posix()}#2").serial_number == 83000002
    for fragment, what in (("", "it has several units"), ("#tilt", "no unit has the label 'tilt'")):
        with pytest.raises(LinkOpenError, match=f"{what}.*1 focus, 2 TDC001"):
            open_link(f"virtual://{path.as_posix()}{fragment}")


def test_a_url_has_the_options_of_a_bench() -> None:
    quirks = "unswapped_addresses,long_status"
    link = open_link(
        "virtual://TDC001?stage=Z8&travel=100&position=50&line=rs232"
        f"&quirks={quirks}&answer_unsupported=true&faults=to_host drop frame every=10"
    )
    link.close()
    open_link("virtual://BBD103?empty_bays=1,3").close()
    open_link("virtual://MS2000?strategies=power_on_mode:low").close()


@pytest.mark.parametrize(
    ("url", "what"),
    [
        ("virtual://", "the URL names no unit; write for example virtual://TDC001"),
        ("virtual://TDC002", "unknown unit TDC002; did you mean TDC001"),
        ("virtual://TDC001?tcp=4001", "unknown option 'tcp' .options: stage, travel"),
        ("virtual://TDC001?seed=x", "option seed: expected a whole number, not 'x'"),
        ("virtual://TDC001?seed=1&seed=2", "option seed: given more than once"),
        ("virtual://TDC001?stage=Z9", "option stage: .* has no stage Z9; did you mean Z925"),
        (
            "virtual://TDC001?line=gpib",
            "option line: unknown line type 'gpib' .choose usb or rs232",
        ),
        ("virtual://TDC001?quirks=a,b", "option quirks: TDC001 has no quirk a"),
        ("virtual://TDC001?faults=drop", "option faults: fault 'drop'"),
        ("virtual://TDC001?answer_unsupported=1", "expected true or false, not '1'"),
        ("virtual://TDC001?stage=Z9&quirks=a", "option stage: .*; option quirks: "),
        ("virtual://rack", "option bays: missing"),
        ("virtual://BBD102?empty_bays=9", "option empty_bays: BBD102 has no bay 9"),
        ("virtual://nowhere.toml", "nowhere.toml: cannot be read"),
        ("virtual://[", "cannot be opened: "),
    ],
)
def test_the_error_names_the_fault_of_a_url(url: str, what: str) -> None:
    with pytest.raises(LinkOpenError, match=what) as refused:
        open_link(url)
    assert str(refused.value).startswith(f"{url} cannot be opened: ")

    async def opening() -> None:
        with pytest.raises(LinkOpenError, match=what):
            await open_async_link(url)

    stepped.run(opening())


# Real time


def test_a_read_sleeps_until_something_is_due() -> None:
    link = open_link("virtual://TDC001?line=rs232")
    link.write(m.HwStartUpdateMsgs(update_rate=10).pack(0x50, 1))
    before = time.monotonic()
    assert len(link.read(5)) == 20
    assert time.monotonic() - before < 4
    link.close()


def test_another_thread_wakes_a_read() -> None:
    link = open_link("virtual://TDC001")
    for act, expected in ((lambda: link.write(REQUEST), 90), (link.wake, 0)):
        timer = threading.Timer(0.02, act)
        timer.start()
        assert len(link.read(30)) == expected
        timer.join()
    link.wake()  # also wakes a later read
    assert link.read(30) == b""
    assert link.read(0) == b""
    link.close()


def test_a_closed_link_is_lost() -> None:
    link = open_link("virtual://TDC001")
    link.close()
    link.close()
    for call in (lambda: link.read(1), lambda: link.write(REQUEST)):
        with pytest.raises(TransportLostError):
            call()


def test_a_cut_line_ends_the_session_in_stepped_time() -> None:
    fault = "to_host disconnect frame message=MOT_MOVE_HOMED"
    with virtual.TDC001(stage=stages.Z8, faults=[fault]) as tdc:
        session = FramedSession(PROTOCOL, SteppedLink(tdc))
        with pytest.raises(TransportLostError, match="unplugged"):
            session.wait(session.begin(m.MotMoveHome(1), HOMED, 0x50))
        session.close()

    async def main() -> None:
        session = AsyncFramedSession(PROTOCOL, await open_async_link(CUT))
        with pytest.raises(TransportLostError, match="unplugged"):
            await session.wait(await session.begin(m.MotMoveHome(1), HOMED, 0x50))
        await session.close()

    stepped.run(main())


# Stepped time


def test_a_minute_of_waiting_takes_no_time() -> None:
    before = time.monotonic()
    with virtual.TDC001(stage=stages.Z8, line="rs232") as tdc:
        with FramedSession(PROTOCOL, SteppedLink(tdc)) as session:
            homed = session.wait(session.begin(m.MotMoveHome(1), HOMED, 0x50))
            assert homed.message == m.MotMoveHomed(1)
            assert 1 < session.now() < 60
            began = session.now()
            with pytest.raises(ReplyTimeoutError):
                session.ask(m.HwReqInfo(), (m.MotGetJogParams,), 0x50, 3600)
            assert session.now() - began == pytest.approx(3600)
            session.pause(3600)
            assert session.now() - began == pytest.approx(7200)
        assert tdc.write(REQUEST)  # the test owns the controller
    assert time.monotonic() - before < 30


def test_status_messages_arrive_at_their_rate_in_stepped_time() -> None:
    with (
        virtual.TDC001(stage=stages.Z8) as tdc,
        FramedSession(PROTOCOL, SteppedLink(tdc)) as session,
    ):
        session.keep_alive(m.MotAckDcStatusUpdate(), (0x50,))
        updates = session.subscribe(m.MotGetDcStatusUpdate)
        session.send(m.HwStartUpdateMsgs(update_rate=10), 0x50)
        times = []
        for _ in range(100):
            updates.get(1)
            times.append(session.now())
    gaps = {round(later - earlier, 6) for earlier, later in itertools.pairwise(times)}
    assert gaps == {0.1}


def test_no_stepped_time_passes_while_a_function_runs_in_a_thread() -> None:
    async def main() -> float:
        loop, released = asyncio.get_running_loop(), threading.Event()
        running = asyncio.create_task(asyncio.to_thread(released.wait))
        loop.call_later(100, lambda: None)
        threading.Timer(0.05, released.set).start()
        await running
        return loop.time()

    assert stepped.run(main()) == 0


@pytest.mark.parametrize("seconds", [600, pytest.param(3600, marks=pytest.mark.matrix)])
def test_stepped_time_passes_immediately_in_an_event_loop(seconds: int) -> None:
    async def main() -> tuple[float, list[Any]]:
        loop = asyncio.get_running_loop()
        link = await open_async_link("virtual://TDC001?stage=Z8")
        async with AsyncFramedSession(PROTOCOL, link) as session:
            session.keep_alive(m.MotAckDcStatusUpdate(), (0x50,))
            updates = session.subscribe(m.MotGetDcStatusUpdate, limit=100_000)
            await session.send(m.HwStartUpdateMsgs(update_rate=10), 0x50)
            homing = await session.begin(m.MotMoveHome(1), HOMED, 0x50)
            await session.wait(homing)
            await asyncio.sleep(seconds)
            await session.send(m.HwStopUpdateMsgs(), 0x50)
            got = [await updates.get(0) for _ in range(len(updates))]
        return loop.time(), got

    before = time.monotonic()
    passed, got = stepped.run(main())
    assert time.monotonic() - before < 30
    assert seconds < passed < seconds + 100
    assert abs(len(got) - passed * 10) < 3
    assert virtual.TDC001().clock.now == 0


def test_many_controllers_run_in_one_loop_without_threads() -> None:
    async def one(number: int) -> bool:
        link = await open_async_link(f"virtual://TDC001?seed={number}")
        async with AsyncFramedSession(PROTOCOL, link) as session:
            await session.wait(await session.begin(m.MotMoveHome(1), HOMED, 0x50))
            return threading.active_count() == threads

    async def main() -> list[bool]:
        return await asyncio.gather(*map(one, range(20)))

    threads = threading.active_count()
    assert all(stepped.run(main()))
