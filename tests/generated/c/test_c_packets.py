"""Packets in C in every shape: they compile and behave like Python for any input."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from random import Random

import pytest
from all_declarations import everything
from packet_parser import Parser, PythonParser, Seen, joined
from packet_shapes import CAROUSEL, FRAMINGS, Made, make
from testees import Json, lines
from toolchain import C_WARNINGS, CORTEX_M0, WARNINGS, compiles, need, run, symbols
from vector_programs import build_round_trip, build_vectors, findings_of

from checkout import ROOT
from parts import first_of
from stagewire_conformance.framings import codec_of
from stagewire_conformance.testee import Testee

STREAMS = 60  # of each shape
DAMAGED = 40  # requests of each shape
LANGUAGES = first_of([("gcc", "c99"), ("clang", "c17"), ("g++", "c++17")])
SMALL = ["clang", "--target=msp430", "-std=c99"]  # int and size_t have 16 bits


@pytest.fixture(scope="session")
def shapes(tmp_path_factory: pytest.TempPathFactory) -> object:
    """Make each shape on first use."""
    return cache(lambda name: make(name, tmp_path_factory.mktemp("shape")))


@pytest.fixture(params=first_of([CAROUSEL, *FRAMINGS]))
def made(request: pytest.FixtureRequest, shapes: object) -> Made:
    """One protocol."""
    need("gcc")
    found: Made = shapes(request.param)  # type: ignore[operator]
    return found


# Compiled


@pytest.mark.parametrize(("compiler", "standard"), LANGUAGES)
def test_headers_and_sources_compile(
    made: Made, compiler: str, standard: str, tmp_path: Path
) -> None:
    need(compiler)
    cpp = standard.startswith("c++")
    words = [compiler, "-x", "c++" if cpp else "c", f"-std={standard}"]
    words += [*(WARNINGS if cpp else C_WARNINGS), "-ffreestanding", "-fsyntax-only"]
    words.append(f"-I{made.folder / 'c'}")
    user = tmp_path / "user.c"
    user.write_text(everything(made.package), encoding="ascii")
    compiles(*words, user, made.package.source)
    prefix = made.package.prefix.upper()
    compiles(
        *words, f"-D{prefix}_NO_RANGE_CHECKS", f"-D{prefix}_NO_NAMES", user, made.package.source
    )
    compiles(*words, f"-D{prefix}_NO_TABLE", made.package.source)
    if compiler == "clang":
        compiles(*SMALL, *words[words.index(f"-std={standard}") + 1 :], user, made.package.source)


@pytest.mark.matrix
def test_objects_for_a_chip_call_nothing_and_have_no_writable_data(
    made: Made, tmp_path: Path
) -> None:
    need("arm-none-eabi-gcc")
    user = tmp_path / "user.c"
    user.write_text(everything(made.package), encoding="ascii")
    for source in (user, made.package.source):
        path = tmp_path / f"{source.stem}.o"
        words = [*CORTEX_M0, "-std=c99", f"-I{made.folder / 'c'}", "-c"]
        compiles("arm-none-eabi-gcc", *words, source, "-o", path)
        rows = symbols("arm-none-eabi-nm", path)
        assert rows, "the object is empty"
        assert [name for name, kind, _ in rows if kind in "UdDbBC"] == []


@pytest.mark.matrix
def test_clang_format_changes_nothing(made: Made) -> None:
    need("clang-format")
    style = ROOT / ".clang-format"
    paths = sorted(made.package.folder.rglob("*.[ch]"))
    done = run("clang-format", f"--style=file:{style}", "--dry-run", "--Werror", *paths)
    assert (done.returncode, done.stdout) == (0, "")


# Every layout, every case


def test_every_round_trip_passes(made: Made, tmp_path: Path) -> None:
    done = run(build_round_trip(made.package, tmp_path))
    assert (done.returncode, done.stdout) == (0, "")


def test_every_vector_passes(made: Made, tmp_path: Path) -> None:
    found, in_all, status = findings_of(build_vectors(made.package, tmp_path))
    assert status == 0, in_all
    assert {finding.outcome for finding in found.values()} <= {"passed", "noted"}
    assert len(found) > 100


def test_the_testees_answer_every_case(made: Made) -> None:
    cases = made.cases()
    requests = [
        {"id": number, "protocol": made.name, **case["request"]}
        for number, case in enumerate(cases)
    ]
    for answers in (made.testee.ask(lines(requests)), in_python(made, requests)):
        for case, answer in zip(cases, answers, strict=True):
            assert said(answer) == case["answer"], case["id"]


def in_python(made: Made, requests: list[Json]) -> list[Json]:
    """Return the answers of the Python testee."""
    testee = Testee()
    testee._codecs[made.name] = codec_of(made.protocol)  # as if it were installed
    return [testee.answer(line) for line in lines(requests).splitlines()]


def said(answer: Json) -> Json:
    return {key: value for key, value in answer.items() if key not in ("id", "detail")}


def test_the_testees_agree_on_damaged_packets(made: Made) -> None:
    """With a flipped bit, cut, longer, or with another length and a valid check."""
    rng = Random(1)
    requests: list[Json] = []
    for number in range(DAMAGED):
        for packet in packets(made, rng):
            raw = bytearray(packet)
            if number % 4:
                raw[rng.randrange(len(raw))] ^= 1 << rng.randrange(8)
            if number % 4 == 3:
                raw = raw[: rng.randrange(len(raw) + 1)] + rng.randbytes(rng.randrange(2))
            requests.append({"op": "decode", "hex": raw.hex()})
        stream = damaged(made, rng)
        requests.append({"op": "stream", "chunks": [chunk.hex() for chunk in chunks(rng, stream)]})
    requests = [{"id": n, "protocol": made.name, **r} for n, r in enumerate(requests)]
    theirs = made.testee.ask(lines(requests))
    for request, ours, answer in zip(requests, in_python(made, requests), theirs, strict=True):
        assert said(ours) == said(answer), json.dumps(request)


# Streams


def packets(made: Made, rng: Random) -> Iterator[bytes]:
    """Yield packets with known and unknown ids, and payloads of all lengths."""
    shape = made.protocol.shape
    layouts = [cls.layout for cls in made.protocol.messages]
    for layout in rng.sample(layouts, len(layouts)):
        length = max(0, min(shape.maximum, layout.length + rng.choice((0, 0, 0, 1, -1, 5))))
        payload = rng.choice((bytes(length), rng.randbytes(length)))
        if rng.random() < 0.2:  # start bytes in the payload
            payload = (shape.start * length)[:length]
        id = layout.id if rng.random() < 0.9 else rng.randrange(1 << 8 * shape.id)
        yield shape.pack(id, rng.randrange(1 << 8 * shape.address), payload)


def damaged(made: Made, rng: Random) -> bytes:
    """Return some packets with random damage."""
    stream = bytearray(b"".join(packets(made, rng)))
    for _ in range(rng.choice((0, 1, 3, 8))):
        at = rng.randrange(len(stream))
        kind = rng.randrange(4)
        if kind == 0:
            stream[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del stream[at : at + rng.choice((1, 1, 5))]
        elif kind == 2:
            stream[at:at] = rng.choice((made.protocol.shape.start, rng.randbytes(3)))
        else:
            stream[at:at] = made.protocol.shape.start[:1] * 3
    return bytes(stream)


def chunks(rng: Random, stream: bytes) -> list[bytes]:
    """Cut a stream at random, byte by byte, or not at all."""
    longest = rng.choice((1, 3, 10, 100, len(stream) + 1))
    found, at = [], 0
    while at < len(stream):
        size = rng.randint(1, longest) if longest <= len(stream) else len(stream)
        found.append(stream[at : at + size])
        at += size
    return found


def test_the_parser_produces_the_events_of_the_framer(made: Made) -> None:
    """Compare events and pending bytes after every block, also after silences."""
    rng = Random(2)
    kinds = set()
    for _ in range(STREAMS):
        ours, theirs = Parser(made), PythonParser(made)
        seen: list[Seen] = []
        silences = rng.choice((0, 0, 0.02, 0.2))
        stream = damaged(made, rng)
        for block in chunks(rng, stream):
            events = list(ours.feed(block))
            assert joined(events) == joined(theirs.feed(block))
            assert ours.pending == theirs.pending
            seen += events
            if rng.random() < silences:
                given_up = list(ours.abandon())
                assert joined(given_up) == joined(theirs.abandon())
                seen += given_up
        given_up = list(ours.abandon())
        assert joined(given_up) == joined(theirs.abandon())
        assert b"".join(raw for _, raw in seen + given_up) == stream
        kinds |= {kind for kind, _ in seen}
    assert kinds == {"message", "unknown", "bad_length", "garbage"}


def test_a_packet_is_decoded_by_only_one_layout(made: Made) -> None:
    """Also a packet with extra bytes: its length distinguishes the layouts of the message."""
    layouts = [cls.layout for cls in made.protocol.messages]
    requests: list[Json] = []
    address = min(1, made.protocol.shape.address)
    for layout in layouts:
        for length in range(made.protocol.shape.maximum % 50 + 1):
            raw = made.protocol.shape.pack(layout.id, address, bytes(length))
            requests.append({"id": 1, "op": "decode", "protocol": made.name, "hex": raw.hex()})
    theirs = made.testee.ask(lines(requests))
    assert list(map(said, theirs)) == list(map(said, in_python(made, requests)))


# A custom table


OWN = """
#include "stagewire_carousel/parser.h"
const carousel_entry carousel_table[] = { {0x13U, 4U}, {0x13U, 9U}, {0x16U, 0U} };
const size_t carousel_table_count = 3U;
static int seen(uint32_t id, int length)
{
    const carousel_entry *entry = carousel_entry_of(id);
    return entry == NULL ? length == -1 : entry->length == length;
}
int main(void)
{
    return !(seen(0x13U, 9) && seen(0x16U, 0) && seen(0x14U, -1) && seen(0U, -1)
        && seen(0xFFFFFFFFU, -1) && seen(0x10013U, -1));
}
"""


def test_firmware_can_define_its_own_table(shapes: object, tmp_path: Path) -> None:
    need("gcc")
    carousel: Made = shapes(CAROUSEL)  # type: ignore[operator]
    own = tmp_path / "own.c"
    own.write_text(OWN, encoding="ascii")
    words = ["-std=c99", *C_WARNINGS, "-DCAROUSEL_NO_TABLE", f"-I{carousel.folder / 'c'}"]
    compiles("gcc", *words, own, carousel.package.source, "-o", tmp_path / "own")
    assert run(tmp_path / "own").returncode == 0
