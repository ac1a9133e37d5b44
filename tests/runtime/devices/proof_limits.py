"""Values that no call may take, and what happens when one is given."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from proof_calls import Call, method
from proof_line import settled

from stagewire.errors import StagewireError

NO_NUMBERS = (math.nan, math.inf, -math.inf)
FAR_OUT = (10**12, -(10**12), 1e300, -1e300)


async def fault_of(
    device: Any, call: Call, given: dict[str, Any], sent: Callable[[], object]
) -> list[str]:
    """Return what is wrong when a call is not refused with a documented error and 0 bytes on the wire.

    :param sent: shows what came at the controller; empty when nothing did.
    """
    try:
        await settled(method(device, call)(**given))
    except StagewireError:
        came = sent()
        return [f"{call}({given}): {came}"] if came else []
    except Exception as error:
        return [f"{call}({given}): {error!r}"]
    return [f"{call}({given}) was taken: {sent()}"]
