"""Damage streams of frames at every byte, and count what each framing rule loses and invents.

One byte in a run of 20 frames is damaged, at every position: each bit is flipped, the byte is lost, doubled,
or another byte is inserted before it. Each rule then frames the result, and its frames are compared with the
damaged frame and the 19 after it. A frame is *missing* if the rule did not return it unchanged. A message
that was not sent is *altered* if it begins where a frame began (for example a flipped bit inside a payload,
which no rule can detect without a checksum) and *invented* if it begins anywhere else.

    python benchmarks/framing_experiment.py --runs 40
    python benchmarks/framing_experiment.py --runs 5 --silences   # with a pause after the damage

The first table shows the worst case: the most frames missing from 20 and, in brackets, the most invented. The
second shows sums over all damages.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from stagewire.framing import (
    End,
    Event,
    Forms,
    Framer,
    FramingTable,
    Received,
    Undocumented,
    Unknown,
)
from stagewire.protocols import DATA_FLAG, MAXIMUM_PACKET, Direction

HOST = 0x01
DEVICES = frozenset({0x11, *range(0x21, 0x2B), 0x50})
FRAMES = 20
INSERTED = (0x00, 0x01, 0x04, 0x0E, 0x50, 0x80, 0x81, 0xFF)
DAMAGES = ("bit flipped", "lost", "doubled", "inserted")


def _forms(
    name: str, direction: Direction, header: bool, *lengths: int, documented: bool = True
) -> Forms:
    only_zero = name == "HW_DISCONNECT"
    return Forms(name, direction, header, frozenset(lengths), documented, only_zero)


_IN, _OUT = Direction.TO_HOST, Direction.TO_CONTROLLER

SMALL_TABLE = FramingTable(
    forms={
        0x0002: _forms("HW_DISCONNECT", Direction.BOTH, True),
        0x0005: _forms("HW_REQ_INFO", _OUT, True),
        0x0006: _forms("HW_GET_INFO", _IN, False, 84),
        0x0080: _forms("HW_RESPONSE", _IN, True),
        0x0081: _forms("HW_RICHRESPONSE", _IN, False, documented=False),
        0x0211: _forms("MOD_REQ_CHANENABLESTATE", _OUT, True),
        0x0212: _forms("MOD_GET_CHANENABLESTATE", _IN, True),
        0x0411: _forms("MOT_REQ_POSCOUNTER", _OUT, True),
        0x0412: _forms("MOT_GET_POSCOUNTER", _IN, False, 6),
        0x0413: _forms("MOT_SET_VELPARAMS", _OUT, False, 14),
        0x0415: _forms("MOT_GET_VELPARAMS", _IN, False, 14),
        0x0443: _forms("MOT_MOVE_HOME", _OUT, True),
        0x0444: _forms("MOT_MOVE_HOMED", _IN, True),
        0x0448: _forms("MOT_MOVE_RELATIVE", _OUT, True, 6),
        0x0453: _forms("MOT_MOVE_ABSOLUTE", _OUT, True, 6),
        0x0464: _forms("MOT_MOVE_COMPLETED", _IN, True, 14),
        0x0466: _forms("MOT_MOVE_STOPPED", _IN, True, 14),
        0x0481: _forms("MOT_GET_STATUSUPDATE", _IN, False, 14),
        0x0491: _forms("MOT_GET_DCSTATUSUPDATE", _IN, False, 14),
        0x0492: _forms("MOT_ACK_DCSTATUSUPDATE", _OUT, True),
    },
    host=HOST,
    devices=DEVICES,
)

# Messages of a controller newer than the table: a longer status, and unknown ids.
NEWER = (
    (0x0481, _forms("MOT_GET_STATUSUPDATE, longer", _IN, False, 28)),
    (0x0491, _forms("MOT_GET_DCSTATUSUPDATE, longer", _IN, False, 16, 34)),
    (0x0081, _forms("HW_RICHRESPONSE", _IN, False, 68)),
    (0x0F31, _forms("unknown", _IN, True, 10, 30, 100)),
)


def generated_table() -> FramingTable | None:
    """Return the table of the generated package, or None if it is not installed."""
    try:
        from stagewire_apt import PROTOCOL
    except ImportError:
        return None
    table: FramingTable = PROTOCOL.framing
    return table


class Message(NamedTuple):
    """A frame and its position; ``known`` if the rule returned it as a message."""

    start: int
    raw: bytes
    known: bool


Rule = Callable[[bytes], list[Message]]


def messages(events: Iterable[Event]) -> list[Message]:
    """Return the frames among the events, each with its position."""
    found, position = [], 0
    for event in events:
        if isinstance(event, (Received, Undocumented, Unknown)):
            found.append(Message(position, event.raw, isinstance(event, Received)))
        position += len(event.raw)
    return found


def naive(table: FramingTable) -> Rule:
    """Return the rule of many drivers: trust every length, and skip one byte if it is absurd."""

    def frame(stream: bytes) -> list[Message]:
        found, position = [], 0
        while len(stream) - position >= 6:
            size = 6
            if stream[position + 4] & DATA_FLAG:
                size += stream[position + 2] | stream[position + 3] << 8
            if size > 6 + MAXIMUM_PACKET:
                position += 1
                continue
            if position + size > len(stream):
                break
            known = stream[position] | stream[position + 1] << 8 in table.forms
            found.append(Message(position, stream[position : position + size], known))
            position += size
        return found

    return frame


def ours(table: FramingTable, end: End, silences: bool = False) -> Rule:
    """Return the rule of the library; with ``silences`` the line pauses at the end of the run."""

    def frame(stream: bytes) -> list[Message]:
        framer.reset()
        events = framer.feed(stream)
        while silences and framer.pending:
            events += framer.abandon()
        return messages(events)

    framer = Framer(table, end)
    return frame


class Line(NamedTuple):
    """A row of the table: the senders, and the rule of the receiver."""

    title: str
    rule: Rule
    directions: tuple[Direction, ...]
    addresses: str = "right"
    newer: bool = False


def make_run(
    random_: random.Random,
    table: FramingTable,
    directions: tuple[Direction, ...],
    addresses: str = "right",
    newer: bool = False,
) -> list[bytes]:
    """Return twice 20 frames of one controller or its host, and as many as a rule may wait for.

    A damaged length makes a rule wait. Nothing is lost if the stream continues; ``--silences`` measures the
    loss if the line falls silent.
    """
    choices = {
        way: [
            (id, forms)
            for id, forms in sorted(table.forms.items())
            if way in forms.direction and forms.documented and (forms.header or forms.lengths)
        ]
        for way in directions
    }
    device = random_.choice(sorted(table.devices))
    # Real streams repeat a few messages: half of them are one kind.
    usual = {way: random_.choice(choices[way]) for way in directions}
    frames: list[bytes] = []
    tail = 6 + MAXIMUM_PACKET
    while len(frames) < 2 * FRAMES + 1 or sum(map(len, frames[2 * FRAMES :])) < tail:
        way = random_.choice(directions)
        id, forms = usual[way] if random_.random() < 0.5 else random_.choice(choices[way])
        dest, source = (table.host, device) if way is Direction.TO_HOST else (device, table.host)
        if addresses == "zero":
            dest = source = 0
        if newer and random_.random() < 0.2:
            id, forms = random_.choice(NEWER)
        if forms.lengths and not (forms.header and random_.random() < 0.5):
            length = random_.choice(sorted(forms.lengths))
            head = bytes((id & 0xFF, id >> 8, length, 0, dest | DATA_FLAG, source))
            frames.append(head + make_payload(random_, length))
        else:
            parameters = 0 if forms.only_zero_parameters else random_.choice((0, 1, 1, 2, 0x0101))
            word = parameters.to_bytes(2, "little")
            frames.append(bytes((id & 0xFF, id >> 8, *word, dest, source)))
    return frames


def make_payload(random_: random.Random, length: int) -> bytes:
    """Return a realistic payload of channels, small numbers, positions and flags."""
    payload = b"\x01\x00"
    while len(payload) < length:
        payload += random_.choice(
            (
                bytes(2),
                bytes(4),
                random_.randrange(256).to_bytes(2, "little"),
                random_.randrange(2048).to_bytes(4, "little"),
                random_.randrange(-500_000, 500_000).to_bytes(4, "little", signed=True),
                random_.randbytes(4),
                b"\xff\xff",
            )
        )
    return payload[:length]


class Damage(NamedTuple):
    """A damaged stream: ``clean_before`` original bytes, and shifted ones from ``clean_after``."""

    kind: str
    stream: bytes
    clean_before: int
    clean_after: int
    shift: int


def damages(stream: bytes, stop: int) -> Iterator[Damage]:
    """Damage one byte at every position before ``stop``, in every way."""
    for i, byte in enumerate(stream[:stop]):
        before, after = stream[:i], stream[i + 1 :]
        for bit in range(8):
            yield Damage("bit flipped", before + bytes((byte ^ 1 << bit,)) + after, i, i + 1, 0)
        yield Damage("lost", before + after, i, i + 1, -1)
        yield Damage("doubled", stream[: i + 1] + stream[i:], i + 1, i, 1)
        for value in INSERTED:
            yield Damage("inserted", before + bytes((value,)) + stream[i:], i, i, 1)


class Count:
    """The frames that a rule lost and invented under one kind of damage."""

    def __init__(self) -> None:
        self.tried = self.missing = self.altered = self.invented = 0
        self.worst_missing = self.worst_invented = 0

    def add(self, frames: list[Message], damage: Damage, found: list[Message]) -> None:
        """Compare the frames of a damaged stream with those that were sent, from the damage onwards."""
        begins: set[int] = set()  # positions of frames, counted from the front or from the back
        expected: dict[int, bytes] = {}
        considered = 0
        for start, raw, _ in frames:
            stop = start + len(raw)
            if stop <= damage.clean_before and stop < damage.clean_after:
                continue
            if considered == FRAMES:
                break
            considered += 1
            if start <= damage.clean_before:
                begins.add(start)
            if start + 6 > damage.clean_before:
                begins.add(start + damage.shift)
            if stop <= damage.clean_before:
                expected[start] = raw
            elif start >= damage.clean_after:
                expected[start + damage.shift] = raw
        first, last = min(begins), start + damage.shift if considered == FRAMES else stop + 1
        given = [message for message in found if first <= message.start < last]
        wrong = [m for m in given if expected.get(m.start) != m.raw]
        right = len(given) - len(wrong)
        wrong = [m for m in wrong if m.known]
        altered = sum(1 for message in wrong if message.start in begins)
        missing = considered - right
        invented = len(wrong) - altered
        self.tried += 1
        self.missing += missing
        self.altered += altered
        self.invented += invented
        self.worst_missing = max(self.worst_missing, missing)
        self.worst_invented = max(self.worst_invented, invented)


def experiment(
    line: Line, table: FramingTable, runs: int, seed: int, silences: bool = False
) -> dict[str, Count]:
    """Damage ``runs`` runs of one line everywhere, and count by kind of damage."""
    counts = {kind: Count() for kind in DAMAGES}
    random_ = random.Random(seed)
    for _ in range(runs):
        frames, stream = [], b""
        for raw in make_run(random_, table, *line[2:]):
            frames.append(Message(len(stream), raw, True))
            stream += raw
        if [m.raw for m in line.rule(stream)] != [m.raw for m in frames]:
            raise RuntimeError(f"{line.title}: an undamaged run is not framed as it was sent")
        stop = frames[FRAMES].start
        if silences:
            frames, stream = frames[:FRAMES], stream[:stop]
        for damage in damages(stream, stop):
            counts[damage.kind].add(frames, damage, line.rule(damage.stream))
    return counts


def lines(table: FramingTable, silences: bool = False) -> list[Line]:
    """Return the rows of the experiment."""
    host, device, both = (Direction.TO_HOST,), (Direction.TO_CONTROLLER,), (_IN, _OUT)
    return [
        Line("naive", naive(table), host),
        Line("ours, at the host", ours(table, End.HOST, silences), host),
        Line("ours, at the device", ours(table, End.DEVICE, silences), device),
        Line("ours, end unknown", ours(table, End.NONE, silences), host),
        Line("ours, end unknown, both talk", ours(table, End.NONE, silences), both),
        Line("ours, at the host, addresses 0", ours(table, End.HOST, silences), host, "zero"),
        Line("ours, at the host, newer units", ours(table, End.HOST, silences), host, newer=True),
    ]


def show(results: dict[str, dict[str, Count]]) -> None:
    """Print both tables."""
    width = max(map(len, results)) + 2
    print(f"Most frames missing from {FRAMES} (most invented)\n")
    print(" " * width + "".join(f"{kind:>14}" for kind in DAMAGES))
    for title, counts in results.items():
        cells = [f"{c.worst_missing} ({c.worst_invented})" for c in counts.values()]
        print(f"{title:{width}}" + "".join(f"{cell:>14}" for cell in cells))
    print("\nSums over all damages\n")
    names = ("tried", "missing", "per damage", "altered", "invented")
    print(" " * width + "".join(f"{name:>12}" for name in names))
    for title, counts in results.items():
        tried, missing, altered, invented = (
            sum(getattr(c, name) for c in counts.values())
            for name in ("tried", "missing", "altered", "invented")
        )
        print(
            f"{title:{width}}{tried:12}{missing:12}{missing / tried:12.3f}{altered:12}{invented:12}"
        )


def main() -> None:
    """Run the experiment and print the result."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--runs", type=int, default=20, help="runs of 20 frames for each rule")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random frames")
    parser.add_argument(
        "--table",
        choices=("small", "generated"),
        default="generated" if generated_table() else "small",
        help="message table: that of this program, or the generated one if it is installed",
    )
    parser.add_argument(
        "--silences", action="store_true", help="after each run, abandon what is still pending"
    )
    options = parser.parse_args()
    table = SMALL_TABLE if options.table == "small" else generated_table()
    if table is None:
        parser.error("the generated table is not installed; use --table small")
    results = {}
    rows = lines(table, options.silences)
    for number, line in enumerate(rows, 1):
        print(f"[{number}/{len(rows)}] {line.title} …", file=sys.stderr, flush=True)
        results[line.title] = experiment(line, table, options.runs, options.seed, options.silences)
    print(f"{options.table} table, {options.runs} runs, seed {options.seed}\n")
    show(results)


if __name__ == "__main__":
    main()
