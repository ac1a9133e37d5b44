"""The output of a controller: which messages are sent, and in which form.

Also has the types of message handlers and of the parts that provide them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Final, Protocol

from stagewire import Frame, FramedMessage
from stagewire_apt import messages as m
from stagewire_virtual.instrument import Unit
from stagewire_virtual.thorlabs_apt.facts import facts_of
from stagewire_virtual.thorlabs_apt.quirks import FRAME_QUIRKS

Handler = Callable[[Frame], None]
"""Handles one message of a controller."""


class Responder(Protocol):
    """The interface of a controller for message handlers."""

    def send(self, message: FramedMessage, cause: Frame) -> None:
        """Send a message that a frame of the host caused."""

    def refuse(self, cause: Frame, why: str) -> None:
        """Refuse a frame of the host."""


class Panel(Protocol):
    """A part of an instrument without channels, which can answer at several addresses."""

    def handlers(self, controller: Responder) -> Mapping[str, Handler]:
        """Return the handlers of its messages, which answer through ``controller``."""


UNACKNOWLEDGED: Final = 50
"""How many status messages are sent without a keep-alive message of the host (pages 80 and 105)."""

_UNACKNOWLEDGED_OF: Final = {"PZMOT_ACK_STATUSUPDATE": 10}
"""The same for a keep-alive message with another number (Issue 37, page 406)."""


class Transmitter:
    """Sends all messages of one controller.

    Messages that the unit does not have, and messages that the host muted, are not sent. A controller that
    requires keep-alive messages sends :data:`UNACKNOWLEDGED` unsolicited messages (updates and completions)
    after the last one, or 10 if its keep-alive message is PZMOT_ACK_STATUSUPDATE; further ones are lost. A
    status message that the host requested is always sent and does not count. Pages 80 and 105 do not say so,
    but a real TDC001 answers drivers that poll it and never acknowledge.

    :param unit: its unit in the registry.
    :param wants_keep_alive: whether it requires keep-alive messages.
    :param quirks: names of quirks; those in :data:`~stagewire_virtual.thorlabs_apt.quirks.FRAME_QUIRKS`
        change frames.
    :param transmit: sends the bytes of a frame.
    """

    def __init__(
        self,
        unit: Unit,
        wants_keep_alive: bool,
        quirks: Collection[str],
        transmit: Callable[[bytes], None],
    ) -> None:
        self._unit = unit
        self._facts = facts_of(unit)
        keep_alive = unit.facts.get("keep_alive", "none")
        limit = _UNACKNOWLEDGED_OF.get(keep_alive, UNACKNOWLEDGED)
        self._limit = limit if wants_keep_alive else None
        self._quirks = [quirk for name, quirk in FRAME_QUIRKS.items() if name in quirks]
        self._transmit = transmit
        self.reset()

    def reset(self) -> None:
        """Reset to the power-on state: nothing muted, count 0."""
        self._muted: set[str] = set()
        self._count = 0

    def keep_alive(self) -> None:
        """Reset the count of unacknowledged messages."""
        self._count = 0

    def mute(self, messages: Collection[str]) -> None:
        """Stop sending these messages until they are unmuted."""
        self._muted.update(messages)

    def unmute(self, messages: Collection[str]) -> None:
        """Send these messages again."""
        self._muted.difference_update(messages)

    @property
    def withholds_updates(self) -> bool:
        """Whether updates are withheld because a keep-alive message is missing."""
        return self._limit is not None and self._count >= self._limit

    def send(self, message: FramedMessage, cause: Frame) -> None:
        """Send a message that a frame caused, from the destination of that frame to its source."""
        name = message.layout.message
        facts = self._facts.get(name)
        if facts is None or name in self._muted:
            return
        if facts.counts and not self._was_asked_for(name, cause):
            if self.withholds_updates:
                return
            self._count += 1
        self._say(message, cause.source, cause.dest)

    def respond(self, dest: int, source: int) -> None:
        """Send HW_RESPONSE, which reports an error, unless it is muted."""
        if "HW_RESPONSE" in self._facts and "HW_RESPONSE" not in self._muted:
            self._say(m.HwResponse(), dest, source)

    def _say(self, message: FramedMessage, dest: int, source: int) -> None:
        if not self._quirks:
            self._transmit(message.pack(dest, source))
            return
        frame = Frame(message, dest, source)
        for quirk in self._quirks:
            frame = quirk(frame, self._unit)
        self._transmit(frame.encode())

    def _was_asked_for(self, name: str, cause: Frame) -> bool:
        asking = self._facts.get(cause.message.layout.message)
        return asking is not None and name in asking.answered_by
