"""``stagewire list``: the serial ports of this computer, and which controllers are behind them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer

from stagewire_cli.terminal import console, printable, table

if TYPE_CHECKING:
    from stagewire.discovery import Found

__all__ = ["EXAMPLE", "list_ports"]

EXAMPLE = """\b
Examples:
  stagewire list
  stagewire list --ask --json
"""


def list_ports(
    ask: Annotated[
        bool,
        typer.Option(
            "--ask",
            help="Open the ports of controllers, and ask for identity and bays; nothing moves.",
        ),
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per line.")] = False,
) -> None:
    """List controllers and serial ports.

    Without --ask no port is opened: the USB plug tells ids and serial number, and its first digits the unit.
    """
    from stagewire.discovery import discover

    found = discover(ask)
    if as_json:
        for one in found:
            typer.echo(json.dumps(_record(one)))
        return
    if found:
        _show(found, ask)
    if not any(one.is_controller for one in found):
        typer.echo("no controller found; stagewire doctor says why", err=True)


def _show(found: list[Found], ask: bool) -> None:
    said = ("firmware", "bays") if ask else ()
    shown = table("port", "unit", "serial number", *said, "what it is")
    for one in found:
        cells = [one.url, one.unit or "", one.serial_number if one.is_controller else ""]
        if ask:
            cells += [one.identity.firmware if one.identity else "", _bays(one)]
        what = f"{one.what}; {one.problem}" if one.problem else one.what
        shown.add_row(*map(printable, cells), printable(what), style="red" if one.problem else None)
    console().print(shown)


def _bays(found: Found) -> str:
    return "" if found.bays is None else ", ".join(map(str, found.bays)) or "none"


def _record(found: Found) -> dict[str, object]:
    """Return what is known of a port, for programs."""
    return {
        "url": found.url,
        "unit": found.unit,
        "units": [known.name for known in found.known],
        "messages_of": [known.unit for known in found.known],
        "controller": found.is_controller,
        "serial_number": found.serial_number,
        "usb": found.port.usb,
        "description": found.port.description,
        "manufacturer": found.port.manufacturer,
        "model": found.identity.model if found.identity else None,
        "firmware": found.identity.firmware if found.identity else None,
        "bays": found.bays,
        "what": found.what,
        "problem": found.problem,
    }
