"""A framer of any kind as a contender: it reads a stream in chunks, and decodes what it finds or not."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from measure import Runner

__all__ = ["chunks", "reading"]


def chunks(stream: bytes, size: int) -> list[bytes]:
    """Return the stream in chunks."""
    return [stream[start : start + size] for start in range(0, len(stream), size)]


def reading(
    make: Callable[[], Any], decoded: type | None, parts: Sequence[bytes], count: int
) -> Runner:
    """Return a runner that frames a stream with a framer that ``make`` gives.

    :param decoded: class of the events that are decoded; None to decode nothing.
    :param count: events of the stream; the runner returns the seconds for one.
    """

    def run() -> float:
        framer = make()
        events = 0
        start = time.process_time()
        for part in parts:
            for event in framer.feed(part):
                if type(event) is decoded:
                    event.frame  # noqa: B018 - made when it is asked for
                events += 1
        seconds = time.process_time() - start
        assert events == count
        assert not framer.pending
        return seconds / count

    return run
