"""``stagewire ioc``: publish controllers as records of EPICS."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.errors import WRONG, CalledWronglyError

EXAMPLE = """\b
Examples:
  stagewire ioc bench.toml
  stagewire ioc bench.toml --list-pvs
  stagewire ioc bench.toml --pva --bind 0.0.0.0
"""
_CA_PORT = 5064
_PVA_PORT = 5075


def ioc(
    bench: Annotated[
        Path, typer.Argument(metavar="BENCH.toml", help="The controllers and motors.")
    ],
    bind: Annotated[
        list[str] | None,
        typer.Option("--bind", metavar="ADDRESS", help="Listen here.  [default: loopback only]"),
    ] = None,
    port: Annotated[
        int, typer.Option("--port", min=1, max=65535, help="Port of Channel Access.")
    ] = _CA_PORT,
    pva: Annotated[bool, typer.Option("--pva", help="Serve pvAccess also.")] = False,
    pva_port: Annotated[
        int, typer.Option("--pva-port", min=1, max=65535, help="TCP port of pvAccess.")
    ] = _PVA_PORT,
    read_only: Annotated[
        bool, typer.Option("--read-only", help="Refuse all puts except STOP.")
    ] = False,
    restore: Annotated[
        bool, typer.Option("--restore", help="Restore the coordinates that the bench saves.")
    ] = False,
    screens: Annotated[
        Path | None,
        typer.Option("--screens", metavar="DIRECTORY", help="Write Phoebus screens and end."),
    ] = None,
    list_pvs: Annotated[
        bool, typer.Option("--list-pvs", help="List the records and end; opens nothing.")
    ] = False,
) -> None:
    """Publish the motors of a bench as motor records of EPICS, by Channel Access and pvAccess.

    The bench file names the controllers and their motors. Clients such as bluesky, Phoebus and caput connect.
    A controller that is off or lost is opened again every 2 seconds; its records are then INVALID. Ctrl-C and
    SIGTERM stop the axes and fail open puts.

    Everyone who can connect can move the motors, so it listens on this computer only, unless --bind names
    another address. There is no password.
    """
    import asyncio
    import logging
    from collections.abc import Iterable

    from stagewire.errors import StagewireError
    from stagewire_cli.signals import signals

    try:
        from stagewire_epics.access import Access
        from stagewire_epics.autosave import Autosave
        from stagewire_epics.bench import read_bench
        from stagewire_epics.channel_access import ChannelAccessServer
        from stagewire_epics.ioc import Ioc, Server

        if pva:
            from stagewire_epics.pvaccess import PvAccessServer
    except ModuleNotFoundError as error:
        raise CalledWronglyError(
            f"stagewire ioc requires {error.name}: pip install 'stagewire[epics]'"
        ) from None

    def screens_of(made: Ioc, directory: Path) -> Iterable[Path]:
        try:
            from stagewire_epics.screens import write_screens
        except ModuleNotFoundError as error:
            raise CalledWronglyError(
                f"--screens requires {error.name}: pip install 'stagewire[epics-screens]'"
            ) from None
        return write_screens(made.motors, directory)

    try:
        read = read_bench(bench)
        access = Access(read_only, frozenset(read.access.hosts), frozenset(read.access.users))

        async def serve() -> None:
            made = Ioc(read)
            if screens is not None:
                for path in screens_of(made, screens):
                    typer.echo(path)
                return
            if list_pvs:
                for name in made.records:
                    typer.echo(name)
                return
            addresses = bind or ["127.0.0.1"]
            autosave = None
            if read.autosave is not None:
                autosave = Autosave(bench.parent / read.autosave, made.motors)
            if restore:
                if autosave is None:
                    raise CalledWronglyError(f"--restore: {bench} has no key autosave = FILE")
                autosave.restore()
            servers: list[Server] = [ChannelAccessServer(made.records, access, addresses, port)]
            if pva:
                servers.append(PvAccessServer(made.records, access, addresses, pva_port))
            end = asyncio.Event()

            def ready() -> None:
                typer.echo(
                    f"stagewire: {len(made.motors)} motors, {len(made.records)} records by Channel Access on "
                    f"{', '.join(addresses)}, port {port}",
                    err=True,
                )
                if bind is None:
                    where = "127.0.0.1" if port == _CA_PORT else f"127.0.0.1:{port}"
                    typer.echo(
                        f"stagewire: clients on this computer need EPICS_CA_ADDR_LIST={where}",
                        err=True,
                    )
                _collect_often()

            with signals(end.set):
                await made.run(servers, end, ready, autosave)

        logging.basicConfig(level=logging.WARNING, format="stagewire: %(message)s")
        asyncio.run(serve())
    except StagewireError as error:
        raise CalledWronglyError(str(error)) from None
    except OSError as error:
        typer.echo(f"stagewire: cannot serve: {error.strerror or error}", err=True)
        raise typer.Exit(WRONG) from None


def _collect_often() -> None:
    """Let the garbage collector run often and quickly, so that memory does not grow between its runs.

    The errors of puts refer to each other. By default, the many objects of the imports delay their
    collection.
    """
    import gc

    gc.collect()
    gc.freeze()
    gc.set_threshold(700, 10, 2)
