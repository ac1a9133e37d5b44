"""Identification of the controller on a link that nobody else uses, before there is a session.

Only questions are asked whose answers change nothing.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from stagewire._codec.events import Event
from stagewire._devices.candidates import clean_model
from stagewire._framings.header.frame import Received
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.header.table import End

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, TypeGuard

    from stagewire._codec.protocol import Protocol
    from stagewire._framings.header.message import FramedMessage
    from stagewire._links.link import Link


INFO = ("HW_REQ_INFO", "HW_GET_INFO")
BAY_USED = ("RACK_REQ_BAYUSED", "RACK_GET_BAYUSED")
_BAY_TIMEOUT = 0.3  # seconds; a motherboard that answers one bay answers all of them at once
_OCCUPIED = 1


@dataclass(slots=True)
class Answers:
    """What came while an answer was awaited.

    :param reply: the answer; None where none came.
    :param frames: how many frames came, the answer among them.
    :param data: all bytes that came.
    """

    reply: Any = None
    frames: int = 0
    data: bytearray = field(default_factory=bytearray)

    @property
    def is_garbage(self) -> bool:
        """Whether bytes came, and no frame in them: another baud rate, or another protocol."""
        return bool(self.data) and not self.frames


@dataclass(frozen=True, slots=True)
class Identity:
    """What a controller says of itself.

    :param address: the address that answered.
    :param serial_number: as its digits.
    :param model: its model number, as it says.
    :param firmware: its version, such as ``2.0.4``.
    """

    address: int
    serial_number: str
    model: str
    firmware: str


def ask(
    link: Link,
    protocol: FramedProtocol,
    names: tuple[str, str],
    dest: int,
    timeout: float,
    **fields: int,
) -> Answers:
    """Send one request and wait for its reply; what else comes is counted.

    :param names: the messages that ask and answer.
    :param dest: the address that is asked.
    :param timeout: how long to wait at most, in seconds.
    :param fields: of the request; a field that the reply has, too, must be the same there.

    Raises :class:`~stagewire.errors.TransportLostError` when the line is gone.
    """
    request, reply = (protocol.message_class(name) for name in names)
    link.write(request(**fields).pack(dest=dest, source=protocol.host))
    framer = protocol.framer(End.HOST)
    heard = Answers()
    clock = link.clock or time.monotonic
    end = clock() + timeout
    while heard.reply is None and (left := end - clock()) > 0:
        came = link.read(left)
        heard.data += came
        for event in framer.feed(came):
            message = _message(event)
            heard.frames += message is not None
            if isinstance(message, reply) and all(
                getattr(message, name, value) == value for name, value in fields.items()
            ):
                heard.reply = message
    return heard


def can_identify(protocol: Protocol) -> TypeGuard[FramedProtocol]:
    """Whether a protocol has the question who is there, and addresses to ask."""
    if not isinstance(protocol, FramedProtocol) or "addresses" not in protocol.registry():
        return False
    names = {cls.layout.message for cls in protocol.messages}
    return names.issuperset(INFO)


def identify(
    link: Link, protocol: FramedProtocol, addresses: tuple[int, ...], timeout: float
) -> tuple[Identity | None, Answers]:
    """Ask the addresses one after the other who is there; the first that answers is taken.

    Returns what it said, and all that came. Raises as :func:`ask` does.
    """
    everything = Answers()
    for address in addresses:
        heard = ask(link, protocol, INFO, address, timeout)
        everything.frames += heard.frames
        everything.data += heard.data
        if heard.reply is not None:
            everything.reply = heard.reply
            return _identity(heard.reply, address), everything
    return None, everything


def used_bays(
    link: Link, protocol: FramedProtocol, motherboard: int, count: int
) -> tuple[int, ...] | None:
    """Ask the motherboard of a rack which bays hold a module.

    Returns their numbers, the first bay being 1; or None where it does not say. Raises as :func:`ask` does.
    """
    used = []
    for ident in range(count):
        reply = ask(link, protocol, BAY_USED, motherboard, _BAY_TIMEOUT, bay_ident=ident).reply
        if reply is None:
            return None
        if reply.bay_state == _OCCUPIED:
            used.append(ident + 1)
    return tuple(used)


def _message(event: Event) -> FramedMessage | None:
    return event.frame.message if isinstance(event, Received) else None


def _identity(info: Any, address: int) -> Identity:
    minor, interim, major, *_ = info.software_version
    return Identity(
        address=address,
        serial_number=str(info.serial_number),
        model=clean_model(info.model_number),
        firmware=f"{major}.{interim}.{minor}",
    )
