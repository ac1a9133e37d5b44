"""What a check changed is put back at its end, last first, whatever has happened."""

from __future__ import annotations

from stagewire.errors import StagewireError, TransportLostError
from stagewire_conformance.device.trial import EnoughError, Trial, Undo

__all__ = ["Restoring"]


class Restoring:
    """Puts back what a trial noted; what cannot be put back is a finding of it.

    :param trial: of the check that is over.
    """

    def __init__(self, trial: Trial) -> None:
        self._trial = trial
        self._undos = trial.undos
        self.done: list[str] = []
        """What was put back, in words."""
        self._moves = True  # what moves may be put back, too

    def put_back(self) -> None:
        """Put everything back, in the normal course.

        Where that fails, what may move by it is stopped, and nothing is put back any more by which something
        moves. Raises what interrupts it; :meth:`put_back_what_rests` goes on from there.
        """
        while self._undos:
            if self._may_be_done(self._undos[-1]):
                self._put_back(self._undos[-1])
            self._undos.pop()

    def put_back_what_rests(self) -> None:
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
