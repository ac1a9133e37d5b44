"""The checks of the suite, by protocol, in the order in which they run."""

from __future__ import annotations

from importlib import import_module
from typing import Final

from stagewire.protocols import Protocol
from stagewire_conformance.device.check import Kind

_PACKAGES: Final = {"thorlabs_apt": "apt", "asi_ms2000": "ms2000"}


def kinds_of(protocol: Protocol) -> tuple[Kind, ...]:
    """Return the kinds of checks of a protocol, in the order in which they run; empty if it has none."""
    package = _PACKAGES.get(protocol.name)
    if package is None:
        return ()
    kinds: tuple[Kind, ...] = import_module(f"{__name__}.{package}").KINDS
    return kinds
