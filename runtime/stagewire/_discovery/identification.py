"""Identify the controller on a link, before there is a session.

The link must not be in use. Only requests are sent, which change nothing.
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
_BAY_TIMEOUT = 0.3  # seconds; a motherboard that answers for one bay answers for all, without delay
_OCCUPIED = 1


@dataclass(slots=True)
class Answers:
    """Data received while waiting for a reply.

    :param reply: reply; None if there was none.
    :param frames: number of frames received, including the reply.
    :param data: all bytes received.
    """

    reply: Any = None
    frames: int = 0
    data: bytearray = field(default_factory=bytearray)

    @property
    def is_garbage(self) -> bool:
        """Whether bytes were received, but no frame: the baud rate or the protocol is wrong."""
        return bool(self.data) and not self.frames


@dataclass(frozen=True, slots=True)
class Identity:
    """The identity that a controller reported.

    :param address: address that answered.
    :param serial_number: serial number as digits.
    :param model: model number.
    :param firmware: version of the firmware, such as ``2.0.4``.
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
    """Send one request and wait for its reply; count other frames.

    :param names: names of the request and of its reply.
    :param dest: destination address.
    :param timeout: timeout in seconds.
    :param fields: fields of the request; if the reply has a field of the same name, its value must be equal.

    Raise :class:`~stagewire.errors.TransportLostError` if the line is lost.
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
    """Return whether a protocol has an identity request, and addresses to send it to."""
    if not isinstance(protocol, FramedProtocol) or "addresses" not in protocol.registry():
        return False
    names = {cls.layout.message for cls in protocol.messages}
    return names.issuperset(INFO)


def identify(
    link: Link, protocol: FramedProtocol, addresses: tuple[int, ...], timeout: float
) -> tuple[Identity | None, Answers]:
    """Request the identity at each address in turn, until one answers.

    Return this identity, and everything that was received. Raise the errors of :func:`ask`.
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

    Return their numbers, counted from 1, or None if it does not answer. Raise the errors of :func:`ask`.
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
