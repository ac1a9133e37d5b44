"""The way from a controller to the host: what is withheld, and in which form the rest goes out.

With the types of whatever takes the messages that come to an address, and answers them.
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
"""Takes one message of a controller's table."""


class Responder(Protocol):
    """What a handler needs of the controller that it answers for."""

    def send(self, message: FramedMessage, cause: Frame) -> None:
        """Say something that a frame of the host caused."""

    def refuse(self, cause: Frame, why: str) -> None:
        """Do nothing of what a frame of the host wants."""


class Panel(Protocol):
    """A part of an instrument without channels, which answers at each address that it is built into."""

    def handlers(self, controller: Responder) -> Mapping[str, Handler]:
        """Return what takes each of its messages, answering as ``controller``."""


UNACKNOWLEDGED: Final = 50
"""Status messages that are sent without a keep-alive from the host; then no more (pages 80 and 105)."""


class Transmitter:
    """Where everything passes that one controller says.

    Messages that the unit does not have are not sent. What the host muted is not sent. Of what comes
    unsolicited, as updates and completions do, :data:`UNACKNOWLEDGED` are sent after the last keep-alive,
    by a controller that wants any; what was withheld is not made up for. A status message that the host
    asked for is always sent and does not count: pages 80 and 105 do not say so, but drivers that poll a
    real TDC001 without ever acknowledging are answered.

    :param unit: what the registry says of it.
    :param wants_keep_alive: whether it falls silent without them.
    :param quirks: names of quirks; those of :data:`~stagewire_virtual.thorlabs_apt.quirks.FRAME_QUIRKS`
        change what is sent.
    :param transmit: takes the bytes of a frame.
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
        self._limit = UNACKNOWLEDGED if wants_keep_alive else None
        self._quirks = [quirk for name, quirk in FRAME_QUIRKS.items() if name in quirks]
        self._transmit = transmit
        self.reset()

    def reset(self) -> None:
        """Be as after power-on: nothing is muted, nothing has been counted."""
        self._muted: set[str] = set()
        self._count = 0

    def keep_alive(self) -> None:
        """Count from zero again."""
        self._count = 0

    def mute(self, messages: Collection[str]) -> None:
        """Do not send these until they are unmuted."""
        self._muted.update(messages)

    def unmute(self, messages: Collection[str]) -> None:
        """Send these again."""
        self._muted.difference_update(messages)

    @property
    def withholds_updates(self) -> bool:
        """Whether updates would not be sent now, because the host sent no keep-alive."""
        return self._limit is not None and self._count >= self._limit

    def send(self, message: FramedMessage, cause: Frame) -> None:
        """Send what a frame of the host caused, from the address that was spoken to, to who spoke."""
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
        """Send HW_RESPONSE, which says that something is wrong, unless it is muted."""
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
