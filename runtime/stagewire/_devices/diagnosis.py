"""Why a motion has not ended: what a controller shows when it is asked afterwards."""

from __future__ import annotations

from typing import Final, TypeAlias

from stagewire._devices.calls import look
from stagewire._devices.line import Deadline
from stagewire._devices.spot import Spot
from stagewire.errors import (
    ControllerFaultError,
    MotionTimeoutError,
    ReplyTimeoutError,
    StagewireError,
)

__all__ = ["explained"]

Unended: TypeAlias = MotionTimeoutError | ControllerFaultError
"""How the wait for a motion ends that may still be under way."""

_SHARE: Final = 0.05
"""Of the time of a motion, for the questions after it."""
_SILENT: Final = "asked for its status, the controller does not answer either"


async def explained(spot: Spot, error: Unended, seconds: float) -> Unended:
    """Return the same error with the states that the controller shows now and that may hinder a motion.

    It takes a twentieth of the time of the motion at most, and no longer than any other call. No question is
    asked after one that was not answered. A status that shows rest does not settle the motion: that is for
    the caller to ask for. Whatever goes wrong here, the error remains what it was.

    :param seconds: that the motion was given.
    """
    deadline = Deadline(spot.line, min(seconds * _SHARE, spot.seconds(None)))
    causes: list[str] = []
    told = ""
    for table in spot.connection.unit.diagnosis:
        try:
            values = await look(spot, table, deadline.left)
        except ReplyTimeoutError:
            if not told:
                return _with(error, _SILENT, ())
            break
        except StagewireError:  # the line is lost or closed
            return error
        causes += [state.cause for state in spot.connection.unit.hindered(values.message)]
        told = told or values.told(spot.connection.channel_field(type(values.message)))
    if causes:
        return _with(error, f"likely cause: {'; '.join(causes)}", tuple(causes))
    return _with(error, f"its status shows no cause: {told}", ()) if told else error


def _with(error: Unended, note: str, causes: tuple[str, ...]) -> Unended:
    text = f"{error}; {note}"
    if isinstance(error, ControllerFaultError):
        return ControllerFaultError(text, error.code, error.fault, error.message, causes)
    return MotionTimeoutError(text, causes)
