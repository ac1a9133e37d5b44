"""The effects of faults on a line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire_apt import messages as m
from stagewire_virtual.clock import SECOND, SteppedClock
from stagewire_virtual.errors import FaultError
from stagewire_virtual.factory import make_instrument
from stagewire_virtual.faults.chain import MOST_HELD
from stagewire_virtual.faults.fault import Fault
from stagewire_virtual.faults.link import FaultEvent, FaultyLink
from stagewire_virtual.instrument import Instrument, Row, find_unit
from stagewire_virtual.options import Options

HOMED = m.MotMoveHomed(chan_ident=1).pack(dest=0x01, source=0x50)
VELPARAMS = m.MotGetVelParams(chan_ident=1, min_velocity=0, acceleration=1, max_velocity=2).pack(
    dest=0x01, source=0x50
)
HOME = m.MotMoveHome(chan_ident=1).pack(dest=0x50, source=0x01)
ASK = m.MotReqVelParams(chan_ident=1).pack(dest=0x50, source=0x01)


class Recorder(Instrument):
    """A controller that records what it receives, and sends the answers that a test sets."""

    def __init__(self, unit: str = "TDC001") -> None:
        super().__init__(find_unit(unit), SteppedClock())
        self.heard: list[bytes] = []
        self.stuck: list[tuple[int, str, bool]] = []
        self.answers: dict[bytes, bytes] = {}

    def receive(self, data: bytes) -> None:
        self.heard.append(data)
        if data in self.answers:
            self.on_send(self.answers[data])

    def power_cycle(self) -> None: ...

    def rows(self) -> Sequence[Row]:
        return []

    def stick(self, part: str, stuck: bool) -> None:
        if part not in ("channel 1", "bay 1, channel 1", "axis X"):
            raise FaultError(f"no {part}")
        self.stuck.append((self.clock.now, part, stuck))


class Bench:
    """A recorder on a line with faults, and a record of what arrives at the host."""

    def __init__(self, *faults: str | Fault, seed: int = 0, unit: str = "TDC001") -> None:
        self.recorder = Recorder(unit)
        self.clock: Any = self.recorder.clock
        self.line = FaultyLink(self.recorder, faults, seed)
        self.came: list[tuple[int, bytes]] = []
        self.cuts: list[int] = []
        self.line.on_send = lambda data: self.came.append((self.clock.now, data))
        self.line.on_disconnect = lambda: self.cuts.append(self.clock.now)

    def say(self, *frames: bytes) -> list[bytes]:
        """Send frames from the controller; return what arrives immediately."""
        before = len(self.came)
        for frame in frames:
            self.recorder.on_send(frame)
        return [data for _, data in self.came[before:]]

    def hear(self, *chunks: bytes) -> list[bytes]:
        """Send chunks from the host; return what the controller receives immediately."""
        before = len(self.recorder.heard)
        for chunk in chunks:
            self.line.receive(chunk)
        return self.recorder.heard[before:]

    @property
    def what(self) -> list[str]:
        return [happened.what for happened in self.line.happened]


def frames(count: int) -> list[bytes]:
    return [bytes((0x44, 0x04, number, 0, 0x01, 0x50)) for number in range(1, count + 1)]


def test_a_line_without_faults_passes_everything_unchanged() -> None:
    bench = Bench()
    assert bench.hear(HOME[:3], HOME[3:] + b"\xff") == [HOME[:3], HOME[3:] + b"\xff"]
    assert bench.say(HOMED, b"\x01") == [HOMED, b"\x01"]
    assert not bench.line.happened
    assert bench.clock.next_due is None


@pytest.mark.parametrize(
    ("rule", "hit"),
    [
        ("every=3", {3, 6, 9}),
        ("at=4", {4}),
        ("at=11", set()),
        ("", set(range(1, 11))),
        ("p=0", set()),
        ("p=1", set(range(1, 11))),
    ],
)
def test_rules_select_frames_in_both_directions(rule: str, hit: set[int]) -> None:
    said = frames(10)
    left = [frame for number, frame in enumerate(said, 1) if number not in hit]
    assert Bench(f"to_host drop frame {rule}").say(*said) == left
    asked = [bytes((0x43, 0x04, number, 0, 0x50, 0x01)) for number in range(1, 11)]
    left = [frame for number, frame in enumerate(asked, 1) if number not in hit]
    bench = Bench(f"to_controller drop frame {rule}")
    assert bench.hear(b"".join(asked)[:7], b"".join(asked)[7:]) == left
    assert [what.split(":")[0] for what in bench.what] == [f"frame {n}" for n in sorted(hit)]


@pytest.mark.parametrize("direction", ["to_host", "to_controller"])
@pytest.mark.parametrize(
    ("fault", "becomes"),
    [
        ("drop byte at=2", ["aacc"]),
        ("drop byte", []),
        ("drop byte every=2", ["aacc"]),
        ("insert byte at=2 hex=0102", ["aa0102bbcc"]),
        ("flip byte at=2 bit=0", ["aabacc"]),
        ("flip byte at=2 bit=7", ["aa3bcc"]),
        ("duplicate byte at=3", ["aabbcccc"]),
        ("duplicate byte at=1 count=2", ["aaaaaabbcc"]),
        ("disconnect at=2", ["aabb"]),
        ("disconnect byte at=3", ["aabbcc"]),
    ],
)
def test_actions_on_bytes(direction: str, fault: str, becomes: list[str]) -> None:
    bench = Bench(f"{direction} {fault}")
    pass_on = bench.say if direction == "to_host" else bench.hear
    assert [data.hex() for data in pass_on(bytes.fromhex("aabbcc"))] == becomes
    assert len(bench.cuts) == ("disconnect" in fault)


@pytest.mark.parametrize("direction", ["to_host", "to_controller"])
@pytest.mark.parametrize(
    ("fault", "becomes"),
    [
        ("insert frame hex=0102", ["0102", "430401005001"]),
        ("flip frame bit=0", ["420401005001"]),
        ("flip frame bit=16", ["430400005001"]),
        ("duplicate frame count=2", ["430401005001"] * 3),
        ("disconnect frame", ["430401"]),
    ],
)
def test_actions_on_frames(direction: str, fault: str, becomes: list[str]) -> None:
    bench = Bench(f"{direction} {fault}")
    pass_on = bench.say if direction == "to_host" else bench.hear
    assert [data.hex() for data in pass_on(HOME)] == becomes
    assert len(bench.cuts) == ("disconnect" in fault)


def test_bytes_are_counted_across_frames_and_chunks() -> None:
    bench = Bench("to_host drop byte every=4")
    assert bench.say(b"abc", b"defgh", b"i") == [b"abc", b"efg", b"i"]
    assert bench.what == ["byte 4: 64", "byte 8: 68"]


def test_only_frames_of_a_message_are_counted() -> None:
    bench = Bench("to_host drop frame message=MOT_GET_VELPARAMS at=2")
    assert bench.say(VELPARAMS, HOMED, HOMED, VELPARAMS, VELPARAMS) == [
        VELPARAMS, HOMED, HOMED, VELPARAMS
    ]  # fmt: skip
    bench = Bench("to_controller flip byte message=MOT_MOVE_HOME at=7 bit=0")
    assert bench.hear(ASK + HOME, HOME) == [ASK, HOME, bytes((HOME[0] ^ 1,)) + HOME[1:]]


def test_a_reply_without_a_name_has_that_of_its_command() -> None:
    bench = Bench("to_host drop message=READ_STATUS", unit="MS2000")
    status, position = bytes.fromhex("183f3a"), bytes.fromhex("1861033a")
    bench.recorder.answers = {status: b"B", position: b"\x01\x02\x03"}
    bench.line.receive(status + position + status)
    assert [data for _, data in bench.came] == [b"\x01\x02\x03"]


def test_a_line_of_text_is_a_frame() -> None:
    bench = Bench("to_controller drop frame every=2", unit="MS2000")
    parts = b"W X\r", b"/\r", b"\xffB", b"\x18?:", b"\x18a\x03:"
    assert bench.hear(b"".join(parts)) == [parts[0], parts[2], parts[4]]


def test_an_incomplete_frame_is_given_up_after_a_timeout() -> None:
    """A line with faults also gives up a frame with a damaged length, instead of swallowing what follows."""
    bench = Bench("to_controller drop frame at=99")
    huge = bytes.fromhex("53040080d001")  # declares a packet of 32 KiB
    bench.hear(huge, HOME)
    bench.clock.advance(2)
    assert b"".join(bench.recorder.heard) == huge + HOME
    assert bench.hear(ASK) == [ASK]


def test_garbage_passes_uncounted() -> None:
    bench = Bench("to_controller drop frame every=2")
    assert bench.hear(b"\xff" * 8 + HOME + HOME) == [b"\xff" * 8, HOME]


def test_a_late_frame_holds_up_later_ones() -> None:
    bench = Bench("to_host delay frame message=MOT_GET_VELPARAMS by=2")
    bench.say(VELPARAMS)
    bench.clock.advance(0.5)
    bench.say(HOMED)
    bench.clock.advance(0.5)
    assert not bench.came
    bench.clock.advance(1.0)
    assert bench.came == [(2 * SECOND, VELPARAMS), (2 * SECOND, HOMED)]
    assert bench.say(HOMED) == [HOMED]


def test_a_late_frame_may_be_overtaken() -> None:
    bench = Bench("to_host delay frame message=MOT_GET_VELPARAMS by=2 overtaken=yes")
    assert bench.say(VELPARAMS, HOMED) == [HOMED]
    bench.clock.advance(3)
    assert bench.came == [(0, HOMED), (2 * SECOND, VELPARAMS)]


def test_late_bytes_arrive_in_order() -> None:
    bench = Bench("to_host delay byte at=2 by=1", "to_host delay byte at=5 by=0.5")
    bench.say(b"abc", b"defg")
    bench.clock.advance(2)
    assert b"".join(data for _, data in bench.came) == b"abcdefg"
    assert bench.came[0] == (0, b"a")
    assert {when for when, _ in bench.came[1:]} == {SECOND}


def test_late_requests_arrive_after_the_delay() -> None:
    bench = Bench("to_controller delay frame by=0.25")
    assert bench.hear(HOME, ASK) == []
    bench.clock.advance(0.25)
    assert bench.recorder.heard == [HOME, ASK]


@given(
    st.lists(
        st.tuples(st.integers(0, 3), st.binary(min_size=1, max_size=4)), min_size=1, max_size=20
    )
)
def test_a_serial_line_never_reorders(said: list[tuple[int, bytes]]) -> None:
    bench = Bench("to_host delay frame every=3 by=1", "to_host delay byte every=5 by=2.5")
    for seconds, data in said:
        bench.clock.advance(seconds)
        bench.say(data)
    bench.clock.advance(10)
    assert b"".join(data for _, data in bench.came) == b"".join(data for _, data in said)


def test_the_bytes_held_back_are_bounded() -> None:
    bench = Bench("to_host delay frame by=10")
    bench.say(*[bytes(1000)] * 200)
    assert bench.what[-1] == f"over {MOST_HELD} bytes are held back; 1000 more are lost"
    bench.clock.advance(10)
    assert sum(len(data) for _, data in bench.came) == MOST_HELD // 1000 * 1000
    assert not bench.say(b"\x01" * 1000)  # late again, but no longer lost
    bench.clock.advance(10)
    assert bench.came[-1] == (20 * SECOND, b"\x01" * 1000)


def test_the_bytes_that_faults_add_are_bounded() -> None:
    """Without a limit, these faults would turn one frame into 10^18."""
    bench = Bench(*["to_host duplicate frame count=1000000"] * 3)
    assert len(bench.say(HOMED)) == 1 + MOST_HELD // len(HOMED)
    assert bench.what[-1] == f"faults added over {MOST_HELD} bytes to 6; the rest is lost"
    bench = Bench(
        "to_controller duplicate byte count=1000000", "to_controller insert byte hex=0102"
    )
    (heard,) = bench.hear(b"\x00")
    assert heard[:6] == bytes.fromhex("010200010200")
    assert len(heard) <= 1 + MOST_HELD
    bench = Bench("to_controller flip byte at=1")
    assert sum(map(len, bench.hear(bytes(2 * MOST_HELD)))) == 2 * MOST_HELD  # nothing was added


def test_the_record_of_faults_is_bounded() -> None:
    bench = Bench("to_host drop byte")
    bench.say(bytes(5000))
    assert len(bench.line.happened) == 1000
    assert bench.what[-1] == "byte 5000: 00"


def test_a_cut_loses_bytes_on_their_way() -> None:
    bench = Bench("to_host delay frame at=1 by=1", "to_controller disconnect frame at=2")
    bench.say(HOMED)
    assert bench.hear(ASK + HOME + ASK) == [ASK, HOME[:3]]
    assert bench.cuts == [0]
    bench.clock.advance(2)
    assert not bench.came
    assert bench.hear(ASK) == [ASK]  # after reconnecting
    assert bench.say(HOMED) == [HOMED]


def test_bytes_delayed_for_the_previous_host_are_lost() -> None:
    bench = Bench("to_host delay frame by=5", "to_controller delay frame by=5")
    bench.say(HOMED)
    bench.hear(ASK)
    bench.line.host_came()
    bench.say(VELPARAMS)
    bench.clock.advance(10)
    assert bench.came == [(5 * SECOND, VELPARAMS)]
    assert bench.recorder.heard == [ASK]  # requests of the previous host still arrive


def test_a_delayed_cut_follows_delayed_bytes() -> None:
    bench = Bench("to_host disconnect byte at=3", "to_host delay frame by=1")
    bench.say(b"abcd", b"efgh")
    bench.clock.advance(5)
    assert bench.came == [(SECOND, b"abc")]
    assert bench.cuts == [SECOND]


def test_a_cut_can_happen_at_an_instant() -> None:
    bench = Bench("to_host disconnect after=1.5")
    bench.clock.advance(3)
    assert bench.cuts == [3 * SECOND // 2]
    assert bench.say(HOMED) == [HOMED]


def test_a_flood_sends_status_messages_by_default() -> None:
    bench = Bench("to_host flood count=3 period=0.5")
    bench.clock.advance(5)
    status = m.MotGetDcStatusUpdate(chan_ident=1, position=0, velocity=0, status_bits=0)
    expected = status.pack(dest=0x01, source=0x50)
    assert bench.came == [(at * SECOND // 2, expected) for at in range(3)]


def test_a_flood_after_a_frame_keeps_the_order() -> None:
    bench = Bench("to_host flood frame at=2 hex=ff count=2 period=0.1")
    bench.say(HOMED, VELPARAMS)
    bench.clock.advance(0.05)
    bench.say(HOMED)
    bench.clock.advance(1)
    assert [data for _, data in bench.came] == [HOMED, VELPARAMS, b"\xff", HOMED, b"\xff"]
    assert [when for when, _ in bench.came] == [0, 0, 0, SECOND // 20, SECOND // 10]


def test_a_running_flood_is_not_restarted() -> None:
    bench = Bench("to_host flood frame every=1 hex=ff count=5 period=1")
    bench.say(HOMED, HOMED)
    bench.clock.advance(2)
    bench.say(HOMED)
    bench.clock.advance(10)
    assert [data for _, data in bench.came].count(b"\xff") == 5
    bench.say(HOMED)
    bench.clock.advance(10)
    assert [data for _, data in bench.came].count(b"\xff") == 10


def test_a_flood_to_the_controller() -> None:
    bench = Bench(f"to_controller flood hex={ASK.hex()} count=3 period=0 after=1")
    bench.clock.advance(1)
    assert bench.recorder.heard == [ASK] * 3


def test_an_axis_sticks_for_a_while() -> None:
    bench = Bench("stick channel=1 after=1 for=2", "stick bay=1 channel=1", "stick axis=X after=9")
    parts = ["channel 1", "bay 1, channel 1", "axis X"]
    assert bench.recorder.stuck == [
        (0, part, False) for part in parts
    ]  # checks that the parts exist
    bench.clock.advance(5)
    assert bench.recorder.stuck[3:] == [
        (0, "bay 1, channel 1", True),
        (SECOND, "channel 1", True),
        (3 * SECOND, "channel 1", False),
    ]
    assert [(happened.time, str(happened)) for happened in bench.line.happened] == [
        (0, "stick channel=1 bay=1: bay 1, channel 1 is stuck"),
        (SECOND, "stick after=1.0 for=2.0 channel=1: channel 1 is stuck"),
        (3 * SECOND, "stick after=1.0 for=2.0 channel=1: channel 1 is free"),
    ]


@pytest.mark.parametrize(
    ("unit", "fault", "said"),
    [
        ("TDC001", "stick channel=2", "stick channel=2: no channel 2"),
        (
            "TDC001",
            "to_host drop message=MOT_GET_VELPARAM",
            "the TDC001 has no message 'MOT_GET_VELPARAM'; did you mean MOT_GET_VELPARAMS",
        ),
        ("TDC001", "to_host drop message=mot_get_velparams", "did you mean MOT_GET_VELPARAMS"),
        ("TDC001", "to_host drop message=X", "message 'X' ('stagewire show TDC001' lists them)"),
        ("MS2000", "to_host drop message=STOP_MOTOR", "STOP_MOTOR has no reply"),
        (
            "TDC001",
            "to_host drop message=MOT_MOVE_HOME",
            "MOT_MOVE_HOME is only sent to_controller",
        ),
        (
            "TDC001",
            "to_controller drop message=MOT_MOVE_HOMED",
            "MOT_MOVE_HOMED is only sent to_host",
        ),
        ("TDC001", "to_controller flood", "a flood to the controller requires hex=BYTES"),
        (
            "MS2000",
            "to_host flood",
            "the MS2000 has no known status message; give hex=BYTES",
        ),
        ("TDC001", "to_host dropp", "unknown action 'dropp'"),
    ],
)
def test_a_fault_that_a_unit_cannot_have_is_refused(unit: str, fault: str, said: str) -> None:
    with pytest.raises(FaultError, match=re.escape(said)):
        Bench(fault, unit=unit)


def test_a_fault_is_reported_immediately() -> None:
    bench = Bench("to_host drop frame at=1")
    told: list[FaultEvent] = []
    bench.line.on_fault = told.append
    bench.clock.advance(1.25)
    bench.say(VELPARAMS)
    [happened] = told
    assert happened.time == 5 * SECOND // 4
    assert str(happened) == (
        "to_host drop frame at=1: frame 1: 15 04 0e 00 81 50 01 00 00 00 00 00 01 00 00 00 …"
    )


def hits(seed: int, *faults: str) -> list[bytes]:
    return Bench(*faults, seed=seed).say(*frames(200))


def test_random_choices_depend_only_on_the_seed_and_the_fault() -> None:
    drop = "to_host drop frame p=0.5"
    assert hits(1, drop) == hits(1, drop)
    assert hits(1, drop) != hits(2, drop)
    assert 50 < len(hits(1, drop)) < 150
    # other faults and the other direction do not change it
    assert hits(1, drop) == hits(1, drop, "to_controller drop byte p=0.5", "to_host flip byte p=0")
    # two equal faults have different random streams
    assert len(hits(1, drop, drop)) < 0.8 * len(hits(1, drop))
    # a fault with its own seed is the same on every line, but differs by direction
    own = f"{drop} seed=3"
    assert hits(1, own) == hits(2, own) == hits(3, "to_host drop frame at=999", own)
    there = Bench("to_controller drop frame p=0.5 seed=3")
    heard = there.hear(*[bytes((0x43, 4, n, 0, 0x50, 1)) for n in range(1, 201)])
    assert [frame[2] for frame in heard] != [frame[2] for frame in hits(1, own)]


KINDS = [
    "drop {}", "insert {} hex=8000", "flip {}", "delay {} by=0.3", "delay {} by=0.2 overtaken=yes",
    "duplicate {} count=3", "disconnect {}", "flood {} count=3 hex=00",
]  # fmt: skip
FAULTS = [
    f"{direction} {kind.format(piece)} p=0.2"
    for direction in ("to_host", "to_controller")
    for piece in ("byte", "frame")
    for kind in KINDS
]


@settings(deadline=None)
@given(
    st.lists(st.sampled_from(FAULTS), max_size=4),
    st.lists(st.binary(max_size=12) | st.sampled_from([HOME, ASK]), max_size=10),
    st.integers(0, 3),
)
def test_faults_on_a_controller_are_reproducible(
    faults: list[str], chunks: list[bytes], seed: int
) -> None:
    def run() -> tuple[list[tuple[int, bytes]], list[str]]:
        clock = SteppedClock()
        line = FaultyLink(make_instrument(find_unit("TDC001"), clock, Options()), faults, seed)
        came: list[tuple[int, bytes]] = []
        line.on_send = lambda data: came.append((clock.now, data))
        for chunk in chunks:
            line.receive(chunk)
            clock.advance(0.1)
        return came, [f"{happened.time} {happened}" for happened in line.happened]

    assert run() == run()


def test_a_valid_request_is_answered_once_faults_have_passed() -> None:
    clock = SteppedClock()
    line = FaultyLink(
        make_instrument(find_unit("TDC001"), clock, Options()), ["to_controller flip byte at=1"]
    )
    came: list[bytes] = []
    line.on_send = came.append
    for _ in range(3):
        line.receive(ASK)
        clock.advance(2)
    assert [frame[:2] for frame in came] == [VELPARAMS[:2]] * len(came)
    assert len(came) >= 1


def test_a_stuck_motor_sends_no_completion() -> None:
    clock = SteppedClock()
    line = FaultyLink(
        make_instrument(find_unit("TDC001"), clock, Options()), ["stick channel=1 for=60"]
    )
    came: list[bytes] = []
    line.on_send = came.append
    move = m.MotMoveAbsolute(chan_ident=1, absolute_distance=1000)
    line.receive(move.pack(dest=0x50, source=0x01))
    clock.advance(59)
    assert not came
