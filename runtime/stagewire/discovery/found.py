"""What was found on a port."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire.discovery.asking import Identity
from stagewire.discovery.known import Known
from stagewire.discovery.ports import Port

__all__ = ["Found"]


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
