"""An axis during a check, and the clean request that follows invalid data.

A reply with any other bytes than expected is a finding. The clean request must be answered as if nothing had
happened.
"""

from __future__ import annotations

from typing import Final

from stagewire.protocols import Command, Reply
from stagewire_conformance.device.causes import DELIVERY, UNSOLICITED, Cause
from stagewire_conformance.device.checks.ms2000.broken_rules import rule_of_reply, rule_of_silence
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.lines.command_line import QUIET, CommandLine
from stagewire_conformance.device.targets import Target
from stagewire_conformance.device.trial import Trial
from stagewire_ms2000 import messages as m
from stagewire_ms2000.enumerations import Busy
from stagewire_ms2000.flags import StatusBits

DITHER: Final = 5
"""Counts (0.5 µm) by which a servo at rest may wander; the document does not say."""


def line_of(trial: Trial) -> CommandLine:
    """Return the line of a trial, which is a command line."""
    line = trial.line
    assert isinstance(line, CommandLine)
    return line


class Axis:
    """One axis of the controller.

    :param trial: the trial that gets the findings.
    :param place: the target of the axis.
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
        rule: str = "",
    ) -> Reply:
        """Send a request, and return the reply. Any other bytes are a FAIL and end the check.

        :param quiet: seconds without a byte to wait for after the reply.
        :param after: the preceding event, for the text of the finding.
        :param rule: the rule that the controller breaks if no reply comes after this event.
        """
        came = self.line.ask(request, self.address, sized=sized, extra=extra, quiet=quiet)
        self.nothing_unasked()
        return self.exact(request, came, after, rule)

    def exact(self, request: Command, came: bytes, after: str = "", rule: str = "") -> Reply:
        """Return the reply that the bytes contain. Any other bytes are a FAIL and end the check."""
        kind = request.reply
        assert kind is not None  # every request has a reply
        due = kind.layout.length
        behind = f"{after}, " if after else ""
        cause = _cause_of(request, came, due)
        if len(came) > due and not after:  # bursts leave this request out
            known = self.trial.causes.check_of(cause) or self.trial.check
            self.trial.causes.report(Cause(request.layout.message, DELIVERY), known)
        if after.startswith("sent "):
            cause = self.trial.likely(Cause(after, DELIVERY), cause)
        elif rule and not came:
            cause = self.trial.likely(recovery(self.trial.check), cause, recovery("silence"))
        self.trial.need(
            len(came) == due,
            f"{behind}the reply to {request.layout.message} of axis {self.name} has "
            f"{_bytes(len(came))}; it should have exactly {_bytes(due)}",
            came=came,
            rule=rule_of_reply(request, came, due) if came else rule or rule_of_reply(request),
            cause=cause,
        )
        return kind.unpack(came)

    def nothing_unasked(self) -> None:
        """Report bytes that came without a request, such as bytes after a reply that was read before."""
        came, self.line.unasked = self.line.unasked, b""
        command, self.line.silent = self.line.silent, ""
        if command:
            self._unanswered(command, came)
            return
        self.trial.must(
            not came,
            f"{_bytes(len(came))} arrived without a request",
            came=came,
            rule="no-blanks-in-replies",
            cause=Cause("the line", UNSOLICITED),
        )

    def tell(self, command: Command, *, sized: bool | None = None, quiet: float = QUIET) -> None:
        """Send a command that has no reply, and check that none comes."""
        self.line.send(command, self.address, sized=sized)
        self.silent(command, quiet)

    def silent(self, command: Command, seconds: float = QUIET) -> None:
        """Check that a command that was sent is not answered."""
        self._unanswered(command.layout.message, self.line.listen(seconds) if seconds else b"")

    def _unanswered(self, command: str, came: bytes) -> None:
        self.trial.must(
            not came,
            f"{command} of axis {self.name} was answered with {_bytes(len(came))}; it should get no reply",
            wanted=b"",
            came=came,
            rule=rule_of_silence(command),
            cause=Cause(command, UNSOLICITED),
        )

    # Values of the axis, read quickly enough to follow a move

    def number(self, request: Command, *, quiet: float = 0.0) -> int:
        """Return the number in the reply to a request; it is the only field."""
        reply = self.ask(request, quiet=quiet)
        [field] = reply.layout.fields
        return int(getattr(reply, field))

    @property
    def position(self) -> int:
        """The position in counts of 0.1 µm."""
        return self.number(m.ReadMotorPosition())

    @property
    def target(self) -> int:
        """The current or last target."""
        return self.number(m.ReadTargetPosition())

    @property
    def speed(self) -> int:
        """The current speed of the trajectory in µm/s, signed."""
        return self.number(m.ReadCurrentSpeed())

    @property
    def status(self) -> StatusBits:
        """The status byte."""
        return StatusBits(self.number(m.ReadStatusByte()))

    @property
    def is_busy(self) -> bool:
        """Whether READ_STATUS returns B. Any letter but B and b is a FAIL and ends the check."""
        letter = self.number(m.ReadStatus())
        self.trial.need(
            letter in (Busy.BUSY, Busy.NOT_BUSY),
            f"READ_STATUS of axis {self.name} was answered with {letter:#04x}; it should be "
            "B (0x42) or b (0x62)",
            came=bytes((letter,)),
            rule="status-answered",
            cause=Cause("READ_STATUS", "letter"),
        )
        return letter == Busy.BUSY


def _cause_of(request: Command, came: bytes, due: int) -> Cause:
    """Return the cause of a reply with a wrong length. Surplus bytes may follow every reply."""
    surplus = came[due:]
    if surplus:
        return Cause("every reply", f"followed by {surplus.hex(' ')}")
    return Cause(request.layout.message, DELIVERY)


def _bytes(count: int) -> str:
    return f"{count} byte{'' if count == 1 else 's'}" if count else "no bytes"


_REQUESTS: Final[tuple[Command, ...]] = (
    m.ReadMaximumSpeed(), m.ReadRampTime(), m.ReadIncrementValue(), m.ReadIdentification(), m.ReadStatus(),
)  # fmt: skip
"""Candidates for the clean request; the first claimed one is used. Their replies do not change."""


def recovery(check: str) -> Cause:
    """Return the defect that a controller does not recover from what the checks of a kind send."""
    return Cause(check.partition("/")[0], "recovery")


class Clean:
    """A request, and the reply to it at the beginning of a check."""

    def __init__(self, trial: Trial) -> None:
        self._axis = Axis(trial, asked(trial.declared)[0])
        self._request = asked(trial.declared)[1]
        self._answer = self._axis.ask(self._request)

    def again(self, after: str) -> None:
        """Repeat the request, and check that the reply is the same.

        :param after: the preceding event, for the text of the finding.
        """
        reply = self._axis.ask(self._request, after=after, rule="errors-ignored")
        self._axis.trial.must(
            reply == self._answer,
            f"{after}, {self._request.layout.message} was answered with other bytes than before",
            wanted=self._answer.pack(),
            came=reply.pack(),
            rule="errors-ignored",
            cause=recovery(self._axis.trial.check),
        )


def asked(declared: Declaration) -> tuple[Target, Command]:
    """Return the axis and the request for clean requests; the first of each if none is claimed."""
    for request in _REQUESTS:
        for place in declared.places:
            if request.layout.message in place.messages:
                return place, request
    return declared.places[0], _REQUESTS[0]
