"""A run: first contact, then all checks.

However a check ends, its motion is stopped first. Its changes are undone once everything rests. If something
had to be disabled because it ignored its stops, nothing moves in the rest of the run. If something does not
come to rest at all, the run ends.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from random import Random
from types import MappingProxyType
from typing import Final

from stagewire.errors import StagewireError, TransportLostError, WrongUnitError
from stagewire.links import Link
from stagewire.protocols import CommandProtocol
from stagewire_conformance.device.causes import UNSOLICITED, Cause, Causes
from stagewire_conformance.device.check import Check
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.errors import NotAllowedError, NothingAnswersError
from stagewire_conformance.device.lines.apt_line import AptLine
from stagewire_conformance.device.lines.command_line import CommandLine
from stagewire_conformance.device.lines.line import GuardedLink, jitter_of
from stagewire_conformance.device.lines.standstill import bring_to_rest, moves
from stagewire_conformance.device.permissions import (
    HAZARDS,
    WITHOUT_RANGE,
    Need,
    Permissions,
    RangeError,
)
from stagewire_conformance.device.plans import plan
from stagewire_conformance.device.report import Outcome, Report, digests_of
from stagewire_conformance.device.results import Entry, Finding, Result
from stagewire_conformance.device.trial import EnoughError, NotRunError, Restoration, Trial

_NOT_ALIKE: Final = (
    "its motors are declared alike but report different controllers; "
    "give counts_per_mm of each in a PICS"
)
"""Why a check of several motors does not run if their scales differ."""

_WAS_ON: Final = (
    "the output of {} was on when the run began, so the suite left it on and wrote no setting or output; "
    "switch it off and run the suite again"
)

_UNASKED: Final = Cause("motion", UNSOLICITED)
"""The cause of a motion that no message asked for."""

Progress = Callable[[Check, int, int], None]
"""Called before each check with the check, the number of checks before it, and the total."""


class RunInterrupted(KeyboardInterrupt):
    """Ctrl-C or SIGTERM ended a run, after stops were sent to everything in motion.

    :param report: the results up to the interruption.
    :param signal: the number of the signal.
    """

    def __init__(self, report: Report, signal: int) -> None:
        super().__init__(report.unfinished)
        self.report = report
        self.signal = signal


def line_to(link: Link, declared: Declaration, allowed: Permissions) -> GuardedLink:
    """Return the guarded link for the protocol."""
    kind = CommandLine if isinstance(declared.protocol, CommandProtocol) else AptLine
    return kind(link, declared, allowed)


def run(
    link: Link,
    checks: Sequence[Check],
    declared: Declaration,
    allowed: Permissions,
    seed: int,
    progress: Progress = lambda check, before, total: None,
) -> Report:
    """Run checks on a controller and return the report. The link stays open.

    :param checks: from :func:`.plan`.
    :param seed: seeds all random choices.

    Raises :class:`.NothingAnswersError` if the controller does not answer, and :class:`RunInterrupted` on
    Ctrl-C and SIGTERM. A lost line or a defect of the suite ends the run and is stated in the report.
    """
    return _Run(link, checks, declared, allowed, seed).run(progress)


class _Run:
    """A run in progress."""

    def __init__(
        self,
        link: Link,
        checks: Sequence[Check],
        declared: Declaration,
        allowed: Permissions,
        seed: int,
    ) -> None:
        self._checks = checks
        self._declared = declared
        self._allowed = allowed
        self._seed = seed
        self._line = line_to(link, declared, allowed)
        self._started = datetime.now(UTC)
        self._outcomes: list[Outcome] = []
        self._identification: Mapping[str, int | str] = {}
        self._jitter = 0.0
        self._unfinished = ""
        self._stops: tuple[str, ...] = ()
        self._was_on = ""  # a sentence about the outputs that were on when the run began
        self._held = ""  # why nothing may move in the rest of the run
        self._left_out: dict[str, str] = {}  # why a check was not run, by its id
        self._causes = Causes()
        self._defect: BaseException | None = None

    def run(self, progress: Progress) -> Report:
        line = self._line
        with line.interruption:
            try:
                self._identification = line.contact()
                self._identify()
                self._jitter = jitter_of(line).late
                line.settle()
                if names := " and ".join(line.live()):
                    self._was_on = _WAS_ON.format(names)
                self._run_checks(progress)
                line.leave()
                self._unfinished = "; ".join(self._adrift())
            except KeyboardInterrupt:
                number = line.interruption.signal
                self._unfinished = f"ended by {signal.Signals(number).name}"
                self._leave()
                raise RunInterrupted(self._report(), number) from None
            except NothingAnswersError:
                raise
            except (RangeError, WrongUnitError) as error:  # before the first check
                self._unfinished = str(error)
            except TransportLostError as error:
                self._unfinished = f"the line was lost: {error}"
            except Exception as error:
                self._unfinished = f"the suite has a defect: {type(error).__name__}: {error}"
                self._defect = error
                self._leave()
        return self._report()

    def _identify(self) -> None:
        """Make the checks again if other scales apply than those of the declared unit."""
        declared = self._line.identify(self._identification)
        if declared is self._declared:
            return
        self._declared = declared
        kinds = [kind for kind in dict.fromkeys(check.kind for check in self._checks) if kind]
        made = {check.id: check for check in plan(declared, self._allowed, kinds=kinds)}
        self._checks = [
            made.get(check.id) or replace(check, lacks=_NOT_ALIKE) for check in self._checks
        ]

    def _run_checks(self, progress: Progress) -> None:
        may_run = [not check.skip and not check.refusal(self._allowed) for check in self._checks]
        before, total = 0, sum(may_run)
        for check, runs in zip(self._checks, may_run, strict=True):
            if check.skip:
                finding = Finding(Result.SKIP, check.skip)
                self._outcomes.append(_outcome(check, [finding], Result.SKIP))
            elif runs:
                progress(check, before, total)
                before += 1
                if self._was_on and check.needs:
                    continue
                if self._held and check.needs & {Need.MOTION, *HAZARDS}:
                    self._left_out[check.id] = f"nothing may move: {self._held}"
                    continue
                self._run_check(check)
                if self._line.adrift:
                    return

    def _run_check(self, check: Check) -> None:
        """Run one check. If an error ends it, send stops first; keep its findings in any case."""
        line = self._line
        began, at = line.now, len(line.log)
        random = Random(f"{self._seed}/{check.id}")
        trial = Trial(
            line,
            self._declared,
            self._allowed,
            random,
            check=check.id,
            rules=check.rules,
            causes=self._causes,
            robustness=check.kind is not None and check.kind.robustness,
        )
        restoration = Restoration(trial)
        try:
            self._perform(check, trial, restoration)
        except BaseException as error:
            at_stop = len(line.stops)
            line.halt()  # before anything else
            line.interruption.heed()
            trial.inconclusive(f"the check did not finish: {_reason(error)}")
            try:
                line.come_to_rest()
            except KeyboardInterrupt:
                line.give_up("the run was interrupted again before it came to rest")
                line.interruption.heed()
            restoration.restore_at_rest()
            self._stops = tuple(line.stops[at_stop:])
            raise
        finally:
            self._note_rest(check, trial)
            self._end(check, trial, restoration, at, began)

    def _end(
        self, check: Check, trial: Trial, restoration: Restoration, at: int, began: float
    ) -> None:
        """Add the outcome of a check, unless it was not run and found nothing."""
        line = self._line
        if why := self._left_out.get(check.id):
            if trial.result is Result.PASS:
                return
            trial.inconclusive(why)
        self._outcomes.append(
            _outcome(
                check,
                trial.findings,
                trial.result,
                entries=tuple(line.log[at:]),
                figures=trial.figures,
                seconds=line.now - began,
                restored=tuple(restoration.done),
                met=trial.met,
            )
        )

    def _perform(self, check: Check, trial: Trial, restoration: Restoration) -> None:
        """Run one check to its end, stop what it leaves in motion, and undo its changes."""
        line = self._line
        try:
            check.run(trial)
        except NotRunError as error:
            self._left_out[check.id] = str(error)
        except EnoughError:
            pass
        except (TransportLostError, NotAllowedError):
            raise
        except StagewireError as error:  # the behaviour of a controller can end a check
            line.halt()
            trial.must(False, f"the check could not continue: {error}")
            line.come_to_rest()
            restoration.restore_at_rest()
        line.rest()
        restoration.restore()
        line.rest()
        if check.needs & {Need.SETTINGS, Need.TUNING} and line.rest_rule:
            self._see_rest(trial)
        self._see_outputs(check, trial)
        for text in line.settle():
            trial.info(f"received after the check, unsolicited: {text}")
        for name, raw in line.unasked_ends.items() if trial.result is Result.PASS else ():
            trial.must(
                False,
                f"{name} reports the end of a motion, but nothing was asked to move",
                came=raw,
                rule=line.rest_rule,
                cause=_UNASKED,
            )
        line.forget()

    def _see_outputs(self, check: Check, trial: Trial) -> None:
        """Report and switch off an output that can burn or heat and is on after a check."""
        if not check.needs:
            return
        names = self._line.live()
        for name in names:
            asked = check.needs & WITHOUT_RANGE
            why = "after a check that switches it off" if asked else "but nothing switched it on"
            trial.must(False, f"the output of {name} is on, {why}", cause=Cause(name, "output"))
        if names:
            self._line.adrift += self._line.switch_off()

    def _see_rest(self, trial: Trial) -> None:
        """Report and stop everything that moves although nothing was asked to move."""
        line = self._line
        causes = (_UNASKED, *(Cause(name, UNSOLICITED) for name in sorted(line.ends)))
        for part in () if line.parts() else line.others():
            if part.listed and moves(line, part):
                text = f"{part.name} moves, but nothing was asked to move"
                trial.must(False, text, rule=line.rest_rule, cause=causes, because=part.stuck)
                line.adrift += bring_to_rest(line, [part], ())

    def _note_rest(self, check: Check, trial: Trial) -> None:
        """Note the parts that did not stop in a check. Nothing is moved after it."""
        line = self._line
        for part in line.adrift:
            if part.blames:
                trial.must(False, part.text, rule=line.stop_rule, because=part.because)
            else:
                trial.inconclusive(part.text)
        if line.disabled and not self._held:
            names = " and ".join(sorted(line.disabled))
            self._held = f"{names} ignored its stops in {check.id} and had to be disabled"
            if not line.adrift:
                text = f"{names} came to rest only when it was disabled; it still is"
                trial.follows(text, line.stop_rule)

    def _leave(self) -> None:
        """Leave the controller as it was found, as far as possible after an error."""
        self._line.interruption.heed()
        with suppress(StagewireError, KeyboardInterrupt):
            self._line.leave()

    def _adrift(self) -> tuple[str, ...]:
        """Return a sentence about each part that may move, shine or heat. It ends the run early."""
        texts = [*(part.text for part in self._line.adrift), self._was_on]
        return tuple(dict.fromkeys(filter(None, texts)))

    def _report(self) -> Report:
        reached = {outcome.check.id for outcome in self._outcomes}
        not_run = [
            (
                check,
                check.refusal(self._allowed)
                or self._left_out.get(check.id, f"not reached: {self._unfinished}"),
            )
            for check in self._checks
            if check.id not in reached
        ]
        return Report(
            declared=self._declared,
            url=self._line.url,
            seed=self._seed,
            allowed=self._allowed,
            outcomes=tuple(self._outcomes),
            not_run=tuple(not_run),
            unfinished=self._unfinished,
            jitter=self._jitter,
            started=self._started,
            digests=digests_of(self._declared),
            identification=self._identification,
            stops=self._stops,
            adrift=self._adrift(),
            defect=self._defect,
        )


def _outcome(
    check: Check,
    findings: Sequence[Finding],
    result: Result,
    *,
    entries: tuple[Entry, ...] = (),
    figures: Mapping[str, float] = MappingProxyType({}),
    seconds: float = 0.0,
    restored: tuple[str, ...] = (),
    met: Mapping[str, str] = MappingProxyType({}),
) -> Outcome:
    assert check.kind is not None  # checks of a plan have one
    return Outcome(
        check, check.kind, result, tuple(findings), entries, figures, seconds, restored, met
    )


def _reason(error: BaseException) -> str:
    if isinstance(error, KeyboardInterrupt):
        return "the run was interrupted"
    return str(error) if isinstance(error, StagewireError) else f"{type(error).__name__}: {error}"
