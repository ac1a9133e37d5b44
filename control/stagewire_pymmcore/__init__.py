"""Stages, piezos and shutters as Python devices of pymmcore-plus, without Micro-Manager's drivers.

``pip install 'stagewire[pymmcore]'`` installs what this package needs. See ``docs/control-systems.md``.
"""

from __future__ import annotations

try:
    import pymmcore_plus  # noqa: F401
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"stagewire_pymmcore requires {error.name}: pip install 'stagewire[pymmcore]'",
        name=error.name,
    ) from None

from stagewire_pymmcore.piezo import PiezoStage
from stagewire_pymmcore.shutter import Shutter
from stagewire_pymmcore.stages import Stage, XYStage

__all__ = ["PiezoStage", "Shutter", "Stage", "XYStage"]
