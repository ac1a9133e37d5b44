"""Virtual controllers: every unit of the installed protocols, simulated down to the bytes on the line.

.. code-block:: python

    import stagewire_virtual as virtual
    from stagewire_apt import stages

    with virtual.TDC001(stage=stages.Z8) as tdc:        # in memory, the test advances the clock
        tdc.write(bytes.fromhex("43 04 01 00 50 01"))   # MOT_MOVE_HOME
        tdc.advance(60)
        tdc.read_frames()
    with virtual.TDC001(stage=stages.Z8).tcp() as tdc:  # in real time, for other programs
        print(tdc.url)

Each unit is a :class:`Factory` under its name (``dir(stagewire_virtual)`` lists them). Calling a factory
returns a :class:`VirtualController`, whose ``tcp()`` and ``pty()`` return a :class:`ServedController`.
``rack`` makes a rack of modules, ``replay_of`` plays back the controller's side of a recorded session, and
``load_bench`` reads a file that describes several units.
"""

from __future__ import annotations

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Any

    from stagewire_virtual.bench import Bench, load_bench
    from stagewire_virtual.clock import RealClock, SteppedClock
    from stagewire_virtual.controller import VirtualController
    from stagewire_virtual.errors import VirtualError
    from stagewire_virtual.factory import Factory, rack, replay_of
    from stagewire_virtual.faults.fault import Fault, parse_fault
    from stagewire_virtual.options import LinkKind, Options, Settings
    from stagewire_virtual.serving.server import ServedController, Server

__all__ = [
    "Bench",
    "Factory",
    "Fault",
    "LinkKind",
    "Options",
    "RealClock",
    "ServedController",
    "Server",
    "Settings",
    "SteppedClock",
    "VirtualController",
    "VirtualError",
    "load_bench",
    "parse_fault",
    "rack",
    "replay_of",
]

_MODULES = {
    "Bench": "bench",
    "Factory": "factory",
    "Fault": "faults.fault",
    "LinkKind": "options",
    "Options": "options",
    "RealClock": "clock",
    "ServedController": "serving.server",
    "Server": "serving.server",
    "Settings": "options",
    "SteppedClock": "clock",
    "VirtualController": "controller",
    "VirtualError": "errors",
    "load_bench": "bench",
    "parse_fault": "faults.fault",
    "rack": "factory",
    "replay_of": "factory",
}

_RENAMED = {"Line": "LinkKind"}  # the next release removes the old names


if TYPE_CHECKING:  # every name that is not imported above is a unit

    def __getattr__(name: str) -> Factory: ...

else:

    def __getattr__(name: str) -> Any:
        """Import a public name, or return the factory of the unit with that name."""
        from importlib import import_module

        if name.startswith("_"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        if name in _RENAMED:
            from warnings import warn

            new = _RENAMED[name]
            warn(f"{__name__}.{name} is now {new}", DeprecationWarning, stacklevel=2)
            name = new
        if name in _MODULES:
            return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
        from stagewire_virtual.factory import factory_of

        return factory_of(name)


def __dir__() -> list[str]:
    """Return the public names and the units."""
    from stagewire_virtual.factory import simulated_units

    return sorted([*__all__, *simulated_units()])
