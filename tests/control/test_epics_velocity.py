"""A velocity or an acceleration that the controller rounds to 0 is refused, and the former one is kept."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from iocs import running

import stagewire_virtual as virtual
from stagewire_apt import stages
from stagewire_epics.records import PutRefusedError, Severity

KDC101 = """
[controllers.t]
unit = "KDC101"
url = "{url}"
stage = "Z825B"
travel_mm = 25
[motors.x]
controller = "t"
"""
MS2000 = """
[controllers.t]
unit = "MS2000"
url = "{url}"
[motors.x]
controller = "t"
axis = "X"
"""


@pytest.mark.parametrize(
    ("controller", "bench", "field", "value"),
    [
        (lambda: virtual.KDC101(stage=stages.Z825B), KDC101, "VELO", 1e-9),
        (lambda: virtual.KDC101(stage=stages.Z825B), KDC101, "ACCL", 1e9),
        (virtual.MS2000, MS2000, "VELO", 1e-9),
    ],
)
def test_a_value_that_the_controller_rounds_to_0_is_refused(
    controller: Any, bench: str, field: str, value: float
) -> None:
    async def body(url: str) -> None:
        async with running(bench.format(url=url)) as x:
            former = x[field]
            with pytest.raises(PutRefusedError, match="is 0 for the controller"):
                await x.put(field, value)
            await x.put("VAL", 0.2)
            await x.put(field, former)
            assert (x[field], x.severity(field)) == (
                pytest.approx(former, rel=1e-3),
                Severity.NO_ALARM,
            )

    with controller().tcp() as one:
        asyncio.run(body(one.url))
