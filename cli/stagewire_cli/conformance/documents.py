"""``stagewire conformance examples`` and ``rules``: worked examples and rules of the documents."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from stagewire.protocols import Protocol
from stagewire_cli.errors import WRONG
from stagewire_cli.output import console, printable, progress, table
from stagewire_cli.protocols import one_or_all
from stagewire_conformance.examples import coverage, run
from stagewire_conformance.verdict import Verdict, succeeded, summary_of

if TYPE_CHECKING:
    from stagewire_conformance.device.rules_page import Coverage

EXAMPLES_EXAMPLE = """\b
Examples:
  stagewire conformance examples
  stagewire conformance examples --summary
  stagewire conformance examples --coverage
"""

_ROOM_FOR_DETAIL = 150


def examples(
    protocol: Annotated[
        str | None, typer.Option("--protocol", metavar="NAME", help="Only this protocol.")
    ] = None,
    summary: Annotated[
        bool, typer.Option("--summary", help="Print one line per protocol, and all failures.")
    ] = False,
    with_coverage: Annotated[
        bool, typer.Option("--coverage", help="Show which messages have examples, and run none.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per line.")] = False,
) -> None:
    """Encode and decode every worked example of the documents, and every capture.

    A misprinted example (an erratum) passes if its bytes behave as the registry states, and fails if they are
    correct.
    """
    if summary and (as_json or with_coverage):
        raise typer.BadParameter("--summary cannot be combined with --json or --coverage")
    chosen = one_or_all(protocol, whole=True)  # an unusable protocol must not be skipped
    if with_coverage:
        for one in chosen:
            _show_coverage(one, as_json)
        return
    verdicts: list[Verdict] = []
    for one in chosen:
        with progress() as say:
            say(f"{one.name}: running the worked examples")
            found = run(one)
        verdicts += found
        if as_json:
            for verdict in found:
                typer.echo(json.dumps({"protocol": one.name, **asdict(verdict)}))
        else:
            if not summary:
                _verdict_table(found)
            _failures(found)
            typer.echo(f"{one.name}: {summary_of(found)}")
    if not succeeded(verdicts):
        raise typer.Exit(WRONG)


def _verdict_table(verdicts: list[Verdict]) -> None:
    """Print the verdicts, with details if the terminal is wide enough."""
    out = console()
    columns = ["id", "page", "kind", "message", "verdict", "result"]
    with_detail = out.width >= _ROOM_FOR_DETAIL
    shown = table(*columns, *(["detail"] if with_detail else []), right=("page",))
    for verdict in verdicts:
        cells = [
            verdict.id,
            "" if verdict.page is None else str(verdict.page),
            verdict.kind,
            verdict.message,
            verdict.expected,
            verdict.outcome,
        ]
        detail = [printable(verdict.detail)] if with_detail else []
        shown.add_row(*cells, *detail, style="red" if verdict.failed else None)
    out.print(shown)


def _failures(verdicts: list[Verdict]) -> None:
    """Print the details of each failed example."""
    for verdict in verdicts:
        if verdict.failed:
            page = "capture" if verdict.page is None else f"page {verdict.page}"
            about = ", ".join(filter(None, (page, verdict.kind, verdict.message)))
            typer.echo(f"failed: {verdict.id} ({about}): {printable(verdict.title)}")
            typer.echo(f"  expected: {verdict.expected}; found: {printable(verdict.detail)}")


def _show_coverage(protocol: Protocol, as_json: bool) -> None:
    rows = coverage(protocol)
    if as_json:
        for row in rows:
            typer.echo(json.dumps({"protocol": protocol.name, **asdict(row)}))
        return
    shown = table(
        "message", "pages", "layouts", "examples", "on pages", "captures",
        right=("layouts", "examples", "captures"),
    )  # fmt: skip
    for row in rows:
        shown.add_row(
            row.message,
            ", ".join(str(page) for page in row.pages),
            str(row.layouts),
            str(row.examples or ""),
            ", ".join(str(page) for page in row.example_pages),
            str(row.captures or ""),
        )
    console().print(shown)
    covered = sum(bool(row.examples) for row in rows)
    typer.echo(f"{protocol.name}: {covered} of {len(rows)} messages have worked examples")


RULES_EXAMPLE = """\b
Examples:
  stagewire conformance rules
  stagewire conformance rules --protocol asi_ms2000 --json
"""


def rules(
    protocol: Annotated[
        str | None, typer.Option("--protocol", metavar="NAME", help="Only this protocol.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per line.")] = False,
) -> None:
    """List the rules of the documents, with the checks that verify them or the reason why no check can.

    Such a reason is a waiver. The exit status is 1 if a must has neither a check nor a waiver, or a rule has
    both.
    """
    from stagewire_conformance.device.rules_page import coverage, summary_of_rules

    found = [(one, coverage(one)) for one in one_or_all(protocol, whole=True)]
    for one, rows in found:
        if as_json:
            for row in rows:
                typer.echo(json.dumps({"protocol": one.name, **asdict(row)}))
            continue
        if rows:
            _rule_table(rows)
        for row in rows:
            if row.problem:
                typer.echo(f"{one.name}: {row.rule} {row.problem}")
        typer.echo(f"{one.name}: {summary_of_rules(rows)}")
    if any(row.problem for _, rows in found for row in rows):
        raise typer.Exit(WRONG)


def _rule_table(rows: tuple[Coverage, ...]) -> None:
    shown = table("rule", "where", "strength", "checks, or reason for the waiver")
    for row in rows:
        seen = ", ".join(row.checks) or printable(row.waiver) or "nothing"
        shown.add_row(row.rule, row.where, row.strength, seen, style="red" if row.problem else None)
    console().print(shown)
