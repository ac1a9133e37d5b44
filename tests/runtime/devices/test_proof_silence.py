"""Calls to a silent controller: every call of every unit ends within its timeout with a documented error."""

from __future__ import annotations

import random
from typing import Any

import pytest
from proof_calls import Call, arguments, calls, facts_of, method, rating, short_forms, units
from proof_controller import Controller
from proof_limits import options_of
from proof_line import SIDES, FarEnd, Side, settled

from stagewire.errors import MotionTimeoutError, ReplyTimeoutError

TIMEOUT = 0.4
WAITS = ("_get", "_ask", "_change", "_act", "_halt")
PACKAGES = {"thorlabs_apt": "stagewire_apt", "asi_ms2000": "stagewire_ms2000"}
UNITS = [(protocol, unit) for protocol in PACKAGES for unit in units(protocol)]


class Silent(FarEnd):
    """A controller that receives everything and sends nothing."""

    def take(self, data: bytes) -> tuple[()]:
        return ()


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(("protocol", "unit"), UNITS)
def test_every_call_ends_within_its_timeout(protocol: str, unit: str, side: Side) -> None:
    package = PACKAGES[protocol]
    draw = random.Random(unit)
    assert calls(unit, package)

    async def scenario(bench: Any, call: Call) -> str:
        options: dict[str, Any] = {"on_close": "leave", "timeout": TIMEOUT}
        if protocol == "thorlabs_apt":
            options |= {"identify": False, "travel_mm": None, **rating(unit)}
        if call.argument:
            options |= options_of(unit)
        async with bench.open(unit, package, **options) as device:
            if protocol == "asi_ms2000" and call.part == "axis":
                await settled(device.switch_to_low_level())
            given = arguments(call, draw, protocol)
            begin = bench.now()
            try:
                await settled(method(device, call)(**given, **timeout_of(call)))
            except ReplyTimeoutError as error:
                documented = isinstance(error, MotionTimeoutError) or call.kind != "_act"
                outcome = "" if documented else f"{error!r} of a motion"
            except Exception as error:
                outcome = f"{error!r}"
            else:
                outcome = "returned" if call.kind in WAITS and not unanswered(call) else ""
            if bench.now() - begin > TIMEOUT * 1.1:
                outcome += f" after {bench.now() - begin:.3f} s"
            return f"{call}: {outcome}" if outcome else ""

    silence = [
        side.run(Silent(), lambda bench, call=call: scenario(bench, call))
        for call in (*calls(unit, package), *(short for short, _ in short_forms(unit, package)))
    ]
    assert "\n".join(filter(None, silence)) == ""


def timeout_of(call: Call) -> dict[str, float]:
    return {} if call.kind == "_start" else {"timeout": TIMEOUT}


def unanswered(call: Call) -> bool:
    """Return whether the document lists no message after a stop."""
    ends = call.table.ends.completed if call.kind == "_halt" and call.table.ends else ()
    return call.kind == "_halt" and not any(
        cls.layout.message in facts_of(call.unit)["messages"] for cls in ends
    )


def test_the_timeout_error_names_the_request_and_the_expected_reply() -> None:
    async def scenario(bench: Any) -> str:
        async with bench.open("TDC001", identify=False) as device:
            with pytest.raises(ReplyTimeoutError) as caught:
                device.get_vel_params(timeout=0.1)
        return str(caught.value)

    text = SIDES[0].run(Controller(), scenario)
    assert "MOT_REQ_VELPARAMS" in text
    assert "14 04 01 00 50 01" in text.lower()
    assert "MOT_GET_VELPARAMS" in text
    assert "0.1" in text
