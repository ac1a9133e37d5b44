"""What ``stagewire conformance device`` prints of its own: the plan, how far it is, why it ended early."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import typer

from stagewire_cli.conformance.device_plan import Planned
from stagewire_cli.output import bar, console, printable, table
from stagewire_conformance.device.check import Check
from stagewire_conformance.device.permissions import Need
from stagewire_conformance.device.report import Report
from stagewire_conformance.reports.device_sheet import places
from stagewire_conformance.reports.text import counted, where

__all__ = ["progressing", "show_beginning", "show_cut_short", "show_list"]

_WHAT = {
    Need.SETTINGS: "changes settings, and restores them",
    Need.MOTION: "moves, or switches what is put out",
    Need.EEPROM: "writes the EEPROM",
}


def show_list(planned: Planned) -> None:
    """Print every check with what it needs, and where in the document its messages or rules stand."""
    shown = table("check", "needs", "where", "what the controller has to do")
    for check in planned.checks:
        needs = ", ".join(need for need in Need if need in check.needs)
        shown.add_row(check.id, needs, _pages(planned, check), printable(check.title))
    console().print(shown)
    typer.echo(f"{planned.declared.unit.name}: {counted(len(planned.checks), 'check')}")


def _pages(planned: Planned, check: Check) -> str:
    registry = planned.declared.registry
    found = {page for name in check.messages for page in registry.messages[name]["pages"]}
    if not found:
        rules = {rule["id"]: rule["page"] for rule in registry.data["rules"]}
        found = {rules[name] for name in check.held_to if name in rules}
    return where(places(registry, sorted(found)))


def show_beginning(url: str, planned: Planned) -> None:
    """Print what will be tested, and everything that will be done to it beyond asking."""
    declared, allowed = planned.declared, planned.allowed
    runnable = planned.runnable
    seconds = sum(check.seconds for check in runnable)
    typer.echo(
        printable(f"{declared.unit.name} at {url}: {counted(len(runnable), 'check')}, ")
        + f"about {max(1, round(seconds))} s; seed {planned.seed}"
    )
    doing = [check for check in runnable if check.needs]
    if not doing:
        typer.echo("It is only asked: nothing is set, written or moved.")
    for need in Need:
        of_need = [check for check in doing if _gravest(check) is need]
        if not of_need:
            continue
        bound = f" within {allowed.motion}" if need is Need.MOTION else ""
        typer.echo(f"It {_WHAT[need]}{bound}: {counted(len(of_need), 'check')}")
        for text in dict.fromkeys(check.does for check in of_need if check.does):
            typer.echo(f"  {printable(text)}")
    refused: dict[str, int] = {}
    for check in planned.checks:
        if why := planned.refusal(check):
            refused[why] = refused.get(why, 0) + 1
    for why, number in refused.items():
        typer.echo(printable(f"Not run: {counted(number, 'check')}: {why}"))


def _gravest(check: Check) -> Need | None:
    """Return under which need a check is told: what moves is told as moving."""
    order = (Need.EEPROM, Need.MOTION, Need.SETTINGS)
    return next((need for need in order if need in check.needs), None)


@contextmanager
def progressing() -> Iterator[Callable[[Check, int, int], None]]:
    """Give what hears of each check: a bar on a terminal, a line for each kind elsewhere."""
    if not sys.stderr.isatty():
        yield _KindLines()
        return
    with bar("asking what is there") as show:
        yield lambda check, before, total: show(before, total, check.id)


class _KindLines:
    """Says of each kind of checks that it begins."""

    def __init__(self) -> None:
        self._kind = ""

    def __call__(self, check: Check, before: int, total: int) -> None:
        """Hear of a check."""
        kind = check.kind.name if check.kind else check.id
        if kind != self._kind:
            self._kind = kind
            print(f"... {before} of {total}: {kind}", file=sys.stderr, flush=True)


def show_cut_short(report: Report) -> None:
    """Print why a run ended early, what was sent to stop the controller, and what was put back."""
    typer.echo(f"stagewire: {printable(report.unfinished)}", err=True)
    if report.defect is not None:
        traceback.print_exception(report.defect)  # a defect of ours, for those who mend it
    for text in report.stops:
        typer.echo(f"stop was sent: {printable(text)}", err=True)
    if report.outcomes:
        last = report.outcomes[-1]
        for text in last.restored:
            typer.echo(f"restored: {printable(text)}", err=True)
        for finding in last.findings:
            typer.echo(f"{last.check.id}: {printable(finding.text)}", err=True)
