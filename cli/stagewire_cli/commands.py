"""The table of all commands, and the help that lists them in groups."""

from __future__ import annotations

import importlib
from typing import Any, Final, NamedTuple

import typer
from typer.core import TyperGroup


class Row(NamedTuple):
    """One row of ``stagewire --help``: related commands, and one sentence about them."""

    names: tuple[str, ...]
    summary: str


GROUPS: Final = {
    "Your controller": (
        Row(("list", "doctor"), "List controllers; find out why one does not answer."),
        Row(("monitor", "panel"), "Show the status live; move several axes on one screen."),
        Row(("move", "home", "jog"), "Move one axis, and wait for the end of the motion."),
        Row(("stop",), "Stop all axes, or only one, without asking."),
        Row(("serve", "ioc"), "Share a line with programs; publish motors to EPICS."),
    ),
    "Look up and decode": (
        Row(("show",), "Find messages, fields, units and stages in the registry."),
        Row(("decode", "encode"), "Decode bytes to messages, and encode messages."),
    ),
    "Virtual controllers": (
        Row(("virtual",), "Serve virtual controllers on TCP or pseudo-terminals."),
    ),
    "Conformance": (
        Row(("conformance", "testee"), "Test controllers and codecs against the documents."),
    ),
    "Registry and code": (
        Row(("check", "format", "diff"), "Check, format and compare specs."),
        Row(("generate", "schemas"), "Generate Python and C code, and JSON Schemas."),
        Row(("completion",), "Print the completion script of bash, zsh or fish."),
    ),
}
"""Title of a group -> its rows. They must fit a terminal of 80 columns and 24 rows."""

_PLACES: Final = {
    "check": ("check", "check", "EXAMPLE"),
    "completion": ("completion", "completion", "EXAMPLE"),
    "conformance": ("conformance", "app", "EXAMPLE"),
    "decode": ("decode", "decode", "EXAMPLE"),
    "diff": ("diff", "diff", "EXAMPLE"),
    "doctor": ("discovery", "doctor", "DOCTOR_EXAMPLE"),
    "encode": ("encode", "encode", "EXAMPLE"),
    "format": ("format", "format_files", "EXAMPLE"),
    "generate": ("generate", "generate", "EXAMPLE"),
    "home": ("motion", "home", "HOME_EXAMPLE"),
    "ioc": ("ioc", "ioc", "EXAMPLE"),
    "jog": ("motion", "jog", "JOG_EXAMPLE"),
    "list": ("discovery", "list_ports", "LIST_EXAMPLE"),
    "monitor": ("monitor", "monitor", "EXAMPLE"),
    "move": ("motion", "move", "MOVE_EXAMPLE"),
    "panel": ("panel", "panel", "EXAMPLE"),
    "schemas": ("generate", "schemas", "SCHEMAS_EXAMPLE"),
    "show": ("show", "show", "EXAMPLE"),
    "serve": ("serve", "serve", "EXAMPLE"),
    "stop": ("motion", "stop", "STOP_EXAMPLE"),
    "testee": ("testee", "testee", "EXAMPLE"),
    "virtual": ("virtual", "virtual", "EXAMPLE"),
}
"""Name of a command -> its module, and the names of its function and its examples there."""

NAMES: Final = tuple(name for rows in GROUPS.values() for row in rows for name in row.names)
"""All commands, in the order of the help."""


_EXAMPLE: Final = """\
Example: stagewire decode "53 04 06 00 D0 01 01 00 40 0D 03 00"
stagewire COMMAND --help lists the options of a command, with examples."""


def add(app: typer.Typer, name: str) -> None:
    """Import a command and add it to an app."""
    place, function, example = _PLACES[name]
    module = importlib.import_module(f"stagewire_cli.{place}")
    called = getattr(module, function)
    if isinstance(called, typer.Typer):
        app.add_typer(called, name=name)
    else:
        app.command(name, epilog=getattr(module, example))(called)


class Commands(TyperGroup):
    """The group of all commands; its help lists them by the table, without importing them."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the usage, the commands by group, and an example."""
        formatter.write(f"Usage: {ctx.command_path} [--version] COMMAND [ARGS]...\n")
        formatter.write(f"{self.help}\n\n")
        width = max(len(", ".join(row.names)) for rows in GROUPS.values() for row in rows)
        for title, rows in GROUPS.items():
            formatter.write(f"{title}:\n")
            for row in rows:
                formatter.write(f"  {', '.join(row.names):<{width}}  {row.summary}\n")
        formatter.write(f"\n{_EXAMPLE}\n")
