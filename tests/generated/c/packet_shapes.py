"""Packet protocols in different shapes, generated in Python and C, and compiled.

The messages are the same in all shapes: no payload, payloads of different lengths, integers of all sizes, a
text, bytes, and names that C or a package already uses.
"""

from __future__ import annotations

import ctypes
import importlib
import json
import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from testees import SANITIZERS, VERSION, Program, build
from toolchain import C_WARNINGS, Package, compiles

from checkout import SMALL_SPECS
from files import write_files
from invented_packets import SHAPES, framing_of
from stagewire.protocols import Crc, PacketProtocol, Shape, Sum, Xor
from stagewire_generator import TARGETS, check, render

CAROUSEL = "carousel"
SANITIZED = (CAROUSEL, "address behind the check", "bare")
MAXIMUM = 40

_ODD = {
    "address behind the check": Shape(
        order=("start", "id", "length", "payload", "check", "address", "end"),
        start=bytes(range(0xA0, 0xB0)), length=4, counts=("payload", "check"), id=4, maximum=600,
        address=4, check=Crc(8, 0x42F0E1EBA9EA3693, (1 << 64) - 1, True, (1 << 64) - 1),
        covers=("start", "payload", "address"), end=bytes(range(0x50, 0x60)),
    ),
    "crc of 24 bits": Shape(
        order=("start", "address", "length", "id", "payload", "check"),
        start=b"\x7e\x7e", length=3, counts=("payload",), id=3, maximum=MAXIMUM, address=3,
        check=Crc(3, 0x864CFB, 0xB704CE, False, 0), covers=("address", "length", "id", "payload"),
    ),
    "crc of 8 bits": Shape(
        order=("start", "length", "id", "payload", "address", "check"),
        start=b"\xff", length=1, counts=("length", "payload", "check"), id=1, maximum=MAXIMUM,
        address=3, check=Crc(1, 0x31, 0x5A, False, 0xA5), covers=("payload", "address"),
    ),
    "reflected crc of 40 bits": Shape(
        order=("start", "length", "id", "payload", "check", "end"),
        start=b"\x00", length=2, counts=("payload", "id"), id=2, maximum=MAXIMUM,
        check=Crc(5, 0x0004820009, 0x123456789A, True, 0xFF), covers=("length", "payload"), end=b"\x00",
    ),
    "crc of 56 bits": Shape(
        order=("start", "length", "id", "payload", "check"),
        start=b"\x01\x01\x02", length=1, counts=("payload",), id=1, maximum=MAXIMUM,
        check=Crc(7, 0x1B, 0, False, 0), covers=("start", "length", "id", "payload"),
    ),
    "check without the payload": Shape(
        order=("start", "id", "length", "payload", "check"),
        start=b"\x55", length=1, counts=("payload",), id=1, maximum=MAXIMUM,
        check=Xor(), covers=("id", "length"),
    ),
    "ones' complement of 8 bytes": Shape(
        order=("start", "id", "length", "payload", "address", "check"),
        start=b"\x55\xaa", length=1, counts=("payload",), id=1, maximum=MAXIMUM, address=1,
        check=Sum(8, "ones"), covers=("id", "payload"),
    ),
    "twos' complement of 6 bytes": Shape(
        order=("start", "id", "length", "payload", "check"),
        start=b"\x55\x55", length=1, counts=("payload",), id=1, maximum=MAXIMUM,
        check=Sum(6, "twos"), covers=("length", "payload"),
    ),
}  # fmt: skip
_HEAD = """\
protocol: NAME
title: Shapes
summary: An invention, for tests only.
witness: false
document: {title: Shapes, issue: "1", date: Spring}
python: {package: NAME}
formats:
  u8: {size: 1, signed: false}
  u16: {size: 2, signed: false}
  u24: {size: 3, signed: false}
  s24: {size: 3, signed: true}
  u32: {size: 4, signed: false}
  u40: {size: 5, signed: false}
  u48: {size: 6, signed: false}
  u56: {size: 7, signed: false}
  s64: {size: 8, signed: true}
  u64: {size: 8, signed: false}
  char: {size: 1, signed: false}
"""
_CHAPTER = """\
chapter: shapes
title: Shapes
page: 1
order: 1
messages:
  STOP: {id: 0x01, page: 1, direction: both, effect: none, summary: x, header: {}}
  SET_ANGLE: {id: 0x02, page: 1, direction: to_controller, effect: none, summary: x,
    data: {length: 6, fields: {angle: {format: s24, minimum: -180000, maximum: 180000}, speed: {format: u16},
    spare: {format: u8, role: reserved}}}}
  STATE:
    id: 0x03
    page: 1
    direction: both
    effect: none
    summary: x
    layouts:
      header: {}
      data_brief: {length: 2, fields: {bits: {format: u16}}}
      data_full: {length: 8, fields: {bits: {format: u16}, label: {format: "char[6]"}}}
  PAGE: {id: 0x0D, page: 1, direction: to_host, summary: x, data: {
    length: 32, fields: {page: {format: "u8[32]"}}}}
  NUMBERS: {id: 0x10, page: 1, direction: both, effect: none, summary: x, data: {length: 24, fields: {
    deep: {format: s64, maximum: 5}, wide: {format: u64, minimum: 9}, middle: {format: u32, maximum: 1000},
    three: {format: u24}, small: {format: u8, minimum: 3}}}}
  STATUS: {id: 0xFE, page: 1, direction: both, effect: none, summary: x,
    data: {length: 1, fields: {end: {format: u8}}}}
  NAME: {id: 0xFF, page: 1, direction: both, effect: none, summary: x, header: {}}
"""


def _framing(shape: Shape) -> str:
    """Return the framing of a shape as in ``protocol.yaml``."""
    said = framing_of(shape)
    for part in ("length", "id", "address", "check"):
        if part in said:
            said[part]["format"] = f"u{8 * said[part].pop('size')}"
    said |= {"page": 1, "maximum_length": max(shape.maximum, MAXIMUM)}
    return f"framing: {json.dumps(said)}\n"


FRAMINGS = {name: _framing(shape) for name, shape in {**SHAPES, **_ODD}.items()}
"""Name -> the framing as in the file of the protocol."""


@dataclass(frozen=True)
class Made:
    """One protocol in both languages."""

    folder: Path
    name: str
    package: Package
    is_sanitized: bool

    @cached_property
    def protocol(self) -> PacketProtocol:
        """The protocol object in Python."""
        sys.path.append(str(self.folder / "python"))
        try:
            made: PacketProtocol = importlib.import_module(self.package.name).PROTOCOL
        finally:
            sys.path.remove(str(self.folder / "python"))
        return made

    @cached_property
    def testee(self) -> Program:
        """The C testee; for some shapes, built with sanitizers."""
        flags = ["-O0", *(SANITIZERS if self.is_sanitized else ()), VERSION, *C_WARNINGS]
        return Program(self.name, [build(self.package, self.folder, *flags)])

    @cached_property
    def library(self) -> ctypes.CDLL:
        """The parser as a library."""
        made = self.folder / "parser.so"
        words = ["-std=c99", "-O1", "-shared", "-fPIC", *C_WARNINGS]
        compiles("gcc", *words, self.package.source, "-o", made)
        return ctypes.CDLL(str(made))

    def cases(self) -> list[dict[str, Any]]:
        """Return the cases of the protocol."""
        text = (self.folder / "vectors" / f"{self.name}.json").read_text(encoding="utf-8")
        found: list[dict[str, Any]] = json.loads(text)["cases"]
        return found


def make(name: str, folder: Path) -> Made:
    """Generate the protocol of a shape, or the carousel of the generator tests."""
    if name == CAROUSEL:
        spec = SMALL_SPECS / "good_packets"
    else:
        number = list(FRAMINGS).index(name)
        spec = _written(folder / "spec", f"shape{number}", FRAMINGS[name])
    [protocol] = check(spec)
    write_files(folder, render([protocol], TARGETS))
    return Made(folder, protocol.name, Package(folder / "c" / protocol.package), name in SANITIZED)


def _written(spec: Path, name: str, framing: str) -> Path:
    """Write the files of a protocol; return its folder."""
    (spec / name / "messages").mkdir(parents=True)
    head = _HEAD.replace("NAME", name) + framing
    (spec / name / "protocol.yaml").write_text(head, encoding="utf-8")
    (spec / name / "messages" / "shapes.yaml").write_text(_CHAPTER, encoding="utf-8")
    return spec
