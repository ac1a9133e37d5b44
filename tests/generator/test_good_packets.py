"""The small good spec of packets, whose package works and which has every key; packets of other shapes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from checkout import ROOT
from files import write_files
from stagewire.errors import BadLengthError
from stagewire.protocols import Packet
from stagewire_conformance import run
from stagewire_generator import check, render
from stagewire_generator.diagnostics import Diagnostics, SpecError
from stagewire_generator.lint.witness.witness import compare_witness
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import load

Made = Callable[[dict[str, str]], Any]


@pytest.fixture
def made(tmp_path: Path, imported: Callable[[Path], Any]) -> Made:
    """Return a function that writes generated files and imports the package."""

    def write(files: dict[str, str]) -> Any:
        write_files(tmp_path / "made", files)
        return imported(tmp_path / "made")

    return write


@pytest.fixture
def carousel(packet_files: dict[str, str], made: Made) -> Any:
    """The generated package."""
    return made(packet_files)


def raw(package: Any, message: Any, address: int | None = None) -> str:
    """Return a packet with this message, in hex."""
    return str(Packet(message, address).encode().hex(" "))


def test_every_example_passes(carousel: Any) -> None:
    verdicts = run(carousel.PROTOCOL)
    assert {v.id: v.detail for v in verdicts if v.outcome not in ("passed", "noted")} == {}
    assert {v.outcome for v in verdicts} == {"passed", "noted"}  # prose is noted


def test_the_package_encodes_and_decodes(carousel: Any) -> None:
    """Cover numbers of 24 bits, texts, bytes, an enumeration, flags, a constant and scales."""
    m = carousel.messages
    turn = m.TableTurn(angle=-90000, way=carousel.enumerations.Way.FORWARD)
    assert raw(carousel, turn, 3) == "aa 55 06 03 13 70 a0 fe 01 85 ab 0d"
    assert carousel.decode(bytes.fromhex(raw(carousel, turn, 3))).message == turn
    place = carousel.decode(bytes.fromhex("aa 55 07 03 14 90 5f 01 02 80 04 75 0d"))
    assert (place.message, place.address) == (m.TablePlace(angle=90000, state=0x8002), 3)
    assert place.message.state_flags.at_home
    assert place.message.state_flags.too_hot
    assert m.WheelSelect(filter=2).pack() == b"\x02\x5a"
    names = m.WheelNames(count=2, first="Red", second="", serial=b"\1\2\3")
    assert m.WheelNames.unpack(names.pack()) == names
    assert carousel.quantities.ANGLE.to_counts(1) == 1000
    assert carousel.quantities.LIFT.to_counts(5) == 32


def test_a_request_of_a_set_has_no_payload(carousel: Any) -> None:
    assert raw(carousel, carousel.messages.TableReqSpeed(), 0) == "aa 55 02 00 11 ec a0 0d"
    shown = carousel.messages.TableReqSpeed.layout
    assert (shown.form, shown.fields, shown.length) == ("header", (), 0)


def test_the_length_distinguishes_layouts(carousel: Any) -> None:
    m = carousel.messages
    whole = m.TableTurnRepeated(angle=1, way=0, repeats=2, pause=3)
    for message, extra in ((whole, b""), (whole, b"\xff"), (m.TableTurn(1, 0), b"\1\2\3\4")):
        packet = carousel.decode(Packet(message, 1, extra).encode())
        assert (packet.message, packet.extra) == (message, extra)
    asked, told = m.TableWhereHeader(), m.TableWhere(angle=1, state=0)
    assert [carousel.decode(bytes.fromhex(raw(carousel, x, 1))).message for x in (asked, told)] == [
        asked, told,
    ]  # fmt: skip
    with pytest.raises(BadLengthError):
        carousel.decode(made_by_hand(0x13, b"\1\2\3"))


def made_by_hand(id: int, payload: bytes) -> bytes:
    """Return a packet of the carousel, built without the library."""
    body, crc = bytes([2 + len(payload), 1, id]) + payload, 0xFFFF
    for byte in body:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ (0x1021 if crc & 0x8000 else 0)) & 0xFFFF
    return b"\xaa\x55" + body + crc.to_bytes(2, "little") + b"\x0d"


# Packets of other shapes

HEAD = """\
protocol: spark
title: Sparks
summary: An invention, for tests only.
witness: false
document: {title: Sparks, issue: "1", date: Spring}
python: {package: stagewire_carousel}
formats: {u8: {size: 1, signed: false}, u16: {size: 2, signed: false}, u32: {size: 4, signed: false}}
"""
CHAPTER = """\
chapter: sparks
title: Sparks
page: 1
order: 1
messages:
  FLASH: {id: 0x07, page: 1, spelling: flash, direction: to_controller, effect: none, summary: x,
          data: {length: 3, fields: {colour: {format: u8}, length: {format: u16}}}}
  DARK: {id: 0x08, page: 1, spelling: dark, direction: both, effect: none, summary: x, header: {}}
"""
SHAPES = {
    "everything counted, exclusive or": (
        "order: [start, length, id, payload, check]\n  start: [0x1B]\n"
        "  length: {format: u8, counts: [start, length, id, payload, check]}\n  id: {format: u8}\n"
        "  check: {method: xor, format: u8, covers: [start, length, id, payload]}\n",
        "1b 07 07 01 02 03 1b",
        "1b 04 08 17",
    ),
    "twos' complement of a sum": (
        "order: [start, id, length, payload, check, end]\n  start: [0x01, 0x02]\n"
        "  length: {format: u16, counts: [payload]}\n  id: {format: u16}\n  end: [0x0D, 0x0A]\n"
        "  check: {method: sum, format: u8, complement: twos, covers: [id, length, payload]}\n",
        "01 02 07 00 03 00 01 02 03 f0 0d 0a",
        "01 02 08 00 00 00 f8 0d 0a",
    ),
    "a plain sum without an end": (
        "order: [start, length, id, payload, check]\n  start: [0x01]\n"
        "  length: {format: u8, counts: [payload]}\n  id: {format: u8}\n"
        "  check: {method: sum, format: u16, covers: [start, payload]}\n",
        "01 03 07 01 02 03 07 00",
        "01 00 08 01 00",
    ),
    "no check, an address of four bytes": (
        "order: [start, address, length, id, payload]\n  start: [0x55]\n  address: {format: u32}\n"
        "  length: {format: u8, counts: [payload, id]}\n  id: {format: u8}\n",
        "55 09 00 00 00 04 07 01 02 03",
        "55 09 00 00 00 01 08",
    ),
    "a reflected check of 32 bits": (
        "order: [start, length, id, payload, check]\n  start: [0x31]\n"
        "  length: {format: u8, counts: [payload]}\n  id: {format: u8}\n"
        "  check: {method: crc, format: u32, covers: [id, payload], polynomial: 0x04C11DB7,\n"
        "          initial: 0xFFFFFFFF, reflected: true, final: 0xFFFFFFFF}\n",
        "31 03 07 01 02 03 aa be 6e 16",  # zlib.crc32 of 07 01 02 03
        "31 00 08 bf 67 d9 dc",  # of 08
    ),
}  # fmt: skip


def sparks(folder: Path, framing: str) -> Protocol:
    """Return the protocol of sparks in packets of this shape."""
    (folder / "spark" / "messages").mkdir(parents=True)
    text = f"{HEAD}framing:\n  kind: packet\n  page: 1\n  maximum_length: 16\n  {framing}"
    (folder / "spark" / "protocol.yaml").write_text(text, encoding="utf-8")
    (folder / "spark" / "messages" / "sparks.yaml").write_text(CHAPTER, encoding="utf-8")
    return check(folder)[0]


@pytest.mark.parametrize("name", SHAPES)
def test_packets_of_other_shapes_are_encoded_and_decoded(
    tmp_path: Path, made: Made, name: str
) -> None:
    framing, flash, dark = SHAPES[name]
    package = made(render([sparks(tmp_path / "spec", framing)]))
    m, address = package.messages, 9 if "address" in framing else None
    for message, wanted in ((m.Flash(colour=1, length=0x0302), flash), (m.Dark(), dark)):
        assert raw(package, message, address) == wanted
        packet = package.decode(bytes.fromhex(wanted))
        assert (packet.message, packet.address, packet.extra) == (message, address, b"")


# Generated files


def definition(kind: str, *path: str) -> Any:
    part = json.loads((ROOT / f"spec/schema/{kind}.schema.json").read_text(encoding="utf-8"))
    for key in path:
        part = part[key]
    return part


def test_it_has_every_key_of_the_framing(good_packets: Path) -> None:
    text = (good_packets / "carousel" / "protocol.yaml").read_text(encoding="utf-8")
    shown = yaml.safe_load(text)["framing"]
    [packet] = [
        rule["then"]
        for rule in definition("protocol", "properties", "framing", "allOf")
        if rule["if"]["properties"]["kind"]["const"] == "packet"
    ]
    known = definition("protocol", "properties", "framing", "properties").keys()
    refused = {key for key, part in packet["properties"].items() if "not" in part}
    assert shown.keys() == known - refused
    keys = definition("protocol", "$defs", "check", "properties").keys()
    assert shown["check"].keys() == keys - {"complement"}


def test_the_registry_has_the_size_of_every_part(packet_files: dict[str, str]) -> None:
    data = json.loads(packet_files["python/stagewire_carousel/registry.json"])
    jsonschema.Draft202012Validator(definition("registry")).validate(data)
    framing = data["framing"]
    sizes = {part: framing[part]["size"] for part in ("length", "address", "id", "check")}
    assert sizes == {"length": 1, "address": 1, "id": 1, "check": 2}


def test_the_registry_states_the_default_complement(tmp_path: Path) -> None:
    """Readers of the registry do not need to know our defaults."""
    protocol = sparks(tmp_path, SHAPES["a plain sum without an end"][0])
    assert protocol.framing["check"]["complement"] == "none"


# The witness


def witness(folder: Path, protocol: Protocol, text: str) -> Any:
    path = folder / "printed.yaml"
    path.write_text(text, encoding="utf-8")
    document = load(path, path.name, Diagnostics())
    assert document is not None
    return document


PRINTED = """\
chapter: table
messages:
  TABLE_SET_SPEED:
    heading: {page: 2, line: 1, id: "0x11"}
    rows: [[Speed, u24], [Ramp, u8], [Not used, u8]]
    ranges: [{of: Speed, from: "0", to: "80000"}]
  TABLE_TURN:
    heading: {page: 2, line: 9, id: "0x0013"}
    rows: [[Angle, s24], [Way, u8]]
    values: [{of: Way, rows: [["0", x], ["1", y]]}]
"""


def test_packets_of_a_printed_document_are_compared(packets: Protocol, tmp_path: Path) -> None:
    """Cover headings with ids of two digits, field tables, ranges and lists of values."""
    comparison = compare_witness(packets, [witness(tmp_path, packets, PRINTED)])
    found = {p: (d.printed, d.encoded) for p, d in comparison.differences.items()}
    assert found == {
        "heading/TABLE_SET_SPEED/id": ("0x11", "0x10"),
        "rows/TABLE_SET_SPEED/ramp/format": ("u8", "u16"),
        "ranges/TABLE_SET_SPEED/speed/to": ("80000", "90000"),
        "heading/TABLE_TURN/id": ("0x0013", "0x13"),
        "values/TABLE_TURN/way/0x2": ("nothing", "backward"),
    }  # fmt: skip
    assert comparison.witnessed == {"TABLE_SET_SPEED", "TABLE_TURN"}
    assert comparison.misplaced == []


MISPLACED = {
    "tables": (
        "chapter: table\nmessages:\n  TABLE_HALT:\n    heading: {page: 2, line: 1, id: \"0x16\"}\n"
        "    tables: [{structure: 9}]\n",
        (5, "TABLE_HALT: byte tables of a header, which this framing does not have"),
    ),
    "addresses": (
        "chapter: lists\nlists: {}\naddresses: [[1, \"0x01\", Host]]\n",
        (3, "addresses of host and devices, which this framing does not have"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MISPLACED)
def test_parts_of_a_header_are_refused(packets: Protocol, tmp_path: Path, name: str) -> None:
    text, wanted = MISPLACED[name]
    comparison = compare_witness(packets, [witness(tmp_path, packets, text)])
    assert [(place.line, what) for place, what in comparison.misplaced] == [wanted]
    assert comparison.differences == {}


def test_a_witness_is_required_unless_the_protocol_declares_none(packets_spec: Path) -> None:
    path = packets_spec / "carousel" / "protocol.yaml"
    text = path.read_text(encoding="utf-8")
    assert check(packets_spec)
    path.write_text(text.replace("witness: false", "witness: true"), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(packets_spec)
    codes = [diagnostic.code for diagnostic in caught.value.diagnostics]
    assert codes == ["SW043"] * 13
