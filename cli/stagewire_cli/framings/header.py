"""Frames with a header, which say themselves which way they go."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from stagewire.errors import CodecError, UnknownMessageError
from stagewire.protocols import DATA_FLAG, HEADER_SIZE, FramedProtocol, Message, UndecidedMessage
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.sinks import Column
from stagewire_cli.formats.task import FrameRows, Task
from stagewire_cli.framings.framing import SEVERAL, Framing, Json, Options, message_class
from stagewire_cli.values import context_option, parse_address
from stagewire_conformance.registry import registry_of


class FramedTask(Task):
    """Frames with a header.

    :param context: selects between layouts that have the same bytes.
    """

    protocol: FramedProtocol
    addresses = (Column("dest", "uint8"), Column("source", "uint8"))

    def __init__(
        self,
        protocol: FramedProtocol,
        context: Mapping[str, str] | None = None,
        only: type[Message] | None = None,
    ) -> None:
        super().__init__(protocol, {"context": context} if context else {}, only)

    def hints(self, raw: bytes, error: CodecError) -> Iterator[str]:
        """Yield possible causes of the refusal of a frame."""
        if type(error) is UnknownMessageError:
            ids = {cls.layout.id: cls.layout.message for cls in self.protocol.messages}
            turned = raw[0] << 8 | raw[1]
            if turned in ids:
                yield (
                    f"{turned:#06x} is {ids[turned]}; ids have the low byte first: "
                    f"{raw[1]:02X} {raw[0]:02X}"
                )
        elif _lacks_flag(raw):
            yield (
                f"bytes 2 and 3 match the {len(raw) - HEADER_SIZE} bytes after the header: byte 4 seems to "
                f"lack the bit of a data packet ({raw[4] | DATA_FLAG:#04x})"
            )
        elif error.code == "trailing":
            yield SEVERAL.format("frames")
        yield from self._in_others(raw)

    def typed_rows(self) -> FrameRows:
        """Return rows that use the columns of the library."""
        assert self.only is not None
        return FrameRows(self, self.protocol)


class HeaderFraming(Framing):
    """The framing of a protocol whose frames have a header."""

    protocol: FramedProtocol

    def task(self, options: Options) -> FramedTask:
        """Return the decoding task for the options."""
        protocol = self.protocol
        options.refuse_commands(f"frames of {protocol.name} contain their direction")
        context = options.context
        options.check_context(protocol)
        if options.message is None:
            return FramedTask(protocol, context)
        only = _wanted(protocol, options.message, context or {})
        return FramedTask(protocol, _agreed(only, context), only)

    def envelope(self, name: str, given: Json) -> Json:
        """Return both addresses; by default that of a single USB unit, which is the highest."""
        protocol = self.protocol
        self._refuse_others(given, "dest", "source")
        ends = [max(protocol.devices), protocol.host]
        if registry_of(protocol).messages[name].get("direction") == "to_host":
            ends.reverse()
        return {
            key: parse_address(f"--{key}", given[key]) if key in given else end
            for key, end in zip(("dest", "source"), ends, strict=True)
        }


def _lacks_flag(raw: bytes) -> bool:
    """Return whether this would be a data frame if byte 4 had the bit of a packet."""
    following = len(raw) - HEADER_SIZE
    return following > 0 and not raw[4] & DATA_FLAG and raw[2] | raw[3] << 8 == following


def _wanted(protocol: FramedProtocol, text: str, context: Mapping[str, str]) -> type[Message]:
    name, colon, form = text.partition(":")
    if not colon:
        for cls in protocol.messages:
            layout = cls.layout
            named = layout.message.lower() == name.lower()
            if named and layout.when and layout.when.items() <= context.items():
                return cls
    found: type[Message] = message_class(protocol, "--message", name, form if colon else None)
    return found


def _agreed(only: type[Message], context: dict[str, str] | None) -> dict[str, str] | None:
    """Return the context that gives frames the selected layout; raise if the options contradict it."""
    layout = only.layout
    if context and issubclass(only, UndecidedMessage):
        raise CalledWronglyError(f"--message: the form {layout.form} excludes {_spelled(context)}")
    if not layout.when:
        return context
    if context and not layout.when.items() <= context.items():
        said = _spelled(context)
        raise CalledWronglyError(f"--message: the form {layout.form} contradicts {said}")
    return {**layout.when, **(context or {})}


def _spelled(context: Mapping[str, str]) -> str:
    """Return a context as options."""
    return ", ".join(context_option(name, value) for name, value in context.items())
