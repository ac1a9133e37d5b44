"""``stagewire encode``: encode a message to bytes in hex."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from stagewire.errors import CodecError
from stagewire.protocols import Protocol
from stagewire_cli import completion
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.framings import framing_of
from stagewire_cli.protocols import PROTOCOL_HELP, choose_by_message
from stagewire_cli.values import parse_assignments, parse_value
from stagewire_conformance.framings import codec_of
from stagewire_conformance.notation import spaced
from stagewire_conformance.registry import registry_of

EXAMPLE = """\b
Examples:
  stagewire encode MOT_MOVE_ABSOLUTE --form data chan_ident=1 absolute_distance=200000
  stagewire encode MOT_MOVE_JOG --dest 0x22 chan_ident=CHAN1 direction=1
  stagewire encode WRITE_TARGET_POSITION --axis X target_position=100000
  stagewire encode READ_MOTOR_POSITION --form reply position=100000
"""

Json = dict[str, Any]


def encode(
    message: Annotated[
        str,
        typer.Argument(
            help="Name of the message in the registry.", autocompletion=completion.messages
        ),
    ],
    fields: Annotated[
        list[str] | None, typer.Argument(metavar="FIELD=VALUE...", help="Raw values or names.")
    ] = None,
    form: Annotated[
        str | None,
        typer.Option(
            "--form", help="header, data, data:dc, reply, ...; required if there are several."
        ),
    ] = None,
    dest: Annotated[
        str | None,
        typer.Option(
            "--dest", metavar="ADDRESS", help="Address of the receiver.  [default: see above]"
        ),
    ] = None,
    source: Annotated[
        str | None,
        typer.Option(
            "--source", metavar="ADDRESS", help="Address of the sender.  [default: see above]"
        ),
    ] = None,
    axis: Annotated[
        str | None, typer.Option("--axis", help="Axis of a command: a name or a number.")
    ] = None,
    address: Annotated[
        str | None,
        typer.Option("--address", metavar="ADDRESS", help="Address of the controller in a packet."),
    ] = None,
    allow_dummy: Annotated[
        bool, typer.Option("--allow-dummy", help="Also encode functions that the document forbids.")
    ] = False,
    refuse_prefix_bytes: Annotated[
        bool,
        typer.Option(
            "--refuse-prefix-bytes",
            help="Refuse values whose bytes look like a setup command.",
        ),
    ] = False,
    protocol: Annotated[
        str | None, typer.Option("--protocol", metavar="NAME", help=PROTOCOL_HELP)
    ] = None,
) -> None:
    """Encode a message and print its bytes in hex.

    Values are raw counts (200000 or 0x05), names of enumerations and flags (CONTINUOUS, a|b), text, hex for
    byte strings, or decimals (0.5 or 1e-9) for real numbers.

    The default addresses are those of the host and a single USB unit, in the direction of the message. A
    command has an axis instead of addresses; setup commands and replies have neither. A packet has the
    address of the controller if its protocol has addresses.
    """
    chosen = choose_by_message(protocol, message)
    options: Json = {"dest": dest, "source": source, "axis": axis, "address": address}
    options |= {"allow_dummy": allow_dummy, "refuse_prefix_bytes": refuse_prefix_bytes}
    name = _message(chosen, message)
    try:
        cls = chosen.message_class(name, form)
        entries = registry_of(chosen).fields(name, cls.layout.form)
        words = parse_assignments(fields or [])
        request: Json = {"message": name, "form": form or cls.layout.form}
        codec = codec_of(chosen)
        for key in ("data", "extra"):
            if key in words and key not in entries and key in codec.keys_of("encode"):
                request[key] = parse_value(key, words.pop(key), {"kind": "bytes"})
        request["fields"] = {
            key: parse_value(f"{name}.{key}", text, entries[key] if key in entries else _bare(key))
            for key, text in words.items()
        }
        given = {key: value for key, value in options.items() if value}
        if (framing := framing_of(chosen)) is not None:
            request |= framing.envelope(name, given)
        raw = codec.encode(request)
    except CodecError as error:
        raise CalledWronglyError(str(error)) from None
    typer.echo(spaced(raw))


def _message(protocol: Protocol, name: str) -> str:
    """Return the name of a message as in the registry, for an alias and for any case."""
    names = {known.lower(): known for known in registry_of(protocol).messages}
    names |= {alias.lower(): known for alias, known in protocol.aliases.items()}
    return names.get(name.lower(), name.upper())


def _bare(name: str) -> Json:
    """Return the kind of an unknown field; header parameters are integers."""
    return {} if name in ("param1", "param2") else {"kind": "text"}
