"""The counts of a session."""

from __future__ import annotations


class Statistics:
    """Counts of a session, for people and tests. They only increase.

    Bad input from a line is counted here and raises no error.
    """

    __slots__ = (
        "ambiguous", "bad_length", "cancelled", "dropped", "garbage", "late", "matched", "silences",
        "timed_out", "undocumented", "unknown",
    )  # fmt: skip

    def __init__(self) -> None:
        self.matched = 0
        """Frames and replies that answered a request or ended a motion."""
        self.late = 0
        """Replies to requests that had been given up; they were discarded."""
        self.ambiguous = 0
        """Frames without an address that matched several requests or motions; they were given to none."""
        self.timed_out = 0
        """Requests and motions whose timeout passed."""
        self.cancelled = 0
        """Requests and motions that were cancelled by their caller."""
        self.undocumented = 0
        """Frames with an id that is known without a layout."""
        self.unknown = 0
        """Frames with an unknown id."""
        self.bad_length = 0
        """Frames that are shorter than their layout."""
        self.garbage = 0
        """Bytes that belong to no frame or no request."""
        self.silences = 0
        """Frames whose rest did not arrive."""
        self.dropped = 0
        """Events that subscriptions dropped because they were not taken in time."""

    def values(self) -> dict[str, int]:
        """Return all counts by name."""
        return {name: getattr(self, name) for name in self.__slots__}

    def __repr__(self) -> str:
        counted = ", ".join(f"{name}={count}" for name, count in self.values().items() if count)
        return f"Statistics({counted})"
