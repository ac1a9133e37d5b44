"""A host in tests for a laser or a temperature controller."""

from typing import Any

from actuator_host import ActuatorHost

from stagewire_apt import messages as m
from stagewire_virtual.thorlabs_apt.laser.laser import FULL_SCALE

SOURCES = ("KLS101", "KLS635", "KLS1550", "TLS001")
DRIVERS = ("KLD101", "TLD001")
LASERS = (*SOURCES, *DRIVERS)

SETTLED = 100
"""Milliseconds after which the current of a laser has settled: ten time constants."""


class LightHost(ActuatorHost):
    """A host with short forms for what lasers and temperature controllers are asked."""

    def after(self, milliseconds: float) -> None:
        """Let time pass."""
        self.clock.advance(milliseconds / 1000)

    def status(self) -> Any:
        """Ask for the status message and return it."""
        for request in (m.LaReqStatusUpdate, m.LdReqStatusUpdate, m.TecReqStatusUpdate):
            if self.behaviour.channel.answers(request.layout.message):
                return self.ask(request())
        raise AssertionError("the unit has no status message")

    def bits(self) -> set[str]:
        """Return the names of the status bits that are set, by the table of the unit."""
        names = self.behaviour._bits._masks
        return {name for name, mask in names.items() if self.status().status_bits & mask}

    def demand(self, share: float) -> None:
        """Set the set point of a laser to a share of full scale."""
        self.tell(m.LaSetPowerSetpoint(set_point=round(share * FULL_SCALE)))

    def switch_on(self, share: float | None = None) -> None:
        """Switch a laser on, and wait until its current has settled."""
        if share is not None:
            self.demand(share)
        self.tell(m.LaEnableOutput())
        self.after(SETTLED)
