"""The layouts as data, and their round trips: all layouts of the registry in order, and no others."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path
from typing import Any

import pytest
from toolchain import C_WARNINGS, Package, compiles, need, of_each_package, packages, run
from vector_programs import build_round_trip, changed

from parts import first_of
from stagewire.protocols import Protocol, load_protocol
from stagewire_conformance.registry import Registry, registry_of

Json = dict[str, Any]

HERE = Path(__file__).parent
PROTOCOLS = {"stagewire_apt": "thorlabs_apt", "stagewire_ms2000": "asi_ms2000"}
FRAMES = {
    "message": 6,
    "command": 4,
    "setup": 2,
}  # number of bytes besides the data if a size is sent


def registry(package: Package) -> Registry:
    return registry_of(load_protocol(PROTOCOLS[package.name]))


def optional_fields(protocol: Protocol) -> dict[tuple[str, str], tuple[str, ...]]:
    """Return message and form -> the fields that a Python program may leave out."""
    layouts = [cls.layout for cls in protocol.messages]
    return {(layout.message, layout.form): layout.optional for layout in layouts}


def lines_of(message: Json, layout: Json, optional: Collection[str]) -> list[list[str]]:
    """Return the output of a program for a layout of the registry.

    :param optional: the fields that may be left out.
    """
    context, value = next(iter((layout["when"] or {}).items()), ("-", "-"))
    length = layout["length"]
    size = length if layout["form"] == "reply" else FRAMES[message["kind"]] + length
    if message["kind"] == "command" and layout["form"] == "request" and message["size"] is None:
        size -= 1
    numbers = [str(length), str(size)]
    head = [message["name"], layout["form"], message["kind"], str(message["id"]), context, value]
    fields = [(field["name"], field) for field in layout["fields"]]
    if layout["form"] == "header":
        fields = [(name, layout[name]) for name in ("param1", "param2")]
    lines = [field_line(name, field, optional) for name, field in fields]
    return [["layout", *head, *numbers], *lines]


def field_line(name: str, field: Json | None, optional: Collection[str]) -> list[str]:
    if field is None:
        return ["field", name, "1", "unsigned", "1", "1", "0", "0", "255"]
    kind, sign = field["kind"], "signed" if field["signed"] else "unsigned"
    size = field["array"]["item_size"] if kind == "array" else field["size"]
    kind = {"integer": sign, "array": f"{sign} array"}.get(kind, kind)
    assert field["name"] in optional or field["role"] == "value"
    numbers = (field["constant"] or 0, field["minimum"] or 0, field["maximum"] or 0)
    head = ["field", field["name"], str(size), kind, str(int(field["name"] in optional)), "0"]
    return [*head, *map(str, numbers)]


@of_each_package
def test_the_layouts_equal_those_of_the_registry(package: Package, tmp_path: Path) -> None:
    need("gcc")
    program = tmp_path / "layouts"
    sources = [HERE / "layouts_main.c", package.folder / "testing" / "layouts.c"]
    defines = [
        f'-DLAYOUTS_H="{package.name}/testing/layouts.h"',
        f"-DLAYOUTS={package.prefix}_layouts",
        f"-DCOUNT={package.prefix}_layout_count",
    ]
    include = f"-I{package.folder.parent}"
    compiles("gcc", "-std=c99", *C_WARNINGS, include, *defines, *sources, "-o", program)
    printed = [line.split("\t") for line in run(program).stdout.splitlines()]
    optional = optional_fields(load_protocol(PROTOCOLS[package.name]))
    assert printed == [
        line
        for message in registry(package).messages.values()
        if message["id"] is not None
        for layout in message["layouts"]
        for line in lines_of(message, layout, optional[message["name"], layout["form"]])
    ]


@of_each_package
def test_every_layout_has_a_round_trip(package: Package, tmp_path: Path) -> None:
    need("gcc")
    done = run(build_round_trip(package, tmp_path))
    assert (done.returncode, done.stdout) == (0, "")
    text = (package.folder / "testing" / "round_trip.c").read_text(encoding="utf-8")
    made = re.findall(r"^static size_t test_(\w+)\(void\)", text, re.MULTILINE)
    assert re.findall(r"failed \+= test_(\w+)\(\);", text) == made
    assert sorted(made) == package.layouts()
    named = [
        layout
        for message in registry(package).messages.values()
        for layout in message["layouts"]
        if message["id"] is not None
    ]
    assert len(made) == len(named)


# A change of a package, and the message of a round trip.
WRONG = {
    "reading": ("stagewire_ms2000/wire.h", "((uint32_t)bytes[2] << 16)", "0U",
                "message.position == content->position"),
    "writing": ("stagewire_ms2000/wire.h", "bytes[2] = (uint8_t)((value >> 16) & 0xFFU);",
                "bytes[2] = 0U;", "message.position == content->position"),
    "too short": ("stagewire_ms2000/wire.h", "return {P}_TOO_SHORT;", "return {P}_TRAILING;", "_TOO_SHORT"),
    "axis": ("stagewire_ms2000/wire.h", "axis != {P}_PREFIX", "axis != 0U", "_OUT_OF_RANGE"),
    "trailing": ("stagewire_ms2000/wire.h", "{P}_OK : {P}_TRAILING", "{P}_OK : {P}_OK", "_TRAILING"),
    "id": ("stagewire_apt/wire.h", "return {P}_WRONG_ID;", "return {P}_TRAILING;", "_WRONG_ID"),
    "room": ("stagewire_apt/messages/motor.h", "return {P}_NO_SPACE;", "return {P}_OK;", "_NO_SPACE"),
    "range": ("stagewire_apt/messages/motor.h", "return {P}_OUT_OF_RANGE;", "return {P}_OK;",
              "_OUT_OF_RANGE"),
    "length": ("stagewire_apt/wire.h", "return {P}_WRONG_LENGTH;", "return {P}_OK;", "_WRONG_LENGTH"),
}  # fmt: skip


SMALL = sum(ending.startswith("stagewire_ms2000") for ending, *_ in WRONG.values())


@pytest.mark.parametrize("wrong", first_of(WRONG, SMALL))
def test_errors_are_found(wrong: str, tmp_path: Path) -> None:
    need("gcc")
    ending, old, new, finds = WRONG[wrong]
    package = next(package for package in packages() if ending.startswith(package.name))
    old, new = (text.replace("{P}", package.prefix.upper()) for text in (old, new))
    done = run(build_round_trip(changed(package, tmp_path / "c", {ending: (old, new)}), tmp_path))
    assert done.returncode == 1
    assert re.search(rf"^test_\w+: .*{re.escape(finds)}", done.stdout, re.MULTILINE)
