"""``stagewire.discover``: the serial ports, and which of them are controllers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from stagewire._codec.protocol import load_protocol
from stagewire._discovery.identification import Identity, can_identify, identify, used_bays
from stagewire._discovery.ports import Port, serial_ports
from stagewire._discovery.products import Known, by_identity, by_serial_number
from stagewire.errors import StagewireError, TransportError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from stagewire._framings.header.protocol import FramedProtocol
    from stagewire._links.link import Link


@dataclass(frozen=True, slots=True)
class Found:
    """A serial port and what is known of the controller behind it.

    :param port: the port.
    :param known: what it may be, by its USB plug and its serial number, and by what it said; one thing where
        that is certain, nothing for a port that nobody knows.
    :param identity: what it said of itself; None where it was not asked, or did not answer.
    :param bays: the bays that hold a module, the first being 1; None where that is not known.
    :param problem: why it could not be asked, or what came instead of an answer; empty where all is well.
    """

    port: Port
    known: tuple[Known, ...] = ()
    identity: Identity | None = None
    bays: tuple[int, ...] | None = None
    problem: str = ""

    @property
    def url(self) -> str:
        """What opens it."""
        return self.port.device

    @property
    def unit(self) -> str | None:
        """The name of the unit, where it is certain; it may be newer than the document."""
        return self.known[0].name if len(self.known) == 1 else None

    @property
    def serial_number(self) -> str:
        """The serial number: what the controller said, or else that of its USB plug; may be empty."""
        return self.identity.serial_number if self.identity else self.port.serial_number

    @property
    def is_controller(self) -> bool:
        """Whether this is the plug of a controller, or a controller that answered."""
        return self.port.plug is not None or self.identity is not None

    def __str__(self) -> str:
        return f"{self.url}: {self.what}"

    @property
    def what(self) -> str:
        """One sentence for people: which controller this is."""
        if len(self.known) == 1:
            return str(self.known[0])
        if self.known:
            names = " or ".join(known.name for known in self.known)
            which = (
                "asking tells which"
                if self.identity is None
                else "the reported model does not tell which"
            )
            return f"{names}: they share the prefix of their serial numbers; {which}"
        if self.identity is not None:
            model, number = self.identity.model or "no model number", self.identity.serial_number
            return f"{model}: no unit is known that reports this with the serial number {number}"
        if self.port.plug is not None:
            number = self.port.serial_number or "none"
            speaks = self.port.plug.protocol
            return f"a controller of {speaks}; no registry knows its serial number ({number})"
        return "unknown: perhaps a controller on RS-232, such as an MS-2000, perhaps something else"


NO_FRAME = "bytes that are no frame"
ASK_TIMEOUT = 1.0
"""Seconds that a controller has for its answer."""


def discover(ask: bool = False, timeout: float = ASK_TIMEOUT) -> list[Found]:
    """Return every serial port with what is known of the controller behind it; controllers come first.

    Without ``ask`` no port is opened: what is known comes from the operating system, which reads ids and
    serial number from the USB plug. A controller on RS-232 has none, and its port is listed as unknown.

    :param ask: open the ports that are controllers by their USB plug, one after the other, and ask for
        identity (HW_REQ_INFO) and bays (RACK_REQ_BAYUSED). Nothing moves. Other ports are never opened:
        bytes that they do not expect may do anything.
    :param timeout: how long each may take for its answer, in seconds.
    """
    found = [look_at(port) for port in serial_ports()]
    if ask:
        found = [identified(one, timeout) for one in found]
    return sorted(found, key=lambda one: not one.is_controller)


def look_at(port: Port) -> Found:
    """Return what a port is by its USB plug and its serial number alone."""
    plug = port.plug
    if plug is None:
        return Found(port)
    try:
        protocol = load_protocol(plug.protocol)
    except StagewireError:  # not installed: then nothing is known of its units
        return Found(port)
    return Found(port, tuple(by_serial_number(protocol, port.serial_number)))


def identified(found: Found, timeout: float = ASK_TIMEOUT) -> Found:
    """Open the port of what was found by its plug, ask it, and return what is known now.

    What is no controller by its plug is returned as it is.
    """
    from stagewire._links.opening import open_link

    plug = found.port.plug
    if plug is None:
        return found
    protocol = load_protocol(plug.protocol)
    if not can_identify(protocol):
        return found
    try:
        link = open_link(found.url)
    except TransportError as error:
        return replace(found, problem=str(error))
    try:
        return recognise(found, link, protocol, timeout)
    except TransportError as error:
        return replace(found, problem=str(error))
    finally:
        link.close()


def recognise(found: Found, link: Link, protocol: FramedProtocol, timeout: float) -> Found:
    """Ask on an open line who is there, and return what is known then.

    Raises :class:`~stagewire.errors.TransportLostError` when the line is gone.
    """
    addresses = addresses_of(protocol, found.known)
    identity, heard = identify(link, protocol, addresses, timeout)
    if identity is None:
        came = f"{len(heard.data)} {NO_FRAME}" if heard.is_garbage else "nothing"
        at = " and ".join(f"{address:#04x}" for address in addresses)
        return replace(found, problem=f"asked for its identity at {at}, it said {came}")
    known = by_identity(protocol, int(identity.serial_number), identity.model)
    motherboard = _address(protocol, "motherboard")
    bays = None
    if identity.address == motherboard:
        bays = used_bays(link, protocol, motherboard, _bays(protocol, known))
    return replace(found, known=tuple(known), identity=identity, bays=bays, problem="")


def addresses_of(protocol: FramedProtocol, known: Sequence[Known] = ()) -> tuple[int, ...]:
    """Return the addresses at which a controller is asked who it is, in this order.

    Where its unit is known, its own address alone: some units do not bear a wrong guess. Otherwise the one
    of a unit with a USB plug of its own comes first, and a rack is asked only where that one is silent.
    """
    own, rack = _address(protocol, "generic_usb"), _address(protocol, "motherboard")
    kinds = {known_one.facts["address"] for known_one in known if known_one.facts}
    if kinds and "generic_usb" not in kinds:
        return (rack,)
    return (own,) if kinds else (own, rack)


def _address(protocol: FramedProtocol, name: str) -> int:
    address: int = protocol.registry()["addresses"][name]["value"]
    return address


def _bays(protocol: FramedProtocol, known: Sequence[Known]) -> int:
    """Return how many bays are asked for: those of the unit, or all that the protocol has addresses for."""
    most: int = protocol.registry()["addresses"]["bays"]["count"]
    return max((facts.get("bays", most) for one in known if (facts := one.facts)), default=most)
