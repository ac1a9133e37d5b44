"""Import generated packages and let every message go round; run as a program of its own.

Reads folders from standard input, one a line, and writes what is wrong with the package in each as one
JSON object. Nothing else may be printed, and nothing written: packages have no side effects.
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
from stagewire.message import Message, UndecidedMessage, UndocumentedMessage

sys.dont_write_bytecode = True


def main() -> None:
    before = list(sys.path)
    wrong = {}
    for line in sys.stdin.read().splitlines():
        [name] = [path.parent.name for path in Path(line).glob("*/__init__.py")]
        sys.path[:] = [line, *before]
        importlib.invalidate_caches()
        try:
            package = importlib.import_module(name)
            faults = list(look_at(package, Path(line)))
        except Exception:
            faults = [traceback.format_exc()]
        if faults:
            wrong[line] = "\n".join(faults)
        for module in [m for m in sys.modules if m.split(".")[0] == name]:
            del sys.modules[module]
    print(json.dumps(wrong))


def look_at(package: ModuleType, folder: Path) -> Iterator[str]:
    if not Path(str(package.__file__)).is_relative_to(folder):
        yield f"{package.__name__} was imported from elsewhere"
    for name in package.__all__:
        part = getattr(package, name)
        for exported in getattr(part, "__all__", ()):
            if isinstance(getattr(part, exported), ModuleType):
                yield f"{name}.{exported} is hidden by a module"
    for kind in package.messages.MESSAGES:
        if getattr(package.messages, kind.__name__) is not kind:
            yield f"{kind.__name__} is another class"
        for highest in (False, True):
            yield from round_trip(package, kind, highest)
    yield from registered(package)


def round_trip(package: ModuleType, kind: type[Message], highest: bool) -> Iterator[str]:
    made = example(kind, highest)
    raw = made.pack(0x50, 0x01)
    if kind.unpack(raw) != made:
        yield f"{made} comes back as {kind.unpack(raw)}"
    if set(made.values()) != set(kind.layout.fields):
        yield f"{kind.__name__} has other values than fields"
    if made.replace(**made.values()) != made or type(made).keep(made.values()) != made:
        yield f"{made} cannot be made again"
    frame = package.decode(raw, context=kind.layout.when)
    if type(frame.message).__name__.removesuffix("Undecided") not in kind.__name__:
        yield f"{made} is decoded as {frame.message}"
    if frame.message.pack(0x50, 0x01) != raw:
        yield f"{made} is packed otherwise once it was decoded"
    repr(made)
    for field in kind.layout.fields:
        if hasattr(kind, f"{field}_flags"):
            int(getattr(made, f"{field}_flags"))


def example(kind: type[Message], highest: bool) -> Any:
    if issubclass(kind, UndocumentedMessage):
        return kind(bytes(8))
    if issubclass(kind, UndecidedMessage):
        return kind(bytes([255 * highest]) * kind.layout.length)
    values = kind.unpack(bytes(6 + kind.layout.length)).values()  # the wire knows no ranges
    for field, value in values.items():
        if isinstance(value, str):
            values[field] = "é" if highest else ""
        elif isinstance(value, bytes):
            values[field] = bytes([255 * highest]) * len(value)
        else:
            values[field] = within(kind, values, field, highest)
    return kind(**values)


def within(kind: type[Message], values: dict[str, Any], field: str, highest: bool) -> int:
    """Return a value that the constructor takes for an integer field; it checks them in their order."""
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
    if names < {kind.layout.message for kind in package.messages.MESSAGES}:
        yield "the registry has fewer messages than the package"


if __name__ == "__main__":
    main()
