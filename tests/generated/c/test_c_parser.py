"""The C parser of frames with a header: the same events as the Python framer, for any input."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from functools import cache, partial
from itertools import islice, product
from pathlib import Path
from random import Random
from types import ModuleType

import pytest
from random_frames import INVENTED, invent, table_of
from stream_program import Program, Step, cut, in_python, joined, steps_of
from toolchain import C, compiles, need, run

from checkout import ROOT
from files import import_program, write_files
from parts import first_of
from stagewire.framing import End, Forms, FramingTable
from stagewire.protocols import Direction
from stagewire_apt import PROTOCOL
from stagewire_generator import render
from stagewire_generator.model import Protocol

sys.path.append(str(ROOT / "tests" / "fuzz"))
import streams as fuzz_streams

TABLE = PROTOCOL.framing
SANITIZED = ["clang", "-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
BUILDS = {
    "small": ["gcc", "-std=c99", "-Os"],
    "indexed": ["gcc", "-std=c99", "-O2", "-DAPT_HOST_INDEX"],
    "sanitized": [*SANITIZED, "-std=c99"],
    "sanitized and indexed": [*SANITIZED, "-std=c99", "-DAPT_HOST_INDEX"],
}
WITHOUT_ARRAYS = {"without arrays": [*SANITIZED, "-std=c99", "-DAPT_NO_ARRAYS"]}
STREAMS = 1200  # per build
STATUS = "8104 0e00 8150 0100400d0300000000003000 0080"
HOMED = "4404 0100 0150"
MOVE = "5304 0600 d001 0100 00000000"  # to a controller
ARRAY = "8009 {} d001"  # the header of MOT_SET_MOVESYNCHARRAY; one channel has 8 bytes per point
# A stream for every sentence of the rule in parser.h, and streams that are unlikely at random.
SENTENCES = (
    "770f ff01 8150",  # 1: too long for any packet
    STATUS + HOMED,  # 2
    "8104 0400 8150 00000000",  # shorter
    "8104 1300 8150" + "00" * 13 + HOMED,  # longer, by less than a header
    "8104 1000 8150" + "00" * 16,  # between the two lengths of the status, and the longer one
    "8104 1c00 8150" + "00" * 28,
    "8104 1400 8150" + "00" * 20,  # longer by an invalid header
    "8104 1400 8150" + "00" * 14 + HOMED,  # longer by a header at the end of the frame
    "8104 1500 8150" + "00" * 14 + HOMED + "00",
    "8104 1400 8150" + "00" * 15 + HOMED,  # longer by all but the last byte of a header
    "8104 ff00 8150" + "00" * 100 + STATUS * 8,
    "8104 1400 8150" + "00" * 14 + "4404 0100 0000",  # longer by a header that is not accepted
    "4404 0100 5001",  # exchanged addresses
    "4404 0100 0000",  # addresses 0 and 0
    "5304 0600 5001",  # a packet without the data flag
    "5304 0100 5001",
    "0200 0000 0150",  # valid only with parameters that are zero
    "0200 0001 0150",
    "770f 0400 8150 00000000",  # 3: unknown
    "770f 0400 0150",
    ARRAY.format("1000") + "0100 0100 0100 0000" + "00" * 8,  # an array with the stated length
    ARRAY.format("0800") + "0100 0100 0100 0000",  # a shorter one
    ARRAY.format("1800") + "0100 0100 0100 0000" + "00" * 16,  # a longer one
    ARRAY.format("1800") + "0100 0100 0100 0000" + MOVE + "00" * 4,  # with a header inside
    ARRAY.format("1004") + "0100 0100 8100 0000" + "00" * 1032,  # longer than 255 bytes
    ARRAY.format("0c10"),  # longer than the longest
    "8104 0100 0150",  # 4: a wrong form
    "4404 0100 8150",
    "ff" + STATUS,  # 5
    "ff" + HOMED,
    "ff4404 0100 5001",
    "ff8104 0f00 8150" + "00" * 15,
    "ff770f 0000 8150",
    "770f 5000 8150" + STATUS,  # 6: given up as a whole
    "8104 8e00 8150" + "00" * 14 + HOMED + STATUS + "4404 01",  # searched for frames
    "ff" + "8104 0e00 8150" + HOMED,
)
LONG = 20_000
MOST_WORK = 100  # basic blocks per byte; a search in the table executes 20


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder for programs."""
    return tmp_path_factory.mktemp("parser")


@pytest.fixture(params=first_of(BUILDS, 2))
def program(request: pytest.FixtureRequest, folder: Path) -> Program:
    """The parser of APT, compiled in different ways."""
    return made(request.param, folder)


@pytest.fixture(scope="session")
def experiment() -> ModuleType:
    """The experiment that led to the rule."""
    return import_program(ROOT / "benchmarks" / "framing_experiment.py")


@pytest.fixture
def indexed(folder: Path) -> Program:
    """The parser of APT with an index, as for hosts."""
    return made("indexed", folder)


@cache
def made(build: str, folder: Path) -> Program:
    """Return the program of a build, which is compiled once."""
    words = {**BUILDS, **WITHOUT_ARRAYS}[build]
    need(words[0])
    return Program(C, "stagewire_apt", folder / build.replace(" ", "_"), *words)


def compare(program: Program, table: FramingTable, streams: list[tuple[End, list[Step]]]) -> int:
    """Compare the output of C with Python; return the number of events."""
    given = program.give(streams)
    assert len(given) == len(streams)
    events = 0
    for (end, steps), ours in zip(streams, given, strict=True):
        assert joined(ours.events) == in_python(table, end, steps), (end, steps)
        events += len(ours.events)
    return events


def damaged(rng: Random, frame: Callable[[Random], bytes] = fuzz_streams.frame) -> bytes:
    """Return some frames with random damage."""
    stream = b"".join([frame(rng) for _ in range(rng.randrange(1, 12))])
    for _ in range(rng.choice((0, 1, 1, 2, 5))):
        stream = fuzz_streams.damaged(rng, stream)
    return stream


def test_every_sentence_of_the_rule(program: Program) -> None:
    streams: list[tuple[End, list[Step]]] = []
    for sentence in map(bytes.fromhex, SENTENCES):
        for stream in (sentence, sentence * 3, sentence + bytes.fromhex(STATUS) * 2 + sentence):
            for steps in ([stream], [stream[i : i + 1] for i in range(len(stream))]):
                streams += [(end, [*steps]) for end in End]
    compare(program, TABLE, streams)


def test_without_arrays_a_packet_has_any_length_from_its_fixed_fields_on(folder: Path) -> None:
    """The reference is a table in which a message with an array has these fields alone."""
    plain = {
        id: Forms(it.name, it.direction, it.header, frozenset({it.counted.least}))
        for id, it in TABLE.forms.items()
        if it.counted
    }
    assert plain
    table = FramingTable({**TABLE.forms, **plain}, TABLE.host, TABLE.devices, TABLE.without_flag)
    program = made(*WITHOUT_ARRAYS, folder)
    streams: list[tuple[End, list[Step]]] = []
    for sentence in map(bytes.fromhex, SENTENCES):
        stream = sentence + bytes.fromhex(STATUS) * 2 + sentence
        streams += [(end, [stream]) for end in End]
    rng = Random(5)
    streams += [(rng.choice(list(End)), steps_of(rng, damaged(rng))) for _ in range(STREAMS)]
    assert compare(program, table, streams) > 5 * STREAMS


def test_damaged_streams_give_the_same_events(program: Program) -> None:
    rng = Random(1)
    streams = [(rng.choice(list(End)), steps_of(rng, damaged(rng))) for _ in range(STREAMS)]
    assert compare(program, TABLE, streams) > 5 * STREAMS


def test_damage_everywhere_in_a_run(indexed: Program, experiment: ModuleType) -> None:
    rng = Random(2)
    ways = {End.HOST: Direction.TO_HOST, End.DEVICE: Direction.TO_CONTROLLER}
    streams: list[tuple[End, list[Step]]] = []
    for addresses in ("right", "zero"):
        for end, way in ways.items():
            frames = experiment.make_run(rng, TABLE, (way,), addresses, newer=True)[:6]
            stream = b"".join(frames)
            everything = experiment.damages(stream, len(stream))
            for damage in islice(
                everything, 0, None, 5
            ):  # every kind of damage at almost every position
                steps = cut(rng, damage.stream)
                streams.append((rng.choice((end, end, End.NONE)), [*steps]))
    assert len(streams) > 1000
    compare(indexed, TABLE, streams)


def test_any_cut_gives_the_same_events(program: Program) -> None:
    rng = Random(3)
    for _ in range(40):
        stream, end = damaged(rng), rng.choice(list(End))
        bytewise = [stream[i : i + 1] for i in range(len(stream))]
        cuts: list[list[Step]] = [[stream], [*bytewise], [*cut(rng, stream)], [stream, b"", b""]]
        first, *others = (joined(it.events) for it in program.give([(end, it) for it in cuts]))
        assert all(other == first for other in others)


def test_no_byte_is_lost(program: Program) -> None:
    rng = Random(4)
    streams = [rng.randbytes(600) + damaged(rng) for _ in range(100)]
    given = program.give([(rng.choice(list(End)), [*cut(rng, it)]) for it in streams])
    for stream, ours in zip(streams, given, strict=True):
        raws = [raw for kind, raw in ours.events if isinstance(kind, type)]
        assert b"".join(raws) == stream


@pytest.mark.parametrize("end", End)
def test_complete_frames_in_a_block_are_not_copied(
    program: Program, end: End, experiment: ModuleType
) -> None:
    rng = Random(5)
    ways = (Direction.TO_HOST,) if end is not End.DEVICE else (Direction.TO_CONTROLLER,)
    frames = experiment.make_run(rng, TABLE, ways)
    [whole] = program.give([(end, [b"".join(frames)])])
    assert [raw for _, raw in whole.events[:-2]] == frames
    assert all(whole.in_place[:-2])

    middle = sum(map(len, frames[:7])) + 3  # in the header of a frame
    stream = b"".join(frames)
    [halves] = program.give([(end, [stream[:middle], stream[middle:]])])
    assert [raw for _, raw in halves.events[:-2]] == frames
    assert [i for i, there in enumerate(halves.in_place[:-2]) if not there] == [7]


def test_a_remembered_header_matches_only_itself(indexed: Program) -> None:
    """Headers that are in the index initially, and headers that look similar."""
    zeros = [slot.to_bytes(6, "little") for slot in range(0x200)]
    likes = [raw * 12000 for raw in (bytes(6), b"\xff" * 6, b"\x01" + bytes(5))]
    steps: list[list[Step]] = [[b"".join(zeros) + bytes(80000)], *([it] for it in likes)]
    compare(indexed, TABLE, [(end, it) for it in steps for end in End])


def test_a_header_is_remembered_only_with_all_its_bytes(indexed: Program) -> None:
    """One byte of a header changes after the parser has received it many times."""
    rng = Random(6)
    streams: list[tuple[End, list[Step]]] = []
    frames = (fuzz_streams.frame(rng) for _ in range(40))
    for frame in [it for it in frames if len(it) >= 6]:  # not a misprinted one
        for at in range(6):
            other = frame[:at] + bytes((frame[at] ^ 1 << rng.randrange(8),)) + frame[at + 1 :]
            streams.append((rng.choice(list(End)), [frame * 3 + other + frame * 3]))
    compare(indexed, TABLE, streams)


def test_files_with_and_without_the_index_do_not_link(folder: Path) -> None:
    need("gcc")
    package = C / "stagewire_apt"
    user = folder / "user.c"
    user.write_text(
        '#include "stagewire_apt/parser.h"\n'
        "int main(void)\n{\n    apt_parser parser;\n    apt_event event;\n"
        "    const uint8_t *data = NULL;\n    size_t size = 0U;\n"
        "    apt_parser_init(&parser, APT_END_HOST);\n"
        "    return (int)apt_parser_next(&parser, &data, &size, &event);\n}\n",
        encoding="ascii",
    )
    words = ["gcc", "-std=c99", f"-I{C}", "-c"]
    for index in ("", "-DAPT_HOST_INDEX"):
        compiles(*words, *([index] if index else []), user, "-o", folder / f"user{index}.o")
        source = package / "stagewire_apt.c"
        compiles(*words, *([index] if index else []), source, "-o", folder / f"source{index}.o")
    for index in ("", "-DAPT_HOST_INDEX"):
        for other in ("", "-DAPT_HOST_INDEX"):
            objects = (folder / f"user{index}.o", folder / f"source{other}.o")
            linked = run("gcc", *objects, "-o", folder / "linked").returncode == 0
            assert linked == (index == other)


# Other tables


@pytest.mark.parametrize(
    ("index", "number"), first_of(product(("", "-DTINY_HOST_INDEX"), range(INVENTED)))
)
def test_random_protocols(number: int, index: str, tmp_path: Path) -> None:
    """Several lengths or messages of an id, undocumented ids, other addresses: APT does not have them."""
    need("gcc")
    protocol = invent(Random(number))
    table = table_of(protocol)
    c = _rendered(protocol, tmp_path)
    words = ["gcc", "-std=c99", "-O1", *([index] if index else [])]
    program = Program(c, "stagewire_tiny", tmp_path / "program", *words)
    rng, frame = Random(number), partial(_frame, table)
    ends = [rng.choice(list(End)) for _ in range(400)]
    compare(program, table, [(end, steps_of(rng, damaged(rng, frame))) for end in ends])


def _rendered(protocol: Protocol, folder: Path) -> Path:
    """Write the C code of a protocol; return its folder."""
    write_files(folder, render([protocol], ["c"]))
    return folder / "c"


def _frame(table: FramingTable, rng: Random) -> bytes:
    """Return a frame that a protocol has, or almost has."""
    id, forms = rng.choice(sorted(table.forms.items()))
    pair = [table.host, rng.choice(sorted(table.devices))]
    rng.shuffle(pair)
    if rng.random() < 0.1:
        pair = rng.choice(([0, 0], [rng.randrange(128), rng.randrange(256)]))
    lengths = sorted(forms.lengths) or [0, 5]
    length = max(0, rng.choice(lengths) + rng.choice((0, 0, 0, 0, -1, 1, 5, 6, 7, 30)))
    sub_message = rng.choice([*forms.sub_messages, 0, 7])
    if rng.random() < 0.3:
        word = rng.choice((0, 0, 1, length, 0x100, sub_message))
        return id.to_bytes(2, "little") + word.to_bytes(2, "little") + bytes(pair)
    header = id.to_bytes(2, "little") + length.to_bytes(2, "little")
    payload = rng.choice((bytes(length), rng.randbytes(length)))
    if rng.random() < 0.2:  # frames inside
        payload = (_frame(table, rng) * (length // 6 + 1))[:length]
    if forms.sub_messages:
        payload = (sub_message.to_bytes(2, "little") + payload)[:length]
    return header + bytes((pair[0] | 0x80, pair[1])) + payload


# The table


ASKS_TABLE = r"""
#include "stagewire_apt/parser.h"
#include <stdio.h>
int main(void)
{
    size_t at;
    uint32_t id;
    for (at = 0U; at < apt_table_count; ++at) {
        const apt_entry *entry = &apt_table[at];
        printf("%u %u %u %s\n", entry->id, entry->length, entry->forms, apt_entry_name(entry));
    }
    for (id = 0U; id <= UINT16_MAX; ++id) {
        const apt_entry *entry = apt_entry_of((uint16_t)id);
        if (entry != NULL) {
            printf("%u %d\n", (unsigned)id, (int)(entry - apt_table));
        }
    }
    return apt_entry_name(NULL) != NULL;
}
"""


def test_the_table_equals_the_registry(tmp_path: Path) -> None:
    need("gcc")
    (tmp_path / "asks.c").write_text(ASKS_TABLE, encoding="ascii")
    source = C / "stagewire_apt" / "stagewire_apt.c"
    made = tmp_path / "asks"
    compiles("gcc", "-std=c99", f"-I{C}", tmp_path / "asks.c", source, "-o", made)
    lines = [line.split() for line in compiles(made).splitlines()]
    every = [(int(id), int(length), int(flags), name)
             for id, length, flags, name in (line for line in lines if len(line) == 4)]  # fmt: skip
    rows = [row for row in every if row[0] not in TABLE.shared]
    longest = {int(line[0]): int(line[1]) for line in lines if len(line) == 2}
    assert [row[:2] for row in rows] == sorted(
        (id, length)
        for id, forms in TABLE.forms.items()
        if id not in TABLE.shared
        for length in lengths_of(forms)
    )
    assert {row[0] for row in every} == TABLE.forms.keys()
    last = {id: at for at, (id, *_) in enumerate(every)}  # the last row of each id
    assert {id: longest[id] for id in TABLE.forms.keys() - TABLE.shared} == {
        id: at for id, at in last.items() if id not in TABLE.shared
    }
    for before, (id, _, flags, name) in zip([None, *rows], rows, strict=False):
        forms = TABLE.forms[id]
        assert name == forms.name
        assert bool(flags & 0x10) is not forms.documented
        if forms.documented:
            assert bool(flags & 1) is (Direction.TO_HOST in forms.direction)
            assert bool(flags & 2) is (Direction.TO_CONTROLLER in forms.direction)
            assert bool(flags & 4) is forms.header
            assert bool(flags & 8) is forms.only_zero_parameters
        assert bool(flags & 0x20) is (before is not None and before[0] == id)
        assert bool(flags & 0x80) is (forms.counted is not None)


def lengths_of(forms: Forms) -> frozenset[int] | set[int]:
    """Return the lengths of the rows of an id, without arrays."""
    return forms.lengths or {forms.counted.least if forms.counted else 0}


FIRMWARE = """
#include "stagewire_apt/parser.h"
const apt_entry apt_table[] = {
    {0x0005U, 0U, APT_ENTRY_TO_CONTROLLER | APT_ENTRY_HEADER},
    {0x0413U, 14U, APT_ENTRY_TO_CONTROLLER},
    {0x0453U, 6U, APT_ENTRY_TO_CONTROLLER | APT_ENTRY_HEADER},
};
const size_t apt_table_count = sizeof apt_table / sizeof apt_table[0];
const uint16_t apt_sub_messages[] = {0U}; /* of the entries that follow those of the table: none */
const size_t apt_sub_message_count = 0U;
"""


def test_firmware_can_define_its_own_table(tmp_path: Path) -> None:
    need("gcc")
    (tmp_path / "firmware.c").write_text(FIRMWARE, encoding="ascii")
    words = ["gcc", "-std=c99", "-DAPT_NO_TABLE"]
    path = tmp_path / "program"
    program = Program(C, "stagewire_apt", path, *words, beside=tmp_path / "firmware.c")
    known = {id: TABLE.forms[id] for id in (0x0005, 0x0413, 0x0453)}
    table = FramingTable(known, TABLE.host, TABLE.devices, TABLE.without_flag)
    rng = Random(7)
    compare(program, table, [(End.DEVICE, steps_of(rng, damaged(rng))) for _ in range(400)])


# The work


def floods() -> Iterator[tuple[str, bytes]]:
    """Yield streams that need the most work, by name."""
    yield "zeros", bytes(20)
    yield "half headers", bytes.fromhex("81040e0081ff")
    yield "lengths that never end", bytes.fromhex("770fff018150")
    yield "longest packets one in the other", bytes.fromhex("8104ff008150")
    yield "candidates at every byte", bytes.fromhex("0404000150")
    yield "short frames in packets that are too long", bytes.fromhex("8104ff008150440401000150")
    yield "too long, in front of another", bytes.fromhex("8104ff008150" + "440401000150" * 7)
    yield "damage everywhere", b"".join([damaged(Random(number)) for number in range(60)])


@pytest.mark.parametrize("block", first_of([1, 2, 7, 300, 4096]))
def test_the_work_per_byte_is_bounded(block: int, folder: Path) -> None:
    """Counted in executed basic blocks, for streams of any length."""
    program = made("small", folder)
    for name, piece in floods():
        stream = (piece * (LONG // len(piece) + 1))[:LONG]
        streams = [stream[: LONG // 4], stream]
        steps = [[it[i : i + block] for i in range(0, len(it), block)] for it in streams]
        given = program.give([(End.NONE, [*it]) for it in steps])
        [[short], [long]] = (it.work for it in given)
        assert 0 < long <= MOST_WORK * LONG, (name, long / LONG)
        assert long - short <= MOST_WORK * (LONG - LONG // 4), name
