"""Base classes and values of generated device classes. See ``docs/reference/devices.md``.

Classes for asyncio begin with ``Async``; the others are for threads.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING: bool = False
if TYPE_CHECKING:
    from stagewire._devices.asynchronous.devices import Device as AsyncDevice
    from stagewire._devices.asynchronous.parts import Motion as AsyncMotion
    from stagewire._devices.asynchronous.parts import Part as AsyncPart
    from stagewire._devices.asynchronous.recorder import Recorder as AsyncRecorder
    from stagewire._devices.candidates import candidates, clean_model
    from stagewire._devices.connection import link_options
    from stagewire._devices.options import OpenOptions
    from stagewire._devices.parameters import (
        COUNTS,
        Parameter,
        ParameterKind,
        SetOfParameters,
        parameter_sets,
        status_set,
    )
    from stagewire._devices.reals import number_of, pattern_of
    from stagewire._devices.scales import Scales, ToldValue
    from stagewire._devices.stage_files import read_stages
    from stagewire._devices.synchronous.devices import Device
    from stagewire._devices.synchronous.parts import Motion, Part
    from stagewire._devices.synchronous.recorder import Recorder
    from stagewire._devices.tables import MotionEnd
    from stagewire._devices.unit import Facts, Unit
    from stagewire._devices.values import Bits, BitsByUnit, InUnits, Raw, Real, Values

__all__ = [
    "COUNTS",
    "AsyncDevice",
    "AsyncMotion",
    "AsyncPart",
    "AsyncRecorder",
    "Bits",
    "BitsByUnit",
    "Device",
    "Facts",
    "InUnits",
    "Motion",
    "MotionEnd",
    "OpenOptions",
    "Parameter",
    "ParameterKind",
    "Part",
    "Raw",
    "Real",
    "Recorder",
    "Scales",
    "SetOfParameters",
    "ToldValue",
    "Unit",
    "Values",
    "candidates",
    "clean_model",
    "link_options",
    "number_of",
    "parameter_sets",
    "pattern_of",
    "read_stages",
    "status_set",
]

__path__: list[str] = []  # 0.1 had modules below this name; see stagewire._deprecated

if not TYPE_CHECKING:  # otherwise type checkers would accept any name
    __getattr__, __dir__ = lazy(
        __name__,
        {
            "_devices.synchronous.devices": "Device",
            "_devices.synchronous.parts": "Motion Part",
            "_devices.asynchronous.devices": "Device=AsyncDevice",
            "_devices.asynchronous.parts": "Motion=AsyncMotion Part=AsyncPart",
            "_devices.synchronous.recorder": "Recorder",
            "_devices.asynchronous.recorder": "Recorder=AsyncRecorder",
            "_devices.options": "OpenOptions",
            "_devices.parameters": (
                "COUNTS Parameter ParameterKind SetOfParameters parameter_sets status_set"
            ),
            "_devices.tables": "MotionEnd",
            "_devices.reals": "number_of pattern_of",
            "_devices.unit": "Facts Unit",
            "_devices.values": "Bits BitsByUnit InUnits Raw Real Values",
            "_devices.scales": "Scales ToldValue",
            "_devices.candidates": "candidates clean_model",
            "_devices.connection": "link_options",
            "_devices.stage_files": "read_stages",
        },
    )
