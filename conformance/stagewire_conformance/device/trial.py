"""The trial of a check: its line, declaration, permissions and findings, and the restoration after it.

The changes of a check are put back at its end, the last one first, whatever has happened.
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
    """What else the check would look at cannot be looked at; what it found stands. Never leaves a run."""


@dataclass(frozen=True)
class Undo:
    """Something that is to be put back.

    :param what: in words, such as ``velocity parameters of channel 1``.
    :param action: puts it back.
    :param moves: whether something moves by it, so that it is left as it is after an interruption.
    """

    what: str
    action: Callable[[], object]
    moves: bool = False


@dataclass
class Trial:
    """One run of one check.

    :param line: an :class:`.AptLine` or a :class:`.CommandLine`, as the protocol has it.
    :param declared: what is at its other end.
    :param allowed: what may be done beyond asking.
    :param random: of the seed and the id of the check, so that it alone can be repeated byte for byte.
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
        """Note a FAIL unless something holds; return whether it does.

        :param problem: a sentence: what came, and what should have come.
        :param wanted: the bytes that should have come, if that is known.
        :param came: the bytes that it is about, if there are any.
        """
        return self._expect(Result.FAIL, holds, problem, wanted, came)

    def should(
        self, holds: bool, problem: str, *, wanted: bytes | None = None, came: bytes | None = None
    ) -> bool:
        """Note a NON-STRICT unless something holds; return whether it does; see :meth:`must`."""
        return self._expect(Result.NON_STRICT, holds, problem, wanted, came)

    def need(
        self, holds: bool, problem: str, *, wanted: bytes | None = None, came: bytes | None = None
    ) -> None:
        """Note a FAIL and end the check unless something holds; see :meth:`must`."""
        if not self.must(holds, problem, wanted=wanted, came=came):
            raise EnoughError

    def _expect(
        self, result: Result, holds: bool, problem: str, wanted: bytes | None, came: bytes | None
    ) -> bool:
        if not holds:
            self.findings.append(Finding(result, problem, wanted, came))
        return holds

    def info(self, text: str, **figures: float) -> None:
        """Note something that is neither right nor wrong; the check passes all the same.

        :param figures: go into the report by their names (``p99_ms=3.2``).
        """
        self.findings.append(Finding(Result.PASS, text))
        self.figures |= figures

    def inconclusive(self, text: str, **figures: float) -> None:
        """Note that nothing could be decided, as on a computer that is late itself: the check is INFO."""
        self.findings.append(Finding(Result.INFO, text))
        self.figures |= figures

    def reply(self, request: FramedMessage, dest: int, wait: float = 1.0) -> Incoming:
        """Ask, and return the reply; where none comes, that is a FAIL, and the end of the check."""
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
        """Let something be put back at the end of the check, whatever has happened by then; last first.

        :param what: in words, for the report: ``velocity parameters of channel 1``.
        :param action: puts it back; what it finds by :meth:`must` counts.
        :param moves: whether something moves by it: it is done in the normal course only, and not after
            Ctrl-C or an error, when nothing may move any more.
        """
        self.undos.append(Undo(what, action, moves))

    @property
    def result(self) -> Result:
        """What comes out of the findings."""
        return worst(finding.result for finding in self.findings)


class Restoration:
    """Puts back what a trial noted; what cannot be put back is a finding of it.

    :param trial: of the check that is over.
    """

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        self._undos = trial.undos
        self.done: list[str] = []
        """What was put back, in words."""
        self._moves = True  # what moves may be put back, too

    def restore(self) -> None:
        """Put everything back, in the normal course.

        Where that fails, what may move by it is stopped, and nothing is put back any more by which something
        moves. Raises what interrupts it; :meth:`restore_at_rest` goes on from there.
        """
        while self._undos:
            if self._may_be_done(self._undos[-1]):
                self._put_back(self._undos[-1])
            self._undos.pop()

    def restore_at_rest(self) -> None:
        """Put back, after an error, everything by which nothing moves; raises nothing.

        Where the line is gone, or somebody interrupts it once more, the rest is left, and named.
        """
        self._moves = False
        why = ""
        while self._undos:
            undo = self._undos.pop()
            if why:
                self._left(undo, why)
            elif self._may_be_done(undo):
                try:
                    self._put_back(undo)
                except TransportLostError:
                    why = "the line is gone"
                    self._left(undo, why)
                except KeyboardInterrupt:
                    why = "interrupted"
                    self._left(undo, why)
                except Exception as error:  # the others are to be put back all the same
                    self._left(undo, f"the suite has a defect: {type(error).__name__}: {error}")

    def _may_be_done(self, undo: Undo) -> bool:
        if undo.moves and not self._moves:
            self._trial.info(f"left as it is, since nothing is to move any more: {undo.what}")
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
            self._moves = False
            if not isinstance(error, EnoughError):  # which has said what is wrong
                self._left(undo, str(error))
        if len(self._trial.findings) == before:
            self.done.append(undo.what)

    def _left(self, undo: Undo, why: str) -> None:
        self._trial.must(False, f"not restored: {undo.what} ({why})")
