"""``stagewire encode``: a message and its fields to bytes in hex."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from stagewire.errors import CodecError
from stagewire.protocol import Protocol
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.protocols import PROTOCOL_HELP, choose
from stagewire_cli.values import parse_address, parse_assignments, parse_value
from stagewire_conformance.codec import encode_frame
from stagewire_conformance.hexes import spaced
from stagewire_conformance.registry import registry_of

__all__ = ["EXAMPLE", "encode"]

EXAMPLE = """\b
Examples:
  stagewire encode MOT_MOVE_ABSOLUTE --form data chan_ident=1 absolute_distance=200000
  stagewire encode MOT_MOVE_JOG --dest 0x22 chan_ident=CHAN1 direction=1
"""

Json = dict[str, Any]


def encode(
    message: Annotated[str, typer.Argument(help="Name of the message in the registry.")],
    fields: Annotated[
        list[str] | None, typer.Argument(metavar="FIELD=VALUE...", help="Raw values or names.")
    ] = None,
    form: Annotated[
        str | None,
        typer.Option("--form", help="header, data, data:dc ...; where there are several."),
    ] = None,
    dest: Annotated[
        str | None, typer.Option("--dest", help="Address of the receiver.  [default: see below]")
    ] = None,
    source: Annotated[
        str | None, typer.Option("--source", help="Address of the sender.  [default: see below]")
    ] = None,
    protocol: Annotated[str | None, typer.Option("--protocol", help=PROTOCOL_HELP)] = None,
) -> None:
    """Encode a message and print its bytes in hex. Every value is checked; nothing is sent.

    Values are raw counts: integers, 0x05, names of enumerations and flags (CONTINUOUS, a|b), text,
    or hex for byte strings. Without addresses the message goes between the host and a single USB
    unit, in its own direction.
    """
    chosen = choose(protocol)
    name = _message(chosen, message)
    try:
        cls = chosen.message_class(name, form)
        entries = registry_of(chosen).fields(name, cls.layout.form)
        words = parse_assignments(fields or [])
        request: Json = {"message": name, "form": cls.layout.form}
        for key in ("data", "extra"):
            if key in words and key not in entries:
                request[key] = parse_value(key, words.pop(key), {"kind": "bytes"})
        request["fields"] = {
            key: parse_value(f"{name}.{key}", text, entries[key] if key in entries else _bare(key))
            for key, text in words.items()
        }
        request |= _addresses(chosen, name, dest, source)
        raw = encode_frame(chosen, request).encode()
    except CodecError as error:
        raise CalledWronglyError(str(error)) from None
    typer.echo(spaced(raw))


def _message(protocol: Protocol, name: str) -> str:
    """Return the message as the registry spells it, whatever the case."""
    names = {known.lower(): known for known in registry_of(protocol).messages}
    return names.get(name.lower(), name.upper())


def _bare(name: str) -> Json:
    """Return how a name that no field has is read: header parameters are integers."""
    return {} if name in ("param1", "param2") else {"kind": "text"}


def _addresses(protocol: Protocol, name: str, dest: str | None, source: str | None) -> Json:
    """Return both addresses; a single unit on USB has the highest of all."""
    ends = [max(protocol.devices), protocol.host]
    if registry_of(protocol).messages[name].get("direction") == "to_host":
        ends.reverse()
    return {
        "dest": ends[0] if dest is None else parse_address("--dest", dest),
        "source": ends[1] if source is None else parse_address("--source", source),
    }
