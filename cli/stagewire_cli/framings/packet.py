"""Packets, which are the same in both directions and may have an address."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from stagewire.errors import CodecError
from stagewire.protocols import Check, Crc, Message, PacketProtocol, Shape, Sum
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.sinks import Column
from stagewire_cli.formats.task import MessageRows, Task, integer_type
from stagewire_cli.framings.framing import SEVERAL, Framing, Json, Options, message_class
from stagewire_cli.output import table
from stagewire_cli.values import parse_address
from stagewire_conformance.notation import spaced

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


class PacketTask(Task):
    """Packets, which may have an address."""

    protocol: PacketProtocol

    def __init__(self, protocol: PacketProtocol, only: type[Message] | None = None) -> None:
        super().__init__(protocol, {}, only)
        size = protocol.shape.address
        self.addresses = (Column("address", integer_type(False, size)),) if size else ()

    def hints(self, raw: bytes, error: CodecError) -> Iterator[str]:
        """Yield possible causes of the refusal of a packet."""
        start = raw.find(self.protocol.shape.start)
        if start > 0:
            yield f"the start of a packet is at byte {start}"
        elif error.code == "trailing":
            yield SEVERAL.format("packets")
        yield from self._in_others(raw)

    def typed_rows(self) -> MessageRows:
        """Return rows with the columns of the registry."""
        return MessageRows(self)


class PacketFraming(Framing):
    """The framing of a protocol of packets."""

    protocol: PacketProtocol

    def task(self, options: Options) -> PacketTask:
        """Return the decoding task for the options."""
        protocol = self.protocol
        options.refuse_commands(f"packets of {protocol.name} are the same in both directions")
        options.check_context(protocol)
        if options.message is None:
            return PacketTask(protocol)
        name, colon, form = options.message.partition(":")
        return PacketTask(
            protocol, message_class(protocol, "--message", name, form if colon else None)
        )

    def envelope(self, name: str, given: Json) -> Json:
        """Return the address of the controller, if packets have one."""
        protocol = self.protocol
        if not protocol.shape.address:
            self._refuse_others(given)
            return {}
        self._refuse_others(given, "address")
        if "address" not in given:
            raise CalledWronglyError(
                f"{name} requires the address of the controller; give it with --address"
            )
        return {"address": parse_address("--address", given["address"])}

    def show(self, out: Console, id: int) -> None:
        """Print the parts of the packets with an id."""
        out.print("\npacket with a payload of n bytes")
        out.print(parts_table(self.protocol.shape, id))


def parts_table(shape: Shape, id: int) -> Table:
    """Return a table of the parts of packets with this message id."""
    shown = table("offset", "part", "bytes", "holds", right=("offset", "bytes"))
    for offset, part, size, holds in _rows(shape, id):
        shown.add_row(offset, part, size, holds)
    return shown


def _rows(shape: Shape, id: int) -> Iterator[tuple[str, str, str, str]]:
    holds = {
        "start": spaced(shape.start),
        "length": f"number of bytes in {', '.join(shape.counts)}",
        "address": "address of the controller",
        "id": f"{id:#0{2 + 2 * shape.id}x}",
        "payload": f"the fields; at most {shape.maximum} bytes",
        "check": _check(shape),
        "end": spaced(shape.end),
    }
    behind = False
    for part in shape.order:
        offset = shape.place(part, 0).start
        size = "n" if part == "payload" else str(shape.sizes[part])
        yield f"{offset}+n" if behind else str(offset), part, size, holds[part]
        behind = behind or part == "payload"


def _check(shape: Shape) -> str:
    return "" if shape.check is None else f"{_method(shape.check)} of {', '.join(shape.covers)}"


def _method(check: Check) -> str:
    if isinstance(check, Crc):
        digits = 2 + 2 * check.size
        return (
            f"CRC (polynomial {check.polynomial:#0{digits}x}, initial {check.initial:#0{digits}x}, "
            f"{'reflected' if check.reflected else 'not reflected'}, final {check.final:#0{digits}x})"
        )
    if isinstance(check, Sum):
        return "sum" if check.complement == "none" else f"{check.complement}' complement of the sum"
    return "exclusive or"
