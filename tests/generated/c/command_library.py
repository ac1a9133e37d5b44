"""The C code of a command protocol, compiled to a library and called from Python, next to the Python code."""

from __future__ import annotations

import ctypes
import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from command_readers import Reader, Replies
from toolchain import C, Package, compiles, need

from checkout import SMALL_SPECS
from files import write_files
from stagewire.protocols import Command, CommandProtocol, Message, Reply, SetupCommand
from stagewire_generator import check, render
from stagewire_ms2000 import PROTOCOL

REFUSALS = {
    "TOO_SHORT": "truncated",
    "TRAILING": "trailing",
    "WRONG_ID": "unknown_message",
    "WRONG_LENGTH": "bad_length",
    "OUT_OF_RANGE": "out_of_range",
    "DUMMY": "unsupported",
}
"""Status in C -> error code of the testee protocol; other statuses have none."""
_OTHERS = ("OK", "NO_SPACE", "OUTSTANDING", "POISONED")
_ROOM = 512


class Entry(ctypes.Structure):
    """An entry of the table."""

    _fields_ = (
        ("reply_length", ctypes.c_uint16),
        ("id", ctypes.c_uint8),
        ("kind", ctypes.c_uint8),
        ("size_slot", ctypes.c_uint8),
        ("length", ctypes.c_uint8),
    )


class CommandLibrary:
    """One protocol in Python and in C.

    :param protocol: the Python protocol object.
    :param registry: its resolved registry.
    :param c: the folder of the C code of all packages.
    :param folder: the folder for compiling.
    :param flags: flags for the compiler.
    """

    def __init__(
        self, protocol: CommandProtocol, registry: Any, c: Path, folder: Path, *flags: str
    ) -> None:
        need("gcc")
        self.protocol = protocol
        self.package = protocol.package
        self._functions = set(Package(c / self.package).functions())
        self.prefix = self.package.removeprefix("stagewire_")
        self.messages: dict[str, Any] = {m["name"]: m for m in registry["messages"]}
        self._structs = dict(self._make_structs())
        source = folder / "calls.c"
        source.write_text("\n".join(self._source()), encoding="utf-8")
        library = folder / "calls.so"
        words = ["gcc", "-std=c99", "-O1", "-shared", "-fPIC", "-I", c, *flags, "-o", library]
        compiles(*words, source, c / self.package / f"{self.package}.c")
        self.c = ctypes.CDLL(str(library))
        self.c.call_name_of_status.restype = ctypes.c_char_p
        self._statuses = {
            i: self.c.call_name_of_status(i).decode() for i in range(len(REFUSALS) + len(_OTHERS))
        }

    # Declarations

    def layouts(self) -> Iterator[type[Message]]:
        """Yield the classes of all commands, setup commands and replies."""
        yield from self.protocol.messages

    def fields(self, cls: type[Message]) -> list[Any]:
        layouts = self.messages[cls.layout.message]["layouts"]
        [fields] = [x["fields"] for x in layouts if x["form"] == cls.layout.form]
        return list(fields)

    def type(self, cls: type[Message]) -> str:
        """Return the name of the type in C."""
        name = f"{self.prefix}_{cls.layout.message.lower()}"
        name = f"{name}_reply" if issubclass(cls, Reply) else name
        return name if f"{name}_decode" in self._functions else f"{name}_message"

    def macro(self, cls: type[Message], name: str) -> int:
        """Return the value of ``ID``, ``SIZE``, ``LENGTH`` or ``SIZE_SLOT``, if there is one."""
        return int(getattr(self.c, f"{self.type(cls)}_{name}")())

    def _make_structs(self) -> Iterator[tuple[type[Message], type[ctypes.Structure]]]:
        for cls in self.protocol.messages:
            members = [(field["name"], _member(field)) for field in self.fields(cls)]
            yield cls, type(self.type(cls), (ctypes.Structure,), {"_fields_": members})

    def _source(self) -> Iterator[str]:
        """Yield lines that define ordinary functions for the inline functions."""
        p = self.prefix
        capitals = p.upper()
        yield f'#include "{self.package}/{self.package}.h"'
        yield "const char *call_name_of_status(int status)\n{\n    switch (status) {"
        for name in (*REFUSALS, *_OTHERS):
            yield f'    case {capitals}_{name}: return "{name}";'
        yield '    default: return "?";\n    }\n}'
        for cls in self.protocol.messages:
            yield from self._calls(cls)
            macros = ["SIZE", *([] if issubclass(cls, Reply) else ["ID"])]
            macros += [] if issubclass(cls, SetupCommand) else ["LENGTH"]
            macros += ["SIZE_SLOT"] if issubclass(cls, Command) else []
            for macro in macros:
                of = f"{p}_{cls.layout.message}" if macro == "ID" else self.type(cls)
                yield f"unsigned {self.type(cls)}_{macro}(void) {{ return {of.upper()}_{macro}; }}"
        yield f"""
bool call_holds_setup(const uint8_t *command, size_t size)
{{ return {p}_holds_setup(command, size); }}
int call_give_size(uint8_t number, uint8_t *command, size_t *size, size_t cap)
{{ return {p}_give_size(number, command, size, cap); }}
int call_leave_size_out(uint8_t *command, size_t *size)
{{ return {p}_leave_size_out(command, size); }}
int call_append(const uint8_t *extra, size_t extra_size, uint8_t *command, size_t *size, size_t cap)
{{ return {p}_append_extra(extra, extra_size, command, size, cap); }}
"""

    def _calls(self, cls: type[Message]) -> Iterator[str]:
        name = self.type(cls)
        has_fields = bool(cls.layout.fields)
        axis = issubclass(cls, Command)
        wanted = ["const void *message", "uint8_t axis", "uint8_t *out", "size_t cap"]
        given = [*(["message"] if has_fields else []), *(["axis"] if axis else []), "out", "cap"]
        for suffix in ("", "_unchecked"):
            called = name + ("_encode" if issubclass(cls, SetupCommand) else f"_encode{suffix}")
            yield f"int call_{name}_encode{suffix}({', '.join(wanted)})"
            yield f"{{ (void)message; (void)axis; return {called}({', '.join(given)}); }}"
        given = ["bytes", "size", *(["message"] if has_fields else [])]
        yield f"int call_{name}_decode(const uint8_t *bytes, size_t size, void *message)"
        yield f"{{ (void)message; return {name}_decode({', '.join(given)}); }}"

    # Typed functions

    def encode(
        self, message: Message, axis: int = 0, *, checked: bool = True, cap: int = _ROOM
    ) -> tuple[str, bytes]:
        """Return the status and the bytes, empty on an error; check that nothing else is written."""
        given = self._structs[type(message)]()
        for field in self.fields(type(message)):
            value = getattr(message, field["name"])
            if field["kind"] == "text":
                value = value.encode("latin-1")
            if isinstance(value, bytes):
                member = getattr(given, field["name"])
                ctypes.memmove(member, value, len(value))
            else:
                setattr(given, field["name"], value)
        out = ctypes.create_string_buffer(b"\xa5" * (_ROOM + 1))
        suffix = "" if checked else "_unchecked"
        function = getattr(self.c, f"call_{self.type(type(message))}_encode{suffix}")
        size = ctypes.c_size_t(cap)
        status = self._statuses[function(ctypes.byref(given), axis, out, size)]
        written = self.macro(type(message), "SIZE")
        taken = written if status == "OK" else 0
        assert set(out.raw[taken : _ROOM + 1]) == {0xA5}
        return status, out.raw[:taken]

    def decode(self, cls: type[Message], raw: bytes) -> tuple[str, dict[str, Any] | None]:
        """Return the status and the fields, None on an error; check that the struct is unchanged then."""
        struct = self._structs[cls]
        into = struct()
        size = ctypes.sizeof(struct)
        ctypes.memset(ctypes.byref(into), 0xA5, size)
        status = self._statuses[
            getattr(self.c, f"call_{self.type(cls)}_decode")(
                raw, ctypes.c_size_t(len(raw)), ctypes.byref(into)
            )
        ]
        if status != "OK":
            assert bytes(into) == b"\xa5" * size
            return status, None
        values: dict[str, Any] = {}
        for field in self.fields(cls):
            value = getattr(into, field["name"])
            if field["kind"] != "integer":
                value = bytes(value)
            if field["kind"] == "text":
                value = value.rstrip(b"\0").decode("latin-1")
            values[field["name"]] = value
        return status, values

    # Forms

    def sized(self, number: int, raw: bytes, cap: int = _ROOM) -> tuple[str, bytes]:
        """Return a command with its size slot."""
        return self._changed(raw, lambda *it: self.c.call_give_size(number, *it, cap))

    def unsized(self, raw: bytes) -> tuple[str, bytes]:
        """Return a command without its size slot."""
        return self._changed(raw, self.c.call_leave_size_out)

    def appended(self, raw: bytes, extra: bytes, cap: int = _ROOM) -> tuple[str, bytes]:
        """Return a command with ignored bytes."""
        count = ctypes.c_size_t(len(extra))
        return self._changed(
            raw, lambda *it: self.c.call_append(extra, count, *it, ctypes.c_size_t(cap))
        )

    def _changed(self, raw: bytes, change: Any) -> tuple[str, bytes]:
        room = ctypes.create_string_buffer(raw, _ROOM)
        size = ctypes.c_size_t(len(raw))
        status = self._statuses[change(room, ctypes.byref(size))]
        return status, room.raw[: size.value]

    def holds_setup(self, raw: bytes) -> bool:
        """Return whether a command holds the two bytes of a setup command."""
        function = self.c.call_holds_setup
        function.restype = ctypes.c_bool
        return bool(function(raw, ctypes.c_size_t(len(raw))))

    # Table

    def identify(self, raw: bytes) -> tuple[str, str | None]:
        """Return the status of identifying bytes as a command, and the name of the command."""
        entry = ctypes.POINTER(Entry)()
        function = self.function("identify_command")
        status = function(raw, ctypes.c_size_t(len(raw)), ctypes.byref(entry))
        return self._statuses[status], self.name(entry) if entry else None

    def find(self, raw: bytes) -> Any:
        """Return the entry of a command by its first bytes; a null pointer is false."""
        function = self.function("entry_of")
        function.restype = ctypes.POINTER(Entry)
        return function(raw)

    def name(self, entry: Any) -> str | None:
        """Return the name of an entry."""
        function = self.function("entry_name")
        function.restype = ctypes.c_char_p
        found = function(entry)
        return None if found is None else found.decode()

    def table(self) -> list[Any]:
        """Return pointers to the entries of the table."""
        count = ctypes.c_size_t.in_dll(self.c, f"{self.prefix}_table_count").value
        return [ctypes.pointer(it) for it in (Entry * count).in_dll(self.c, f"{self.prefix}_table")]

    def function(self, name: str) -> Any:
        """Return a function that is not inline."""
        return getattr(self.c, f"{self.prefix}_{name}")

    # Streams

    def parser(self) -> Reader:
        """Return a new parser of commands."""
        return Reader(self.function, "parser")

    def replies(self) -> Replies:
        """Return a new reader of replies."""
        return Replies(self.function, self._statuses)


def _member(field: Any) -> Any:
    if field["kind"] != "integer":
        return ctypes.c_uint8 * field["size"]
    bits = max(8, 1 << (8 * field["size"] - 1).bit_length())
    return getattr(ctypes, f"c_{'' if field['signed'] else 'u'}int{bits}")


def make_library(folder: Path, *flags: str) -> CommandLibrary:
    """Make the library of the MS-2000."""
    return CommandLibrary(PROTOCOL, PROTOCOL.registry(), C, folder, *flags)


def make_turtle(folder: Path, *flags: str) -> CommandLibrary:
    """Make the library of a protocol of the tests, with texts, constants and other special bytes."""
    write_files(folder, render([check(SMALL_SPECS / "good_commands")[0]]))
    sys.path.insert(0, str(folder / "python"))
    try:
        protocol = importlib.import_module("stagewire_turtle").PROTOCOL
    finally:
        sys.path.pop(0)
        for name in [name for name in sys.modules if name.startswith("stagewire_turtle")]:
            del sys.modules[name]
    registry = json.loads(
        (folder / "python/stagewire_turtle/registry.json").read_text(encoding="utf-8")
    )
    return CommandLibrary(protocol, registry, folder / "c", folder, *flags)
