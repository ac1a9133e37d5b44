"""Reconnecting: the pause before the first byte, the identity check, and stops without an answer."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from typing import Any

import pytest
from reopened_link import URL, KeptController, Side, lines_to

from stagewire.errors import BadValueError, ReplyTimeoutError, TransportLostError, WrongUnitError
from stagewire_apt import TDC001, aio
from stagewire_virtual.clock import SECOND


class Bench:
    """A device on a controller that survives the loss of its lines."""

    def __init__(self, side: Side) -> None:
        self.side = side
        self.kept = KeptController()

    def open(self, **options: Any) -> Any:
        cls = import_module(self.side.package).TDC001
        return self.side.run(lambda: cls.open(URL, background=False, **options))

    def lose(self, device: Any) -> None:
        self.kept.unplug()
        with pytest.raises(TransportLostError):
            self.side.run(lambda: device.is_moving())


@pytest.fixture(params=[False, True], ids=["threads", "asyncio"])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    made = Bench(Side(request.param))
    with lines_to(lambda: made.kept):
        yield made
    made.side.close()


@pytest.mark.parametrize(("options", "pause"), [({}, 1.5), ({"reconnect_pause": 0}, 0)])
def test_after_a_loss_reconnecting_waits_until_the_controller_discards_a_partial_message(
    bench: Bench, options: dict[str, Any], pause: float
) -> None:
    tdc = bench.open(**options)
    bench.lose(tdc)
    lost_at = bench.kept.controller.clock.now / SECOND
    bench.side.run(lambda: tdc.reconnect())
    assert bench.kept.first_byte_at is not None
    waited = bench.kept.first_byte_at - lost_at
    assert pause <= waited < pause + 0.1
    bench.side.run(lambda: tdc.close())


def test_reconnecting_after_closing_does_not_wait(bench: Bench) -> None:
    tdc = bench.open()
    bench.side.run(lambda: tdc.close())
    closed_at = bench.kept.controller.clock.now / SECOND
    bench.side.run(lambda: tdc.reconnect())
    assert bench.kept.first_byte_at is not None
    assert bench.kept.first_byte_at - closed_at < 0.1
    bench.side.run(lambda: tdc.close())


def test_another_controller_on_the_line_is_refused(bench: Bench) -> None:
    tdc = bench.open()
    first = bench.kept
    bench.side.run(lambda: tdc.start_move_absolute(counts=340_000))
    bench.lose(tdc)
    bench.kept = KeptController(serial_number=83_000_002)
    with pytest.raises(WrongUnitError, match="now has serial number 83000002, but 83000001"):
        bench.side.run(lambda: tdc.reconnect())
    assert not bench.kept.moves
    bench.kept = first
    bench.side.run(lambda: tdc.reconnect())
    assert bench.side.run(lambda: tdc.is_moving())
    assert first.may_move  # no stop was sent to either controller
    bench.side.run(lambda: tdc.close())


@pytest.mark.parametrize("on_close", ["stop", "leave"])
def test_motions_are_stopped_if_the_controller_does_not_answer(bench: Bench, on_close: str) -> None:
    tdc = bench.open(on_close=on_close)
    bench.side.run(lambda: tdc.start_move_absolute(counts=340_000))
    bench.lose(tdc)
    bench.kept.mute = True
    with pytest.raises(ReplyTimeoutError):
        bench.side.run(lambda: tdc.reconnect())
    assert bench.kept.may_move == (on_close == "leave")


def test_closing_after_a_loss_warns_of_motions_under_way(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    tdc = bench.open()
    bench.side.run(lambda: tdc.start_move_absolute(counts=340_000))
    bench.lose(tdc)
    bench.side.run(lambda: tdc.close())
    assert "no stop was sent; may still be moving: TDC001: move_absolute" in caplog.text


@pytest.mark.parametrize("pause", [-1, True, "1", float("inf"), float("nan")])
def test_an_invalid_pause_is_refused(bench: Bench, pause: object) -> None:
    with pytest.raises(
        BadValueError, match="reconnect_pause must be a number of seconds, 0 or more"
    ):
        bench.open(reconnect_pause=pause)


@pytest.mark.parametrize("timeout", [0, -1, 0.0])
def test_a_stop_is_sent_even_if_no_time_is_left(bench: Bench, timeout: float) -> None:
    tdc = bench.open()
    bench.side.run(lambda: tdc.start_move_absolute(counts=340_000))
    bench.side.pass_time(bench.kept, 2)  # at full speed it needs a while to stop
    with pytest.raises(ReplyTimeoutError, match="stop it again, or read the status"):
        bench.side.run(lambda: tdc.stop(timeout=timeout))
    assert not bench.kept.may_move
    bench.side.run(lambda: tdc.close())


@pytest.mark.parametrize("timeout", [float("nan"), True, "1"])
@pytest.mark.parametrize("by_handle", [False, True])
def test_a_stop_is_sent_before_its_timeout_is_refused(
    bench: Bench, timeout: object, by_handle: bool
) -> None:
    tdc = bench.open()
    motion = bench.side.run(lambda: tdc.start_move_absolute(counts=340_000))
    bench.side.pass_time(bench.kept, 2)
    with pytest.raises(
        BadValueError, match=r"timeout must be a number of seconds, not .*; the stop was sent"
    ):
        bench.side.run(lambda: (motion if by_handle else tdc).stop(timeout=timeout))
    bench.side.pass_time(bench.kept, 2)
    assert not bench.side.run(lambda: tdc.is_moving())
    bench.side.run(lambda: tdc.close())


@pytest.mark.parametrize("timeout", [float("inf"), 10**400], ids=["inf", "huge"])
def test_a_stop_can_wait_without_a_timeout(bench: Bench, timeout: float) -> None:
    tdc = bench.open()
    bench.side.run(lambda: tdc.start_move_absolute(counts=340_000))
    assert bench.side.run(lambda: tdc.stop(timeout=timeout)) is not None
    assert not bench.kept.may_move
    bench.side.run(lambda: tdc.close())


def test_threads_that_reconnect_simultaneously_open_one_line() -> None:
    tdc = TDC001.open("virtual://TDC001")
    threads = threading.active_count()
    sessions = set()
    together = threading.Barrier(4)

    def again() -> None:
        together.wait()
        tdc.reconnect()
        sessions.add(tdc.session)
        together.wait()  # a reconnect that begins after another has ended opens a new line
        tdc.get_vel_params()

    for _ in range(3):
        tdc.close()
        with ThreadPoolExecutor(4) as pool:
            wait_for = [pool.submit(again) for _ in range(4)]
        for done in wait_for:
            done.result()
        assert sum(not session.closed for session in sessions) == 1
    assert threading.active_count() <= threads
    tdc.close()


def test_tasks_that_reconnect_simultaneously_open_one_line() -> None:
    async def main() -> None:
        tdc = await aio.TDC001.open("virtual://TDC001")
        await tdc.close()

        async def again() -> object:
            await tdc.reconnect()
            await tdc.get_vel_params()
            return tdc.session

        assert set(await asyncio.gather(*(again() for _ in range(4)))) == {tdc.session}
        await tdc.close()

    asyncio.run(main())
