"""Import generated packages, and encode and decode every message. This is a separate program.

It reads folders from standard input, one per line, and prints the problems of the packages in each folder as
one JSON object. The packages must not print anything else or write files.
"""

from __future__ import annotations

import importlib
import json
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from stagewire.errors import OutOfRangeError
from stagewire.protocols import (
    Command,
    CommandFrame,
    CommandProtocol,
    CountedMessage,
    FramedMessage,
    Message,
    Packet,
    PacketMessage,
    PacketProtocol,
    Reply,
    SetupCommand,
    UndecidedMessage,
    UndocumentedMessage,
)

sys.dont_write_bytecode = True


AXIS = 1
# bytes before the fields
HEAD = {
    FramedMessage: 6,
    CountedMessage: 6,
    Command: 3,
    Reply: 0,
    SetupCommand: 2,
    PacketMessage: 0,
}


def main() -> None:
    before = list(sys.path)
    wrong = {}
    for line in sys.stdin.read().splitlines():
        names = sorted(path.parent.name for path in Path(line).glob("*/__init__.py"))
        sys.path[:] = [line, *before]
        importlib.invalidate_caches()
        try:
            faults = [f for name in names for f in look_at(importlib.import_module(name), line)]
            faults += [] if names else ["package not found"]
        except Exception:
            faults = [traceback.format_exc()]
        if faults:
            wrong[line] = "\n".join(faults)
        for module in [m for m in sys.modules if m.split(".")[0] in names]:
            del sys.modules[module]
    print(json.dumps(wrong))


def look_at(package: ModuleType, folder: str) -> Iterator[str]:
    if not Path(str(package.__file__)).is_relative_to(folder):
        yield f"{package.__name__} was imported from elsewhere"
    for name in package.__all__:
        part = getattr(package, name)
        for exported in getattr(part, "__all__", ()):
            if isinstance(getattr(part, exported), ModuleType):
                yield f"{name}.{exported} is hidden by a module"
    for kind in package.messages.MESSAGES:
        if getattr(package.messages, kind.__name__) is not kind:
            yield f"{kind.__name__} names another class"
        for highest in (False, True):
            yield from round_trip(package, kind, highest)
    if isinstance(package.PROTOCOL, CommandProtocol):
        yield from streamed(package.PROTOCOL)
    if isinstance(package.PROTOCOL, PacketProtocol):
        yield from streamed_packets(package.PROTOCOL)
    yield from registered(package)


def round_trip(package: ModuleType, kind: type[Message], highest: bool) -> Iterator[str]:
    made = example(kind, highest)
    raw = packed(made)
    if kind.unpack(raw) != made:
        yield f"{made} is unpacked as {kind.unpack(raw)}"
    if set(made.values()) != set(kind.layout.fields):
        yield f"the values of {kind.__name__} do not match its fields"
    if made.replace(**made.values()) != made or type(made).keep(made.values()) != made:
        yield f"{made} cannot be rebuilt from its values"
    decoded = decode(package, made, raw)
    if type(decoded).__name__.removesuffix("Undecided") not in kind.__name__:
        yield f"{made} is decoded as {decoded}"
    if packed(decoded) != raw:
        yield f"{made} is packed differently after decoding"
    repr(made)
    for field in kind.layout.fields:
        if hasattr(kind, f"{field}_flags"):
            int(getattr(made, f"{field}_flags"))


def packed(message: Message) -> bytes:
    if isinstance(message, FramedMessage):
        return message.pack(0x50, 0x01)
    if isinstance(message, Command):
        return message.pack(AXIS, allow_dummy=True)
    assert isinstance(message, Reply | SetupCommand | PacketMessage)
    return message.pack()


def decode(package: ModuleType, made: Message, raw: bytes) -> Any:
    if isinstance(made, FramedMessage):
        return package.decode(raw, context=made.layout.when).message
    if isinstance(made, Reply):
        return package.PROTOCOL.decode_reply(raw, made.layout.message)
    if isinstance(made, PacketMessage):
        return package.decode(in_packet(package.PROTOCOL, made).encode()).message
    return package.decode(raw).message


def streamed(protocol: CommandProtocol) -> Iterator[str]:
    """Check a stream of all commands, in both forms."""
    frames = []
    for kind in protocol.messages:
        if issubclass(kind, Command):
            made = example(kind, True)
            frames += [CommandFrame(made, AXIS, sized=True)]
            frames += [] if kind.layout.length else [CommandFrame(made, AXIS, sized=False)]
        elif issubclass(kind, SetupCommand):
            frames.append(CommandFrame(kind()))
    stream = b"".join(frame.encode(allow_dummy=True) for frame in frames)
    found = [getattr(event, "frame", event) for event in protocol.framer().feed(stream)]
    if found != frames:
        yield f"a stream of {frames} is read as {found}"


def in_packet(protocol: PacketProtocol, message: PacketMessage) -> Packet:
    return Packet(message, AXIS if protocol.shape.address else None)


def streamed_packets(protocol: PacketProtocol) -> Iterator[str]:
    """Check a stream of all messages."""
    packets = [in_packet(protocol, example(kind, True)) for kind in protocol.messages]
    stream = b"".join(packet.encode() for packet in packets)
    found = [getattr(event, "packet", event) for event in protocol.framer().feed(stream)]
    if found != packets:
        yield f"a stream of {packets} is read as {found}"


def example(kind: type[Message], highest: bool) -> Any:
    if issubclass(kind, UndocumentedMessage):
        return kind(bytes(8))
    if issubclass(kind, UndecidedMessage):
        return kind(bytes([255 * highest]) * kind.layout.length)
    values = kind.unpack(bytes(HEAD[kind.__base__] + kind.layout.length)).values()
    for field, value in values.items():
        if isinstance(value, str):
            values[field] = "é" if highest else ""
        elif isinstance(value, bytes):
            values[field] = bytes([255 * highest]) * len(value)
        elif issubclass(kind, CountedMessage) and field == kind.counted.name:
            count = values[kind.counted.rows] * kind.counted.width(values)
            values[field] = (int(highest),) * count
        else:
            values[field] = within(kind, values, field, highest)
    return kind(**values)


def within(kind: type[Message], values: dict[str, Any], field: str, highest: bool) -> int:
    """Return a value that the constructor accepts for an integer field. It checks the fields in order."""
    for number in (255, 127, 4, 1, 0) if highest else (0, 1):
        try:
            kind(**{**values, field: number})
        except OutOfRangeError as error:
            if f".{field} " in str(error):
                continue
        return number
    return 0


def registered(package: ModuleType) -> Iterator[str]:
    names = {message["name"] for message in package.PROTOCOL.registry()["messages"]}
    if not names >= {kind.layout.message for kind in package.messages.MESSAGES}:
        yield "the registry has fewer messages than the package"


if __name__ == "__main__":
    main()
