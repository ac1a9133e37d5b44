"""Sessions with controllers, for threads and asyncio (``docs/explanation/sessions.md``).

A core is sans-I/O: it takes received bytes and the time, and returns bytes to send and finished exchanges. A
session drives a core over a link.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING: bool = False
if TYPE_CHECKING:
    from stagewire._sessions.asynchronous import AsyncCommandSession, AsyncFramedSession
    from stagewire._sessions.commands import CommandCore
    from stagewire._sessions.framed import FramedCore
    from stagewire._sessions.matching import Matching
    from stagewire._sessions.options import Ends, SessionOptions
    from stagewire._sessions.recording import Recording
    from stagewire._sessions.statistics import Statistics
    from stagewire._sessions.subscriptions import AsyncSubscription, BlockingSubscription
    from stagewire._sessions.synchronous import CommandSession, FramedSession

__all__ = [
    "AsyncCommandSession",
    "AsyncFramedSession",
    "AsyncSubscription",
    "BlockingSubscription",
    "CommandCore",
    "CommandSession",
    "Ends",
    "FramedCore",
    "FramedSession",
    "Matching",
    "Recording",
    "SessionOptions",
    "Statistics",
]

if not TYPE_CHECKING:  # otherwise type checkers would accept any name
    __getattr__, __dir__ = lazy(
        __name__,
        {
            "_sessions.options": "Ends SessionOptions",
            "_sessions.statistics": "Statistics",
            "_sessions.framed": "FramedCore",
            "_sessions.commands": "CommandCore",
            "_sessions.synchronous": "CommandSession FramedSession",
            "_sessions.asynchronous": "AsyncCommandSession AsyncFramedSession",
            "_sessions.subscriptions": "AsyncSubscription BlockingSubscription",
            "_sessions.recording": "Recording",
            "_sessions.matching": "Matching",
        },
    )
