"""The formats that a controller of commands takes, and how it is brought from one to the other."""

from __future__ import annotations

from stagewire.commands import SetupCommand
from stagewire.devices.spot import CONTROLLER, Spot
from stagewire.errors import UnsupportedError

__all__ = ["last_words", "switch"]


async def switch(spot: Spot, format: str, timeout: float | None) -> None:
    """Send the setup command after which a controller takes ``format``.

    Raises :class:`~stagewire.errors.UnsupportedError` for a controller that has none for it.
    """
    await spot.line.send(switching(spot, format)(), CONTROLLER, spot.seconds(timeout))


def switching(spot: Spot, format: str) -> type[SetupCommand]:
    """Return the setup command after which a controller takes ``format``."""
    for cls in spot.connection.facts.protocol.messages:
        if issubclass(cls, SetupCommand) and cls.layout.switches_to == format:
            return cls
    raise UnsupportedError(f"{spot.name} has no command that leads to its {format} format")


def last_words(spot: Spot, mode: str) -> bytes:
    """Return what is to be said before the line is closed: stops, in the format that is theirs."""
    stops = spot.connection.last_words()
    if stops and mode != "low_level":
        return switching(spot, "low_level")().pack() + stops
    return stops
