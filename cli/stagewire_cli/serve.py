"""``stagewire serve``: share the line of a controller with several programs."""

from __future__ import annotations

from typing import Annotated

import typer

from stagewire_cli.devices import LinkUrl, Unit, called_wrongly
from stagewire_cli.errors import WRONG, CalledWronglyError

EXAMPLE = """\b
Examples:
  stagewire serve /dev/ttyUSB0 --tcp 4001
  stagewire serve COM3 --tcp 4001 --unit MS2000
  stagewire monitor socket://127.0.0.1:4001 --unit KDC101 --listen
"""


def serve(
    url: LinkUrl,
    tcp: Annotated[
        str,
        typer.Option("--tcp", metavar="[HOST:]PORT", help="Listen here. 0 chooses a free port."),
    ],
    unit: Unit = None,
    baudrate: Annotated[
        int | None,
        typer.Option("--baudrate", min=1, help="Of a serial line.  [default: as documented]"),
    ] = None,
    bind: Annotated[
        str | None,
        typer.Option(
            "--bind",
            metavar="ADDRESS",
            help="Listen on this address.  [default: loopback only]",
        ),
    ] = None,
) -> None:
    """Share a line: one program writes, and any number listen.

    The first client that sends holds the line until it closes its connection; all others receive what the
    controller sends. A second client that sends is disconnected, because replies do not name their request. A
    stop is taken from every client and overtakes all that waits. Keep-alive messages are sent by this
    command. It writes what happens to standard error, and ends with Ctrl-C.

    Everyone who can connect can move the stage, so it listens on this computer only, unless --bind names
    another address. There is no password.
    """
    from stagewire.discovery import device_class, unit_at
    from stagewire_cli.line_server import share
    from stagewire_virtual.errors import ServingError
    from stagewire_virtual.serving.endpoints import parse_tcp

    try:
        endpoint = parse_tcp(tcp, bind)
    except ServingError as error:
        raise CalledWronglyError(f"--tcp: {error}") from None
    with called_wrongly():
        device = device_class(unit or unit_at(url))
    try:
        lost = share(url, device, endpoint.host, endpoint.port, baudrate)
    except OSError as error:
        raise CalledWronglyError(
            f"cannot listen on {endpoint.host}:{endpoint.port}: {error.strerror or error}; choose another "
            "port (0 finds a free one)"
        ) from None
    if lost is not None:
        typer.echo(f"stagewire: {lost}", err=True)
        raise typer.Exit(WRONG)
