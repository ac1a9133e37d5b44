"""The trial of a check: its line, declaration, permissions and findings, and the restoration after it.

At the end of a check its changes are undone, the last one first, however the check ended.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random
from typing import TYPE_CHECKING, Any

from stagewire.errors import StagewireError, TransportLostError
from stagewire_conformance.device.results import Finding, Result, worst

if TYPE_CHECKING:
    from stagewire.protocols import FramedMessage
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions


class EnoughError(Exception):
    """Ends a check early and keeps its findings. Never leaves a run."""


@dataclass(frozen=True)
class Undo:
    """A change that must be undone.

    :param what: a phrase such as ``velocity parameters of channel 1``.
    :param action: undoes the change.
    :param moves: whether the action moves something. If so, it is omitted after an interruption.
    """

    what: str
    action: Callable[[], object]
    moves: bool = False


@dataclass
class Trial:
    """One run of one check.

    :param line: an :class:`.AptLine` or a :class:`.CommandLine`, depending on the protocol.
    :param declared: the declared controller.
    :param allowed: the permissions of the run.
    :param random: seeded by the run and the id of the check, so that a check can be repeated alone.
    """

    line: Any
    declared: Declaration
    allowed: Permissions
    random: Random
    findings: list[Finding] = field(default_factory=list)
    figures: dict[str, float] = field(default_factory=dict)
    undos: list[Undo] = field(default_factory=list)

    def must(
        self, holds: bool, problem: str, *, wanted: bytes | None = None, came: bytes | None = None
    ) -> bool:
        """Note a FAIL unless ``holds``; return ``holds``.

        :param problem: a sentence that states what was received and what was expected.
        :param wanted: the expected bytes, if known.
        :param came: the received bytes that the problem is about, if any.
        """
        return self._expect(Result.FAIL, holds, problem, wanted, came)

    def should(
        self, holds: bool, problem: str, *, wanted: bytes | None = None, came: bytes | None = None
    ) -> bool:
        """Note a NON-STRICT unless ``holds``; return ``holds``. See :meth:`must`."""
        return self._expect(Result.NON_STRICT, holds, problem, wanted, came)

    def need(
        self, holds: bool, problem: str, *, wanted: bytes | None = None, came: bytes | None = None
    ) -> None:
        """Note a FAIL and end the check unless ``holds``. See :meth:`must`."""
        if not self.must(holds, problem, wanted=wanted, came=came):
            raise EnoughError

    def _expect(
        self, result: Result, holds: bool, problem: str, wanted: bytes | None, came: bytes | None
    ) -> bool:
        if not holds:
            self.findings.append(Finding(result, problem, wanted, came))
        return holds

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
            names = self.declared.registry.messages[request.layout.message]["exchange"][
                "answered_by"
            ]
            self.need(
                False,
                f"{request.layout.message} to {dest:#04x} was not answered by {' or '.join(names)} "
                f"within {wait:g} s",
            )
        assert heard is not None
        return heard

    def undo(self, what: str, action: Callable[[], object], *, moves: bool = False) -> None:
        """Register an action that undoes a change. It runs at the end of the check, however the check ends.

        The last registered action runs first.

        :param what: a phrase for the report, such as ``velocity parameters of channel 1``.
        :param action: undoes the change. Its failed :meth:`must` calls count as findings.
        :param moves: whether the action moves something. Such an action does not run after Ctrl-C or an
            error, because nothing may move then.
        """
        self.undos.append(Undo(what, action, moves))

    @property
    def result(self) -> Result:
        """The worst result of the findings."""
        return worst(finding.result for finding in self.findings)


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
        """Undo, after an error, all changes whose action moves nothing, if everything rests. Raises nothing.

        If the line is lost or the run is interrupted again, note the remaining changes as not restored.
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
            self._left(undo, "not everything is known to be at rest")
            return False
        return True

    def _put_back(self, undo: Undo) -> None:
        before = len(self._trial.findings)
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
        if len(self._trial.findings) == before:
            self.done.append(undo.what)

    def _left(self, undo: Undo, why: str) -> None:
        self._trial.must(False, f"not restored: {undo.what} ({why})")
