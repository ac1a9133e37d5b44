"""The formats that a controller of commands takes, and how it is brought from one to the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stagewire._devices.opening import commanded
from stagewire._devices.spot import CONTROLLER, Spot
from stagewire._sessions.lines import in_low_level, switching
from stagewire.errors import UnsupportedError

if TYPE_CHECKING:
    from stagewire._sessions.lines import Mode

__all__ = ["last_words", "switch"]


async def switch(spot: Spot, format: str, timeout: float | None) -> None:
    """Send the setup command after which a controller takes ``format``.

    Raises :class:`~stagewire.errors.UnsupportedError` for a controller that has none for it.
    """
    command = switching(commanded(spot.connection.facts), format)
    if command is None:
        raise UnsupportedError(f"{spot.name} has no command that leads to its {format} format")
    await spot.line.send(command(), CONTROLLER, spot.seconds(timeout))


def last_words(spot: Spot, mode: Mode) -> bytes:
    """Return what is to be said before the line is closed: stops, in the format that is theirs."""
    stops = spot.connection.last_words()
    return in_low_level(commanded(spot.connection.facts), stops, mode) if stops else b""
