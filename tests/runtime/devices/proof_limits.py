"""Values that every call must refuse, and a check that it does."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from proof_calls import Call, facts_of, method, raised, rating
from proof_line import settled

from stagewire.errors import StagewireError
from stagewire_apt import stages

NO_NUMBERS = (math.nan, math.inf, -math.inf)
FAR_OUT = (10**12, -(10**12), 1e300, -1e300)


def options_of(unit: str) -> dict[str, Any]:
    """Return all options that scales can depend on."""
    facts = facts_of(unit)
    options: dict[str, Any] = {"identify": False, "on_close": "leave"}
    if facts["stages"]:
        options["stage"] = getattr(stages, facts["stages"][0])
        options |= raised(unit)
    if facts.get("status") == "piezo":
        options["max_travel_um"] = 100
    return options | rating(unit)


async def fault_of(
    device: Any, call: Call, given: dict[str, Any], sent: Callable[[], object]
) -> list[str]:
    """Return a problem if a call is not refused with a documented error before anything is sent.

    :param sent: returns what the controller received; empty for nothing.
    """
    try:
        await settled(method(device, call)(**given))
    except StagewireError:
        came = sent()
        return [f"{call}({given}): {came}"] if came else []
    except Exception as error:
        return [f"{call}({given}): {error!r}"]
    return [f"{call}({given}) was accepted: {sent()}"]
