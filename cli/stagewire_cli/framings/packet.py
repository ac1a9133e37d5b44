"""Packets, which look alike both ways and may have an address."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire.errors import CodecError
from stagewire.protocols import Message, PacketProtocol
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.sinks import Column
from stagewire_cli.formats.task import MessageRows, Task, integer_type
from stagewire_cli.framings.framing import SEVERAL, Framing, Json, Options, message_class
from stagewire_cli.values import parse_address


class PacketTask(Task):
    """Packets, which may have an address."""

    protocol: PacketProtocol

    def __init__(self, protocol: PacketProtocol, only: type[Message] | None = None) -> None:
        super().__init__(protocol, {}, only)
        size = protocol.shape.address
        self.addresses = (Column("address", integer_type(False, size)),) if size else ()

    def hints(self, raw: bytes, error: CodecError) -> Iterator[str]:
        """Yield what may be behind the refusal of a packet."""
        start = raw.find(self.protocol.shape.start)
        if start > 0:
            yield f"the bytes that begin a packet stand at byte {start}"
        elif error.code == "trailing":
            yield SEVERAL.format("packets")
        yield from self._in_others(raw)

    def typed_rows(self) -> MessageRows:
        """Return rows with the columns that the registry gives."""
        return MessageRows(self)


class PacketFraming(Framing):
    """The framing of a protocol of packets."""

    protocol: PacketProtocol

    def task(self, options: Options) -> PacketTask:
        """Return what is to be decoded."""
        protocol = self.protocol
        options.refuse_commands(f"packets of {protocol.name} look alike both ways")
        if options.status is not None:
            options.check_context(protocol, {"status": options.status})
        if options.message is None:
            return PacketTask(protocol)
        name, colon, form = options.message.partition(":")
        return PacketTask(
            protocol, message_class(protocol, "--message", name, form if colon else None)
        )

    def envelope(self, name: str, given: Json) -> Json:
        """Return the address of the controller, where packets have one."""
        protocol = self.protocol
        if not protocol.shape.address:
            self._refuse_others(given)
            return {}
        self._refuse_others(given, "address")
        if "address" not in given:
            raise CalledWronglyError(
                f"{name} lacks the address of the controller; give it by --address"
            )
        return {"address": parse_address("--address", given["address"])}
