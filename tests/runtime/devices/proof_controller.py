"""Controllers under the control of a test: they receive frames, and answer queries with random values."""

from __future__ import annotations

import random
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from typing import Any

from proof_calls import fields_at_random
from proof_line import FarEnd

from stagewire import End, Frame
from stagewire._devices.tables import ParameterSet, Query
from stagewire.framing import Received
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m

HOST = 0x01
STATUS = (m.MotGetDcStatusUpdate, m.MotGetStatusUpdate)
ALLOWING = {m.LaGetStatusBits: ("status_bits", 0x0A)}
"""Status -> its field, and the bits that are always set: the key switch is on, and the interlock closed."""
Said = Iterable[tuple[float, bytes | None]]


@cache
def answers_of(package: str = "stagewire_apt") -> dict[type, type]:
    """Return the class of each request -> the first class of its reply."""
    found: dict[type, type] = {}
    for table in vars(import_module(f"{package}.devices.tables")).values():
        if not isinstance(table, (ParameterSet, Query)):
            continue
        req = getattr(table, "req", None)
        gets = getattr(table, "gets", None) or (getattr(table, "get", None),)
        if req is not None and gets[0] is not None:
            found[req] = gets[0]
    return found


def channel_of(message: Any) -> int:
    return int(getattr(message, "chan_ident", 0))


class Controller(FarEnd):
    """A controller that records frames and answers none; subclasses define answers.

    :ivar heard: every frame except keep-alive messages.
    """

    def __init__(self) -> None:
        self.heard: list[Frame] = []
        self.kept_alive: list[bytes] = []
        self._framer = PROTOCOL.framer(End.DEVICE)

    def take(self, data: bytes) -> Said:
        said: list[tuple[float, bytes | None]] = []
        for event in self._framer.feed(data):
            said += self.hear(event)
        return said

    def hear(self, event: Any) -> Said:
        """Handle one event of the line."""
        assert isinstance(event, Received), f"the host sent an invalid frame: {event!r}"
        frame = event.frame
        if "_ACK_" in frame.message.layout.message:
            self.kept_alive.append(event.raw)
            return ()
        self.heard.append(frame)
        return self.answer(frame)

    def answer(self, frame: Frame) -> Said:
        """Return the answers to a frame, each with its delay in seconds."""
        return ()

    @property
    def raw(self) -> bytes:
        """The bytes of the recorded frames."""
        return b"".join(frame.encode() for frame in self.heard)

    def names(self) -> list[str]:
        """Return the names of the recorded messages, and forget them."""
        names = [frame.message.layout.message for frame in self.heard]
        self.heard.clear()
        return names


class Parrot(Controller):
    """A controller that answers each query with random values, which stay the same until :meth:`renew`.

    The position in a status is the target of the last absolute move, so every move reaches its target.
    """

    def __init__(self, seed: int) -> None:
        super().__init__()
        self._draw = random.Random(seed)
        self._state: dict[tuple[Any, ...], Any] = {}

    def renew(self) -> None:
        """Replace all values by new random ones."""
        self._state.clear()

    def state(self, cls: type, dest: int, channel: int, **asked: int) -> Any:
        """Return the current message of class ``cls``, which stays the same until it is renewed.

        ``asked`` are the fields of a request that its answer repeats.
        """
        key = (dest, cls, channel, *asked.values())
        if key not in self._state:
            fixed = {"chan_ident": channel, **asked}
            values = fields_at_random(cls, self._draw, **fixed)
            if cls in ALLOWING:
                field, bits = ALLOWING[cls]
                values[field] |= bits
            self._state[key] = cls(**values)
        state = self._state[key]
        if cls in STATUS and (target := self._target(dest, channel)) is not None:
            return state.replace(position=target)
        return state

    def _target(self, dest: int, channel: int) -> int | None:
        """Return the target of the last absolute move there."""
        for frame in reversed(self.heard):
            if not isinstance(frame.message, m.MotMoveAbsolute):
                continue
            if (frame.dest, channel_of(frame.message)) == (dest, channel):
                return frame.message.absolute_distance
        return None

    def reply(self, frame: Frame) -> Frame | None:
        """Return the reply to a query; None for other messages."""
        cls = answers_of().get(type(frame.message))
        if cls is None:
            return None
        values = frame.message.values()
        asked = {name: values[name] for name in cls.layout.fields if name in values}
        asked.pop("chan_ident", None)
        message = self.state(cls, frame.dest, channel_of(frame.message), **asked)
        return Frame(message, dest=HOST, source=frame.dest)

    def answer(self, frame: Frame) -> Said:
        reply = self.reply(frame)
        return () if reply is None else [(0.001, reply.encode())]
