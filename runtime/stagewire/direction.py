"""Which way messages travel."""

from __future__ import annotations

import enum

__all__ = ["Direction"]


class Direction(enum.Flag):
    """Which way a message travels."""

    TO_CONTROLLER = 1
    TO_HOST = 2
    BOTH = 3
