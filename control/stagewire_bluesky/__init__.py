"""Motors, piezos, shutters and gauges as ophyd-async devices, for plans of bluesky.

``pip install 'stagewire[bluesky]'`` installs what this package needs. See ``docs/control-systems.md``.
"""

from __future__ import annotations

try:
    import ophyd_async.core  # noqa: F401
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"stagewire_bluesky requires {error.name}: pip install 'stagewire[bluesky]'",
        name=error.name,
    ) from None

from stagewire_bluesky.controller import Controller, Reference
from stagewire_bluesky.gauge import StrainGauge
from stagewire_bluesky.motor import Motor
from stagewire_bluesky.outputs import Piezo, Shutter, ShutterState
from stagewire_bluesky.parameters import Parameters
from stagewire_bluesky.suspending import Watched

__all__ = [
    "Controller",
    "Motor",
    "Parameters",
    "Piezo",
    "Reference",
    "Shutter",
    "ShutterState",
    "StrainGauge",
    "Watched",
]
