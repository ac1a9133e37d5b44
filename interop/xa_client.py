"""Drive one controller with the vendor's XA SDK, and write what happened to a file as JSON.

    python interop/xa_client.py 27000001 127.0.0.1:4001 found.json
    python interop/xa_client.py 40000001 127.0.0.1:4001 found.json NRT100

The last argument is the connected product, for a controller that does not report it.

A process of its own for each controller, because the native library keeps the hardware information of the
first one. It writes a log below the home directory: set ``HOME`` to a temporary directory. Errors of the
library go to standard output. Only the Python interface of the package is used.
"""

from __future__ import annotations

import inspect
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import xa_families
from thorlabs_xa.shared.enums import (
    TLMC_MoveMode,
    TLMC_OperatingMode,
    TLMC_ScaleType,
    TLMC_StopMode,
)
from thorlabs_xa.shared.system_manager import SystemManager

LONGEST = 5000
"""The longest wait for an answer, in ms."""
LONGEST_MOVE = 60_000
"""The longest wait for the end of a motion, in ms."""


class Session:
    """Calls of the SDK, and their outcomes.

    :param file: the file of the outcomes, which is written after each call.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self.found: dict[str, Any] = {}

    def call(
        self, what: str, function: Callable[[], Any], shown: Callable[[Any], Any] | None = None
    ) -> Any:
        """Call a function and keep its outcome; return its value, or None if it raised.

        ``shown`` converts the value for the file.
        """
        try:
            value = function()
        except Exception as error:
            self.keep(what, None, f"{type(error).__name__}: {error}")
            return None
        self.keep(what, (shown or plain)(value))
        return value

    def keep(self, what: str, value: Any, error: str = "") -> None:
        """Keep a value or an error."""
        self.found[what] = {"value": value, "error": error}
        self._file.write_text(json.dumps(self.found), encoding="utf-8")


def plain(value: Any) -> Any:
    """Return a value of the SDK as numbers, strings, lists and mappings."""
    if isinstance(value, (int, float, str)) or value is None:
        return value
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return {name.lstrip("_"): plain(item) for name, item in vars(value).items()}


def getters(device: Any) -> list[str]:
    """Return the methods of a device that read something and need only the longest wait."""
    found = []
    for name, method in inspect.getmembers(device, inspect.ismethod):
        if name.startswith("get_"):
            arguments = list(inspect.signature(method).parameters)
            if arguments == ["max_wait_in_milliseconds"]:
                found.append(name)
    return found


def main(serial_number: str, transport: str, file: Path, product: str = "") -> None:
    """Open a controller, read all its parameters, and use it."""
    session = Session(file)
    system = SystemManager.instance()
    session.call("startup", system.startup)
    mode = (
        TLMC_OperatingMode.TLMC_OperatingMode_StatusPushedByController
        | TLMC_OperatingMode.TLMC_OperatingMode_SendEndOfMoveMessages
    )
    device = session.call(
        "open",
        lambda: system.open_device(serial_number, transport, mode),
        lambda device: type(device).__name__,
    )
    if device is None:
        return
    if product:
        session.call("set_connected_product", lambda: device.set_connected_product(product))
    for name in getters(device):
        session.call(name, lambda name=name: getattr(device, name)(LONGEST))
    if hasattr(device, "get_connected_product_info"):
        session.call("get_connected_product_info", device.get_connected_product_info)
    subchannels = device.get_all_subchannels() if hasattr(device, "get_all_subchannels") else []
    for number, channel in enumerate(subchannels, 1):
        for name in getters(channel):
            session.call(
                f"channel {number}: {name}",
                lambda channel=channel, name=name: getattr(channel, name)(LONGEST),
            )
    if hasattr(device, "get_home_params"):
        drive(session, device)
    else:
        session.call("use", lambda: xa_families.use(session, device))
    session.call("close", device.close)
    session.call("shutdown", system.shutdown)


def drive(session: Session, device: Any) -> None:
    """Home, move, jog and stop a stage, and keep its positions in counts and in physical units."""

    def position(after: str) -> int:
        device.request_status(LONGEST)
        if hasattr(device, "get_universal_status"):
            counts = device.get_universal_status(LONGEST).position
        else:
            counts = device.get_stepper_status(LONGEST).position
        unit = session.call(f"{after}: counts", lambda: counts)
        session.call(
            f"{after}: physical",
            lambda: device.convert_from_device_units_to_physical(
                TLMC_ScaleType.TLMC_ScaleType_Distance, unit
            ),
        )
        return counts

    session.call("home", lambda: device.home(LONGEST_MOVE))
    start = position("home")
    unit = device.get_preferred_physical_unit(TLMC_ScaleType.TLMC_ScaleType_Distance)
    target = session.call(
        "target",
        lambda: device.convert_from_physical_to_device(
            TLMC_ScaleType.TLMC_ScaleType_Distance, unit, 1.5
        ),
    )
    mode = TLMC_MoveMode
    session.call(
        "move to a position",
        lambda: device.move(mode.TLMC_MoveMode_Absolute, target, LONGEST_MOVE),
    )
    position("move to a position")
    session.call(
        "move by a distance",
        lambda: device.move(mode.TLMC_MoveMode_Relative, -(target - start) // 3, LONGEST_MOVE),
    )
    position("move by a distance")
    session.call("jog", lambda: device.move(mode.TLMC_MoveMode_JogForward, 0, LONGEST_MOVE))
    position("jog")
    session.call("start", lambda: device.move(mode.TLMC_MoveMode_ContinuousForward, 0, 0))
    time.sleep(1)
    session.call("stop", lambda: device.stop(TLMC_StopMode.TLMC_StopMode_Profiled, LONGEST_MOVE))
    stopped = position("stop")
    time.sleep(0.5)
    session.keep("at rest", position("rest") == stopped)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]), *sys.argv[4:])
