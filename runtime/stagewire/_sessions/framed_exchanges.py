"""The kinds of exchanges with controllers whose messages have frames."""

from __future__ import annotations

from stagewire._framings.header.message import FramedMessage
from stagewire._sessions.exchange import Exchange

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import TypeAlias

    Selected: TypeAlias = tuple[tuple[str, object], ...]


_NOTHING: dict[int | str, int] = {}

_MOST_REASONS = 8
"""Entries of :attr:`FramedExchange.passed_over`; a line that says anything at all fills no memory."""


PassedOver = tuple[int, str, str]
"""Of a frame that was not taken for the awaited one: its message, the reason, and what to do."""


class FramedExchange(Exchange):
    """A frame that is sent to one address.

    :param dest: the address.
    :param ids: the messages of which one is awaited.
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
        """How many bytes had come when it was written: what began before them is no answer."""
        self.seen = _NOTHING
        """How many of each message had come when it was written."""
        self.passed_over: dict[PassedOver, tuple[int, bytes]] = {}
        """Frames of the awaited messages that nobody got: why, how many, and the last of them."""

    def pass_over(self, passed: PassedOver, raw: bytes) -> None:
        """Note a frame that may be the awaited one, and that nobody gets."""
        known = self.passed_over
        if passed in known or len(known) < _MOST_REASONS:
            count, _ = known.get(passed, (0, raw))
            known[passed] = (count + 1, raw)


class Ask(FramedExchange):
    """A request that one frame answers.

    :param selected: fields of the request that the reply repeats, with their values.
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
        """After it was given up: until when its late reply may come."""

    @property
    def is_question(self) -> bool:
        """See :attr:`.Exchange.is_question`."""
        return True


class Send(FramedExchange):
    """What nothing answers."""

    __slots__ = ()


class _OfChannel(FramedExchange):
    """What concerns one channel.

    :param channel: its number; None: the protocol has none.
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
    """What is under way until its end is reported.

    :param stopped: those of the awaited messages that say that it was stopped.
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
    """What stops a motion."""

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
        """What was under way when it was written."""
        self.until = 0.0
        """After it was given up: until when its answer may come."""
