"""The kinds of exchanges with controllers whose messages have frames."""

from __future__ import annotations

from stagewire._framings.header.message import FramedMessage
from stagewire._sessions.exchange import Exchange

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import TypeAlias

    Selected: TypeAlias = tuple[tuple[str, object], ...]


_NOTHING: dict[int | str, int] = {}

_MOST_REASONS = 8
"""Most entries of :attr:`FramedExchange.passed_over`; this limits memory on a noisy line."""


PassedOver = tuple[int, str, str]
"""For a frame that did not match: its message, the reason, and advice."""


class FramedExchange(Exchange):
    """A frame that is sent to one address.

    :param dest: the address.
    :param ids: the messages that may answer it.
    """

    __slots__ = ("after", "dest", "ids", "passed_over", "seen")

    def __init__(
        self,
        message: FramedMessage,
        raw: bytes,
        timeout: float,
        deadline: float,
        dest: int,
        ids: frozenset[int],
    ) -> None:
        super().__init__(message, raw, timeout, deadline)
        self.dest = dest
        self.ids = ids
        self.after = 0
        """Number of bytes received before it was written. A frame that began earlier is not an answer."""
        self.seen = _NOTHING
        """Number of each message received before it was written."""
        self.passed_over: dict[PassedOver, tuple[int, bytes]] = {}
        """Frames of the awaited messages that did not match -> how many, and the last of them."""

    def pass_over(self, passed: PassedOver, raw: bytes) -> None:
        """Note a frame of an awaited message that did not match."""
        known = self.passed_over
        if passed in known or len(known) < _MOST_REASONS:
            count, _ = known.get(passed, (0, raw))
            known[passed] = (count + 1, raw)


class Ask(FramedExchange):
    """A request that one frame answers.

    :param selected: fields of the request that the reply must repeat, with their values.
    """

    __slots__ = ("selected", "until")

    def __init__(
        self,
        message: FramedMessage,
        raw: bytes,
        timeout: float,
        deadline: float,
        dest: int,
        ids: frozenset[int],
        selected: Selected,
    ) -> None:
        super().__init__(message, raw, timeout, deadline, dest, ids)
        self.selected = selected
        self.until = 0.0
        """End of the period for its late reply, after it was given up."""

    @property
    def is_question(self) -> bool:
        """See :attr:`.Exchange.is_question`."""
        return True


class Send(FramedExchange):
    """A message without a reply."""

    __slots__ = ()


class _OfChannel(FramedExchange):
    """An exchange that concerns one channel.

    :param channel: number of the channel; None: the protocol has no channels.
    """

    __slots__ = ("channel",)

    def __init__(
        self,
        message: FramedMessage,
        raw: bytes,
        timeout: float,
        deadline: float,
        dest: int,
        ids: frozenset[int],
        channel: int | None,
    ) -> None:
        super().__init__(message, raw, timeout, deadline, dest, ids)
        self.channel = channel


class Motion(_OfChannel):
    """A motion, in progress until its end is reported.

    :param stopped: those of the awaited messages that report a stop.
    """

    __slots__ = ("stopped",)

    def __init__(
        self,
        message: FramedMessage,
        raw: bytes,
        timeout: float,
        deadline: float,
        dest: int,
        completed: frozenset[int],
        stopped: frozenset[int],
        channel: int | None,
    ) -> None:
        super().__init__(message, raw, timeout, deadline, dest, completed | stopped, channel)
        self.stopped = stopped


class Halt(_OfChannel):
    """A stop of a motion."""

    __slots__ = ("motion", "until")

    def __init__(
        self,
        message: FramedMessage,
        raw: bytes,
        timeout: float,
        deadline: float,
        dest: int,
        ids: frozenset[int],
        channel: int | None,
    ) -> None:
        super().__init__(message, raw, timeout, deadline, dest, ids, channel)
        self.motion: Motion | None = None
        """The motion that was in progress when it was written."""
        self.until = 0.0
        """End of the period for its late answer, after it was given up."""
