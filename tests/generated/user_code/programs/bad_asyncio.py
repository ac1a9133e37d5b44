"""Mistakes of asyncio users; each line ends with the findings of mypy and pyright."""

from __future__ import annotations

from stagewire_apt import messages as m
from stagewire_apt.aio import TDC001


async def one_stage(tdc: TDC001) -> float:
    """A stage in millimetres."""
    tdc.home()  # wrong: unused-coroutine reportUnusedCoroutine
    await tdc.move_absolute(um=1.5)  # wrong: call-arg reportCallIssue
    await tdc.move_absolute(mm=b"1.5")  # wrong: arg-type reportArgumentType
    await tdc.jog(["FORWARD"])  # wrong: arg-type reportArgumentType
    tdc.start_home().wait()  # wrong: attr-defined reportAttributeAccessIssue
    print(tdc.get_vel_params().max_velocity)  # wrong: attr-defined reportAttributeAccessIssue
    async for status in tdc.subscribe(m.MotGetDcStatusUpdate):
        print(status.frame)  # wrong: attr-defined reportAttributeAccessIssue
    with TDC001.open("virtual://TDC001") as other:  # wrong: attr-defined reportGeneralTypeIssues
        print(other)
    return await tdc.get_vel_params()  # wrong: return-value reportReturnType
