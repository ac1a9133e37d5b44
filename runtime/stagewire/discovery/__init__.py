"""Finding controllers: which ports there are, what stands behind them, and why nothing is found.

:func:`discover` looks at what the operating system says of its serial ports and opens none of them, unless
it is told to ask. :func:`open` opens a controller whose class nobody had to name. What
:mod:`~stagewire.discovery.computer_diagnosis` and :mod:`~stagewire.discovery.line_diagnosis` find wrong, they
say with what to do about it.

The runtime knows no unit: names, prefixes of serial numbers and addresses come from the registries of the
protocols that are installed.
"""

from __future__ import annotations

TYPE_CHECKING = False  # what finds controllers is imported when something is to be found
if TYPE_CHECKING:
    from typing import Any

    from stagewire.discovery.finding import discover as discover
    from stagewire.discovery.found import Found as Found
    from stagewire.discovery.known import Known as Known
    from stagewire.discovery.opening import device_class as device_class
    from stagewire.discovery.opening import open as open
    from stagewire.discovery.ports import Port as Port

__all__ = ["Found", "Known", "Port", "device_class", "discover", "open"]

_PLACES = {
    "Found": "found",
    "Known": "known",
    "Port": "ports",
    "device_class": "opening",
    "discover": "finding",
    "open": "opening",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
