"""Stray bytes around a reply without a frame are drained, and the next answer is right.

Each query of an axis is made with an intrusion before, within or after its reply, and then twice more. The
controller changes its values between the requests. Documented replies have no identification, so bytes
between a request and its reply cannot be detected; this is not tested.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from proof_calls import Call, method
from proof_line import SIDES, Side, settled
from proof_ms2000 import DRAIN, UNITS, USUAL, Axes, Said, opened, queries

from stagewire.errors import ReplyTimeoutError

SHORT = 0.3  # timeout of the disturbed request in seconds
Ask = Callable[[], Any]


async def stray_before(bench: Any, far: Axes, ask: Ask) -> None:
    """Send unsolicited bytes; the request waits until the line is silent, and gets the right answer."""
    for stray in (b"\0", b"B", b"\xff\x13\x37", b":A 1\r\n", bytes(40)):
        far.say(stray)
        await bench.sleep(0.001)
        begin = bench.now()
        await ask()
        assert bench.now() - begin > DRAIN - 0.002
        far.renew()


async def stray_twice(bench: Any, far: Axes, ask: Ask) -> None:
    """Send stray bytes during the silence; the silence starts again."""
    far.say(b"\0")
    far.say(b"\0", 0.15)
    begin = bench.now()
    await ask()
    assert bench.now() - begin >= 0.15 + DRAIN


async def late(bench: Any, far: Axes, ask: Ask) -> None:
    """Send a reply after the timeout; it is not matched to the next request."""
    for delay in (SHORT + 0.001, 0.7, 0.99):
        await gives_up(bench, far, ask, lambda reply, delay=delay: [(delay, reply)])
        await ask()
        far.renew()


async def in_two(bench: Any, far: Axes, ask: Ask) -> None:
    """Send a reply in two pieces; it is accepted."""
    for at in (1, 2, -1):
        far.say_so = lambda reply, at=at: [(0.001, reply[:at]), (0.15, reply[at:])]
        await ask()
        far.renew()


async def in_two_too_late(bench: Any, far: Axes, ask: Ask) -> None:
    """Send the second piece of a reply too late; neither piece is matched to a request."""
    for share in (0.5, 0.99):

        def torn(reply: bytes, share: float = share) -> Said:
            at = int(len(reply) * share)
            return [(0.001, reply[:at]), (0.6, reply[at:])]

        await gives_up(bench, far, ask, torn)
        await ask()
        far.renew()


async def cut_off(bench: Any, far: Axes, ask: Ask) -> None:
    """Send a reply without its last byte; it is not accepted."""
    await gives_up(bench, far, ask, lambda reply: [(0.001, reply[:-1])])
    await ask()


async def lost(bench: Any, far: Axes, ask: Ask) -> None:
    await gives_up(bench, far, ask, lambda reply: [])
    await ask()


async def more_behind(bench: Any, far: Axes, ask: Ask) -> None:
    """Send stray bytes after a reply; they are drained before the next request."""
    for behind in (b"\0", b"N", b"\xff" * 7):
        far.say_so = lambda reply, behind=behind: [(0.001, reply + behind)]
        await ask()
        far.renew()
        begin = bench.now()
        await ask()
        assert bench.now() - begin >= DRAIN
        far.renew()


async def twice(bench: Any, far: Axes, ask: Ask) -> None:
    """Send a reply twice; the copy is not matched to the next request."""
    far.say_so = lambda reply: [(0.001, reply * 2)]
    await ask()
    far.renew()
    await ask()


INTRUSIONS = [
    stray_before, stray_twice, late, in_two, in_two_too_late, cut_off, lost, more_behind, twice,
]  # fmt: skip


async def gives_up(bench: Any, far: Axes, ask: Ask, say_so: Callable[[bytes], Said]) -> None:
    """Check that the request times out, and that the next request waits for a silence."""
    far.say_so = say_so
    asked = bench.now()
    with pytest.raises(ReplyTimeoutError):
        await ask(timeout=SHORT)
    assert bench.now() - asked == pytest.approx(SHORT)
    far.renew()
    far.forget()
    with pytest.raises(ReplyTimeoutError, match=r"was not sent within 0\.1 s"):
        await ask(timeout=0.1)
    assert far.raw == b""


async def disturbed(bench: Any, far: Axes, ask: Ask, intrusion: Callable[..., Any]) -> None:
    await intrusion(bench, far, ask)
    far.renew()
    await ask(timeout=USUAL + 2 * DRAIN)
    far.renew()
    begin = bench.now()
    await ask()  # the line is clean now
    assert bench.now() - begin < 0.01


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("intrusion", INTRUSIONS)
@pytest.mark.parametrize("unit", UNITS)
def test_no_query_takes_an_intrusion_for_its_reply(
    unit: str, intrusion: Callable[..., Any], side: Side
) -> None:
    async def scenario(bench: Any, call: Call, far: Axes) -> None:
        async with opened(bench, unit) as device:
            await settled(device.switch_to_low_level())

            async def ask(timeout: float = 2.0) -> None:
                values = await settled(method(device, call)(timeout=timeout))
                assert values.message == far.truth(call.table.req), call

            await disturbed(bench, far, ask, intrusion)

    for call in queries(unit):
        far = Axes(seed=1)
        side.run(far, lambda bench, call=call, far=far: scenario(bench, call, far))


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("intrusion", INTRUSIONS)
def test_no_line_of_text_takes_an_intrusion_for_its_reply(
    intrusion: Callable[..., Any], side: Side
) -> None:
    far = Axes(seed=1)

    async def scenario(bench: Any) -> None:
        async with opened(bench) as device:
            await settled(device.switch_to_high_level())

            async def ask(timeout: float = 2.0) -> None:
                assert await settled(device.text("W X", timeout=timeout)) == far.line

            await disturbed(bench, far, ask, intrusion)

    side.run(far, scenario)


@pytest.mark.parametrize("unit", UNITS)
def test_an_axis_has_ten_queries(unit: str) -> None:
    assert len(queries(unit)) == 10
