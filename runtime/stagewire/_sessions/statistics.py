"""What a session counts."""

from __future__ import annotations


class Statistics:
    """Counts of a session, for people and tests; they only grow.

    Whatever a line does is counted here and is no error.
    """

    __slots__ = (
        "ambiguous", "bad_length", "cancelled", "dropped", "garbage", "late", "matched", "silences",
        "timed_out", "undocumented", "unknown",
    )  # fmt: skip

    def __init__(self) -> None:
        self.matched = 0
        """Frames and replies that answered a request or ended a motion."""
        self.late = 0
        """Replies to requests that had been given up; nobody got them."""
        self.ambiguous = 0
        """Frames without an address that several requests, or motions, may have meant; nobody got them."""
        self.timed_out = 0
        """Requests and motions whose time was over."""
        self.cancelled = 0
        """Requests and motions that their caller gave up."""
        self.undocumented = 0
        """Frames of an id that is known without a layout."""
        self.unknown = 0
        """Frames of an id that nobody knows."""
        self.bad_length = 0
        """Frames that are shorter than their layout."""
        self.garbage = 0
        """Bytes that belong to no frame, or to no request."""
        self.silences = 0
        """Frames whose rest did not come."""
        self.dropped = 0
        """Events that subscriptions lost because nobody took them in time."""

    def values(self) -> dict[str, int]:
        """Return all counts by name."""
        return {name: getattr(self, name) for name in self.__slots__}

    def __repr__(self) -> str:
        counted = ", ".join(f"{name}={count}" for name, count in self.values().items() if count)
        return f"Statistics({counted})"
