"""An axis as a check has it, and the clean request that follows whatever is wrong.

Whatever is read of an axis is exactly the reply, or a finding. The clean request has to be answered as if
nothing had been.
"""

from __future__ import annotations

from typing import Final

from stagewire.protocols import Command, Reply
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.lines.command_line import QUIET, CommandLine
from stagewire_conformance.device.targets import Target
from stagewire_conformance.device.trial import Trial
from stagewire_ms2000 import messages as m
from stagewire_ms2000.enumerations import Busy
from stagewire_ms2000.flags import StatusBits

DITHER: Final = 5
"""Counts, half a micrometre, by which a servo at rest may wander; the document does not say."""


def line_of(trial: Trial) -> CommandLine:
    """Return the line of a trial, which is one of commands."""
    line = trial.line
    assert isinstance(line, CommandLine)
    return line


class Axis:
    """One axis of the controller.

    :param trial: gets the findings.
    :param place: the axis.
    """

    def __init__(self, trial: Trial, place: Target) -> None:
        self.trial = trial
        self.line = line_of(trial)
        self.place = place
        self.address = place.address
        self.name = place.name

    def ask(
        self,
        request: Command,
        *,
        quiet: float = QUIET,
        sized: bool | None = None,
        extra: bytes = b"",
        after: str = "",
    ) -> Reply:
        """Ask, and return the reply; anything but exactly its bytes is a FAIL, and the end of the check.

        :param quiet: seconds without a byte behind the reply that are waited for.
        :param after: what went before, for the text of the finding.
        """
        came = self.line.ask(request, self.address, sized=sized, extra=extra, quiet=quiet)
        self.nothing_unasked()
        return self.exact(request, came, after)

    def exact(self, request: Command, came: bytes, after: str = "") -> Reply:
        """Return the reply that bytes are; anything else is a FAIL, and the end of the check."""
        kind = request.reply
        assert kind is not None  # what is asked has an answer
        due = kind.layout.length
        behind = f"{after}, " if after else ""
        self.trial.need(
            len(came) == due,
            f"{behind}{request.layout.message} of axis {self.name} was answered by {_bytes(len(came))}; "
            f"the reply is {_bytes(due)}, and nothing else",
            came=came,
        )
        return kind.unpack(came)

    def nothing_unasked(self) -> None:
        """Note bytes that came while nothing was asked, such as those behind a reply that was read before."""
        came, self.line.unasked = self.line.unasked, b""
        self.trial.must(not came, f"{_bytes(len(came))} came that nobody asked for", came=came)

    def tell(self, command: Command, *, sized: bool | None = None, quiet: float = QUIET) -> None:
        """Send a command that has no reply, and see that none comes."""
        self.line.send(command, self.address, sized=sized)
        self.silent(command, quiet)

    def silent(self, command: Command, seconds: float = QUIET) -> None:
        """See that a command that was sent is not answered."""
        came = self.line.listen(seconds) if seconds else b""
        self.trial.must(
            not came,
            f"{command.layout.message} of axis {self.name} has no reply; {_bytes(len(came))} came",
            wanted=b"",
            came=came,
        )

    # What it reads; quick, so that a move can be followed

    def number(self, request: Command, *, quiet: float = 0.0) -> int:
        """Return the number that a request reads, the only field of its reply."""
        reply = self.ask(request, quiet=quiet)
        [field] = reply.layout.fields
        return int(getattr(reply, field))

    @property
    def position(self) -> int:
        """Where it is, in counts of 0.1 µm."""
        return self.number(m.ReadMotorPosition())

    @property
    def target(self) -> int:
        """Where it goes to, or has gone to."""
        return self.number(m.ReadTargetPosition())

    @property
    def speed(self) -> int:
        """Of the trajectory at this instant, in µm/s, with its sign."""
        return self.number(m.ReadCurrentSpeed())

    @property
    def status(self) -> StatusBits:
        """The status byte."""
        return StatusBits(self.number(m.ReadStatusByte()))

    @property
    def is_busy(self) -> bool:
        """What it answers to READ_STATUS; another letter than the two is a FAIL, and the end of the check."""
        letter = self.number(m.ReadStatus())
        self.trial.need(
            letter in (Busy.BUSY, Busy.NOT_BUSY),
            f"READ_STATUS of axis {self.name} was answered by {letter:#04x}; it is B (0x42) or b (0x62)",
            came=bytes((letter,)),
        )
        return letter == Busy.BUSY


def _bytes(count: int) -> str:
    return f"{count} byte{'' if count == 1 else 's'}" if count else "nothing"


_REQUESTS: Final[tuple[Command, ...]] = (
    m.ReadMaximumSpeed(), m.ReadRampTime(), m.ReadIncrementValue(), m.ReadIdentification(), m.ReadStatus(),
)  # fmt: skip
"""What a clean request may be, the first that a controller claims: it answers the same at any time."""


class Clean:
    """A request and the answer that it has to have, asked for at the beginning of a check."""

    def __init__(self, trial: Trial) -> None:
        self._axis = Axis(trial, asked(trial.declared)[0])
        self._request = asked(trial.declared)[1]
        self._answer = self._axis.ask(self._request)

    def again(self, after: str) -> None:
        """Ask again; see that the answer is exactly the same.

        :param after: what went before, for the text of the finding.
        """
        reply = self._axis.ask(self._request, after=after)
        self._axis.trial.must(
            reply == self._answer,
            f"{after}, {self._request.layout.message} was answered by other bytes than before",
            wanted=self._answer.pack(),
            came=reply.pack(),
        )


def asked(declared: Declaration) -> tuple[Target, Command]:
    """Return the axis and the request of clean requests; their first if nothing of them is claimed."""
    for request in _REQUESTS:
        for place in declared.places:
            if request.layout.message in place.messages:
                return place, request
    return declared.places[0], _REQUESTS[0]
