"""The trial of a check: its line, declaration, permissions and findings, and the restoration after it.

At the end of a check its changes are undone, the last one first, however the check ended.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from stagewire.errors import StagewireError, TransportLostError
from stagewire_conformance.device.causes import (
    DELIVERY,
    ENDED,
    NOW_AND_THEN,
    Cause,
    Causes,
    silence,
)
from stagewire_conformance.device.results import Finding, Result, worst

if TYPE_CHECKING:
    from stagewire.protocols import FramedMessage
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions


class Details(TypedDict, total=False):
    """Details of a finding.

    :param rule: the rule that is broken; by default the rule of the check, if it has only one.
    :param cause: the defect, if other checks can also meet it. A run reports it once. Several causes are
        known only if all of them are.
    :param because: other defects that explain the problem. If one has been reported, the problem is only a
        note: its evidence is unreliable. A NON-STRICT departure does not explain a FAIL.
    :param wanted: the expected bytes, if known.
    :param came: the received bytes that the problem is about, if any.
    """

    rule: str
    cause: Cause | Sequence[Cause] | None
    because: Sequence[Cause]
    wanted: bytes | None
    came: bytes | None


class EnoughError(Exception):
    """Ends a check early and keeps its findings. Never leaves a run."""


class NotRunError(EnoughError):
    """Ends a check that cannot be carried out in this run. Without findings, it counts as not run.

    Its text is the reason.
    """


@dataclass(frozen=True)
class Undo:
    """A change that must be undone.

    :param what: a phrase such as ``velocity parameters of channel 1``.
    :param action: undoes the change.
    :param moves: whether the action moves something. If so, it is omitted after an interruption.
    :param rule: the rule that is broken if the change cannot be undone.
    :param because: returns the defects that explain why it cannot be undone.
    """

    what: str
    action: Callable[[], object]
    moves: bool = False
    rule: str = ""
    because: Callable[[], Sequence[Cause]] = tuple


@dataclass
class Trial:
    """One run of one check.

    :param line: an :class:`.AptLine` or a :class:`.CommandLine`, depending on the protocol.
    :param declared: the declared controller.
    :param allowed: the permissions of the run.
    :param random: seeded by the run and the id of the check, so that a check can be repeated alone.
    :param check: the id of the check.
    :param rules: the rules that the check may find broken.
    :param causes: the root causes that the run has reported so far.
    :param robustness: whether the check is about robustness instead of a rule; see :class:`.Kind`.
    """

    line: Any
    declared: Declaration
    allowed: Permissions
    random: Random
    check: str = ""
    rules: tuple[str, ...] = ()
    causes: Causes = field(default_factory=Causes)
    robustness: bool = False
    findings: list[Finding] = field(default_factory=list)
    figures: dict[str, float] = field(default_factory=dict)
    undos: list[Undo] = field(default_factory=list)
    met: dict[str, str] = field(default_factory=dict)
    """The checks that have reported a defect that this check also met, each with the defect."""
    problems: int = 0
    """How often something did not hold, whether that is a finding or follows from a reported one."""
    _departures: dict[Cause, Finding] = field(default_factory=dict)
    """The NON-STRICT findings of this check. A FAIL with the same cause replaces one."""

    def must(self, holds: bool, problem: str, **details: Unpack[Details]) -> bool:
        """Note a FAIL unless ``holds``; return ``holds``.

        :param problem: a sentence that states what was received and what was expected.
        :param details: see :class:`Details`.
        """
        return holds or self._broken(Result.FAIL, problem, details)

    def should(self, holds: bool, problem: str, **details: Unpack[Details]) -> bool:
        """Note a NON-STRICT unless ``holds``; return ``holds``. See :meth:`must`."""
        return holds or self._broken(Result.NON_STRICT, problem, details)

    def need(self, holds: bool, problem: str, **details: Unpack[Details]) -> None:
        """Note a FAIL and end the check unless ``holds``. See :meth:`must`."""
        if not self.must(holds, problem, **details):
            raise EnoughError

    def _broken(self, result: Result, problem: str, details: Details) -> bool:
        """Note a finding, or refer to the check that has reported its cause; return False."""
        self.problems += 1
        result = Result.FRAGILE if self.robustness else result
        given = details.get("cause") or ()
        causes = (given,) if isinstance(given, Cause) else tuple(given)
        if self._is_explained(result, problem, causes, details.get("because", ())):
            return False
        rule = details.get("rule", "")
        if not rule and len(self.rules) == 1:
            rule = self.rules[0]
        finding = Finding(result, problem, details.get("wanted"), details.get("came"), rule)
        for cause in causes:
            self.causes.report(cause, self.check, result)
            if (lesser := self._departures.pop(cause, None)) in self.findings:
                self.findings.remove(lesser)
            if result is Result.NON_STRICT:
                self._departures[cause] = finding
        self.findings.append(finding)
        return False

    def _is_explained(
        self, result: Result, problem: str, causes: Sequence[Cause], because: Sequence[Cause]
    ) -> bool:
        """Return whether a problem follows from a reported defect, and refer to its check."""
        reason = next((each for each in because if self.causes.is_known(each, result)), None)
        if reason is not None:
            self.info(f"{problem} (follows from a defect that is reported: {reason})")
        elif causes and all(self.causes.is_known(each, result) for each in causes):
            reason = causes[0]
        if reason is None:
            return False
        first = self.causes.check_of(reason)
        if first != self.check:
            if result is not Result.NON_STRICT:
                self.met.setdefault(first, str(reason))
            elif reason not in because:
                self.info(f"{problem} (reported by {first})")
        return True

    def depends_on(self, *causes: Cause) -> None:
        """End the check if one of these defects has been reported, because it could not decide anything."""
        for cause in causes:
            first = self.causes.check_of(cause)
            if first and first != self.check and not self.causes.is_departure(cause):
                self.met.setdefault(first, str(cause))
                raise EnoughError

    def likely(self, cause: Cause, *others: Cause) -> Cause:
        """Return the first of some causes that has been reported; the first of all if none has."""
        reported = (each for each in (cause, *others) if self.causes.check_of(each))
        return next(reported, cause)

    def follows(self, text: str, rule: str) -> None:
        """Note a consequence of a defect: an observation if the check has found the defect, otherwise a FAIL.

        :param rule: the rule that is broken if nothing else is.
        """
        if self.met or any(finding.result is Result.FAIL for finding in self.findings):
            self.info(text)
        else:
            self.must(False, text, rule=rule)

    def info(self, text: str, **figures: float) -> None:
        """Note an observation; the check still passes.

        :param figures: measured values for the report, by name (``p99_ms=3.2``).
        """
        self.findings.append(Finding(Result.PASS, text))
        self.figures |= figures

    def inconclusive(self, text: str, **figures: float) -> None:
        """Note that the check could not decide, such as on a computer that wakes late. The result is INFO."""
        self.findings.append(Finding(Result.INFO, text))
        self.figures |= figures

    def reply(self, request: FramedMessage, dest: int, wait: float = 1.0) -> Incoming:
        """Send a request and return the reply. Without a reply, note a FAIL and end the check."""
        heard: Incoming | None = self.line.ask(request, dest, wait)
        if heard is None:
            if self.line.parts(going=True):
                self.line.halt()  # before the cause is looked for
            names = self.declared.registry.messages[request.layout.message]["exchange"][
                "answered_by"
            ]
            self.need(
                False,
                f"{request.layout.message} to {dest:#04x} was not answered by {' or '.join(names)} "
                f"within {wait:g} s",
                rule="request-answered",
                cause=self.cause_of_silence(request, dest),
            )
        assert heard is not None
        return heard

    def cause_of_silence(self, request: FramedMessage, dest: int) -> Cause:
        """Return the likely cause that a request was not answered: a reported one, if there is one."""
        place = self.declared.place_at(dest)
        known = silence(place.name if place else f"{dest:#04x}")
        names = self.declared.registry.messages[request.layout.message]["exchange"]["answered_by"]
        ended = (Cause(name, ENDED) for name in names)
        for each in (known, *ended):
            if self.causes.check_of(each):
                return each
        cause: Cause = self.line.cause_of_silence(request, dest)
        if cause == NOW_AND_THEN:
            return self.likely(cause, *(Cause(name, DELIVERY) for name in names))
        return cause

    def undo(
        self,
        what: str,
        action: Callable[[], object],
        *,
        moves: bool = False,
        rule: str = "",
        because: Callable[[], Sequence[Cause]] = tuple,
    ) -> None:
        """Register an action that undoes a change. It runs at the end of the check, however the check ends.

        The last registered action runs first.

        :param what: a phrase for the report, such as ``velocity parameters of channel 1``.
        :param action: undoes the change. Its failed :meth:`must` calls count as findings.
        :param moves: whether the action moves something. Such an action does not run after Ctrl-C or an
            error, because nothing may move then.
        :param rule: the rule that is broken if the change cannot be undone.
        :param because: returns the defects that explain why the change cannot be undone.
        """
        self.undos.append(Undo(what, action, moves, rule, because))

    @property
    def result(self) -> Result:
        """The worst result of the findings. A check that met only reported defects was not run."""
        met = [Result.NOT_RUN] if self.met else []
        return worst([*met, *(finding.result for finding in self.findings)])


class Restoration:
    """Undoes the changes of a trial, only at rest. A change that cannot be undone becomes a finding.

    :param trial: of a check that has ended.
    """

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        self._undos = trial.undos
        self.done: list[str] = []
        """The changes that were undone."""
        self._moves = True  # whether actions that move something may run

    def restore(self) -> None:
        """Undo all changes after a check that ended normally.

        If an action fails, stop the motion that it may have started, and omit all further actions that move
        something. Raises the interruption, if there is one; :meth:`restore_at_rest` continues from there.
        """
        while self._undos:
            if self._may_be_done(self._undos[-1]):
                self._put_back(self._undos[-1])
            self._undos.pop()

    def restore_at_rest(self) -> None:
        """Undo, after an error, all changes whose action moves nothing, if everything is at rest.

        Raises nothing. If the line is lost or the run is interrupted again, note the remaining changes as not
        restored.
        """
        self._moves = False
        why = ""
        while self._undos:
            undo = self._undos.pop()
            if why:
                self._left(undo, why)
                continue
            try:
                if self._may_be_done(undo):
                    self._put_back(undo)
            except TransportLostError:
                why = "the line was lost"
                self._left(undo, why)
            except KeyboardInterrupt:
                why = "interrupted"
                self._left(undo, why)
            except Exception as error:  # the other changes must still be undone
                self._left(undo, f"the suite has a defect: {type(error).__name__}: {error}")

    def _may_be_done(self, undo: Undo) -> bool:
        line = self._trial.line
        if undo.moves and (not self._moves or line.disabled):
            self._trial.info(f"left as it is, because nothing may move now: {undo.what}")
            return False
        if not line.come_to_rest():  # a setting could make it faster
            text = f"not restored: {undo.what} (not everything is known to be at rest)"
            if line.adrift:  # which is a finding of its own
                self._trial.info(text)
            else:
                self._trial.follows(text, undo.rule)
            return False
        return True

    def _put_back(self, undo: Undo) -> None:
        before = self._trial.problems
        try:
            undo.action()
        except TransportLostError:
            raise
        except (EnoughError, StagewireError) as error:
            self._trial.line.halt()
            self._trial.line.come_to_rest()
            self._moves = False
            if not isinstance(error, EnoughError):  # it has noted a finding
                self._left(undo, str(error))
        if self._trial.problems == before:
            self.done.append(undo.what)

    def _left(self, undo: Undo, why: str) -> None:
        text = f"not restored: {undo.what} ({why})"
        self._trial.must(False, text, rule=undo.rule, because=undo.because())
