"""What is said of a line that is gone, in the same words on every kind of line."""

from __future__ import annotations

from stagewire.errors import TransportLost

__all__ = ["CLOSED", "HUNG_UP", "because", "lost", "stalled"]

CLOSED = "it was closed by this side"
HUNG_UP = "the other end hung up, or the port was unplugged"


def lost(url: str, why: str) -> TransportLost:
    """Return a new error; each that waits gets one of its own."""
    if why == CLOSED:
        return TransportLost(f"{url}: {why}")
    return TransportLost(
        f"{url} is gone: {why}. What was under way may have been done or not; open the line again, and read "
        "the state again"
    )


def because(error: Exception) -> str:
    """Return what the system says is wrong."""
    said = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return f"the system says: {said}"


def stalled(seconds: float) -> str:
    """Return that nothing of what is to be sent was taken for so long."""
    return (
        f"for {seconds:g} s it took no byte of what is to be sent (the other end does not read, or holds "
        "CTS; see rtscts and stall_timeout)"
    )
