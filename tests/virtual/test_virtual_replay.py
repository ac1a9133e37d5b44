"""Replays of recorded sessions: answers follow their requests as recorded, and differences are noted."""

from __future__ import annotations

import io
from collections.abc import Collection, Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire.capture import Capture, CaptureReader, CaptureWriter, Heading
from stagewire.errors import CaptureError
from stagewire.protocols import Direction
from stagewire_virtual.clock import SECOND, SteppedClock
from stagewire_virtual.errors import FaultError, ReplayError
from stagewire_virtual.factory import make_instrument
from stagewire_virtual.faults.link import FaultyLink
from stagewire_virtual.instrument import find_unit
from stagewire_virtual.options import Options
from stagewire_virtual.replay import Replay, load_replay

HEADING = "# stagewire capture 1 protocol=thorlabs_apt unit=TDC001\n"
SESSION = f"""{HEADING}# 0.000000 connected
10.000000 < 44 04 01 00 01 50  # MOT_MOVE_HOMED of an earlier session
10.500000 > 23 02 00 00 50 01  # MOD_IDENTIFY
11.000000 > 14 04 01 00 50 01  # MOT_REQ_VELPARAMS
11.010000 < 15 04 0e 00 81 50 01 00 00 00 00 00 01 00 00 00 02 00 00 00
11.500000 > 92 04 00 00 50 01  # MOT_ACK_DCSTATUSUPDATE
12.000000 > 43 04 01
12.100000 > 00 50 01 14 04 01  # the rest of MOT_MOVE_HOME
12.100000 > 00 50 01  # and MOT_REQ_VELPARAMS again
12.200000 < 15 04 0e 00 81 50
12.200000 < 01 00 00 00 00 00 01 00 00 00 02 00 00 00
14.100000 < 44 04 01 00 01 50  # MOT_MOVE_HOMED
"""
IDENTIFY, ASK, HOME, ACK = (
    bytes.fromhex(text) for text in ("230200005001", "140401005001", "430401005001", "920400005001")
)
HOMED = bytes.fromhex("440401000150")
VELPARAMS = bytes.fromhex("15040e00815001000000000001000000") + bytes.fromhex("02000000")


class Host:
    """The host of a replay."""

    def __init__(self, text: str = SESSION, *, lenient: bool = False) -> None:
        reader = CaptureReader()
        recorded = [*reader.feed(text), *reader.finish()]
        assert reader.heading is not None
        self.clock = SteppedClock()
        capture = Capture(reader.heading, tuple(recorded))
        self.replay = Replay(capture, self.clock, lenient=lenient)
        self.came: list[tuple[float, bytes]] = []
        self.replay.on_send = lambda data: self.came.append((self.clock.now / SECOND, data))

    def send(self, *requests: bytes) -> list[tuple[float, bytes]]:
        """Send requests; return what arrived since the last call, with the times in seconds."""
        for request in requests:
            self.replay.receive(request)
        found, self.came = self.came, []
        return found

    def wait(self, seconds: float) -> list[tuple[float, bytes]]:
        self.clock.advance(seconds)
        return self.send()


def test_an_answer_follows_its_request_after_the_same_time() -> None:
    host = Host()
    host.replay.host_came()
    assert host.send() == [(0.0, HOMED)]
    host.clock.advance(100)
    assert host.send(IDENTIFY) == []
    assert host.wait(1) == []
    assert host.send(ASK) == []
    assert host.wait(1) == [(101.01, VELPARAMS)]
    assert host.send(HOME + ASK) == []
    assert host.wait(10) == [
        (102.1, VELPARAMS[:6]),
        (102.1, VELPARAMS[6:]),
        (104.0, HOMED),
    ]
    assert host.replay.ok
    host.replay.check()
    assert host.replay.summary == "4 of 4 recorded requests were received"
    assert not host.replay.missing
    (row,) = host.replay.rows()
    assert (row.position, row.state) == ("4 of 4 requests", "at the end")


@given(st.lists(st.integers(1, 7), max_size=12), st.sets(st.integers(0, 30), max_size=5))
def test_chunks_and_acknowledgements_make_no_difference(sizes: list[int], acks: set[int]) -> None:
    """Acknowledgements may come at any time, between any two frames."""
    frames = [IDENTIFY, ASK, HOME, ASK]
    for place in sorted(acks, reverse=True):
        frames.insert(place % 5, ACK)
    data = b"".join(frames)
    host = Host()
    for size in [*sizes, len(data)]:
        host.send(data[:size])
        data = data[size:]
    assert host.replay.ok
    host.clock.advance(60)
    assert not host.replay.mismatches


def test_without_a_connection_the_first_request_starts_the_replay() -> None:
    host = Host()
    assert host.send(IDENTIFY) == [(0.0, HOMED)]
    host.replay.host_came()  # has no effect after the first request
    assert host.send() == []


def test_answers_keep_the_order_of_the_recording() -> None:
    text = f"""{HEADING}0 > {ASK.hex()}
1 < 01
1 > {HOME.hex()}
1.1 < 02
"""
    host = Host(text)
    host.send(ASK)
    host.send(HOME)  # sooner than in the recording
    assert host.wait(5) == [(1.0, b"\x01"), (1.0, b"\x02")]
    host.replay.power_cycle()
    host.send(ASK)
    host.clock.advance(0.95)
    host.send(HOME)
    assert host.wait(5) == [(6.0, b"\x01"), (6.05, b"\x02")]


BAYS = [bytes.fromhex(f"14040100{dest}01") for dest in ("21", "22", "23")]
ANSWERS = [VELPARAMS[:5] + bytes((dest,)) + VELPARAMS[6:] for dest in (0x21, 0x22, 0x23)]


def steps(text: str, host: Host) -> list[str]:
    """Return what a host receives after each request of a recording if it waits long after each."""
    found: list[str] = []
    for line in text.splitlines():
        _, mark, *data = line.split()
        if mark == ">":
            host.send(bytes.fromhex("".join(data)))
            found.append(b"".join(data for _, data in host.wait(60)).hex())
    return found


def test_each_of_several_requests_gets_its_own_answer() -> None:
    """Otherwise a host that waits for each answer would wait forever."""
    text = f"""\
1.0 > {BAYS[0].hex()}
1.1 > {BAYS[1].hex()}
1.2 > {HOME.hex()}
1.3 > {BAYS[2].hex()}
2.0 < {ANSWERS[1][:7].hex()}
2.1 < {ANSWERS[1][7:].hex()}{HOMED.hex()}{ANSWERS[0].hex()}{ANSWERS[2].hex()}44"""
    unit = HEADING.replace("TDC001", "BBD103")
    host = Host(unit + text)
    assert [came[1].hex() for came in host.send(BAYS[0]) + host.wait(1.1)] == [ANSWERS[0].hex()]
    assert host.send(BAYS[1]) == []
    assert host.wait(1) == [(2.0, ANSWERS[1][:7]), (2.1, ANSWERS[1][7:])]
    assert host.send(HOME) + host.wait(9) == []  # bytes that answer no request follow the last one
    assert [data for _, data in host.send(BAYS[2]) + host.wait(1)] == [HOMED, ANSWERS[2], b"D"]
    assert host.replay.ok


@pytest.mark.parametrize(
    ("requests", "said", "expected"),
    [
        ([ASK, ASK], [VELPARAMS], [[], [VELPARAMS]]),  # the first was lost
        ([ASK, ASK], [VELPARAMS, VELPARAMS], [[VELPARAMS], [VELPARAMS]]),
        ([ASK, IDENTIFY], [HOMED], [[], [HOMED]]),
        ([ASK, IDENTIFY], [HOMED, VELPARAMS], [[VELPARAMS], [HOMED]]),
        ([BAYS[0], ASK], [VELPARAMS, VELPARAMS], [[], [VELPARAMS, VELPARAMS]]),
    ],
)
def test_answers_are_assigned_to_one_of_several_requests(
    requests: list[bytes], said: list[bytes], expected: list[list[bytes]]
) -> None:
    text = "".join(f"0 > {data.hex()}\n" for data in requests)
    host = Host(f"{HEADING}{text}1 < {b''.join(said).hex()}\n")
    assert steps(text, host) == [b"".join(came).hex() for came in expected]


@pytest.mark.parametrize(
    ("requests", "said", "expected"),
    [
        ("1861033a 183f3a", "01020342", ["010203", "42"]),
        ("1861033a 18473a 183f3a", "01020342", ["010203", "", "42"]),  # a start has no reply
        ("1861033a 183f3a", "42", ["", "42"]),  # the first was lost
        ("1861033a 183f3a", "020342", ["", "020342"]),  # too short for both
        ("183f3a 1861033a", "ff42010203", ["42", "ff010203"]),  # noise
    ],
)
def test_replies_without_frames_are_assigned_by_their_length(
    requests: str, said: str, expected: list[str]
) -> None:
    text = "".join(f"0 > {data}\n" for data in requests.split())
    host = Host(f"# stagewire capture 1 protocol=asi_ms2000\n{text}1 < {said}\n")
    assert steps(text, host) == expected


@settings(deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(0, 5), st.sampled_from([ASK, HOME, IDENTIFY, VELPARAMS, HOMED]))
        | st.tuples(
            st.integers(0, 5), st.binary(min_size=1, max_size=9).map(lambda b: b"\xff" + b)
        ),
        max_size=20,
    )
)
def test_a_host_that_repeats_the_recording_gets_the_same_bytes(
    said: list[tuple[int, bytes]],
) -> None:
    """Every byte arrives at its instant, whichever request it was assigned to.

    Bytes of one instant are in the order of the recording, unless a request arrives at the same instant: the
    answer to an earlier request may then precede those bytes that the recording has before it.
    """
    lines, sent, came, now = [], [], [], 0
    for seconds, data in said:
        now += seconds
        of_host = data in (ASK, HOME, IDENTIFY)
        (sent if of_host else came).append((now, data))
        lines.append(f"{now} {'>' if of_host else '<'} {data.hex()}\n")
    host = Host(HEADING + "".join(lines))
    start = said[0][0] if said else 0
    host.replay.host_came()
    for when, data in sent:
        host.clock.run_until((when - start) * SECOND)
        host.replay.receive(data)
    host.clock.run_until(now * SECOND)
    requested = {float(when) for when, _ in sent}
    assert by_instant(host.came, start, requested) == by_instant(came, 0, requested)


def by_instant(
    said: Sequence[tuple[float, bytes]], start: float, unordered: Collection[float]
) -> dict[float, bytes]:
    """Return the bytes of each instant; those of ``unordered`` instants are sorted."""
    found: dict[float, bytes] = {}
    for when, data in said:
        found[when + start] = found.get(when + start, b"") + data
    return {
        when: bytes(sorted(data)) if when in unordered else data for when, data in found.items()
    }


def test_a_strict_replay_waits_for_the_recorded_request() -> None:
    host = Host()
    assert host.send(HOME) == [(0.0, HOMED)]  # the beginning, and no answer
    assert host.wait(10) == []
    assert not host.replay.ok
    assert [str(mismatch) for mismatch in host.replay.mismatches] == [
        "line 4: expected MOD_IDENTIFY (23 02 00 00 50 01), got MOT_MOVE_HOME (43 04 01 00 50 01)"
    ]
    (row,) = host.replay.rows()
    assert (row.position, row.state) == ("0 of 4 requests", "waits for line 4")
    host.send(IDENTIFY, ASK)
    assert host.wait(1) == [(10.01, VELPARAMS)]
    assert host.replay.missing == [
        "line 9: MOT_MOVE_HOME (43 04 01 00 50 01)",
        "line 10: MOT_REQ_VELPARAMS (14 04 01 00 50 01)",
    ]
    with pytest.raises(ReplayError) as caught:
        host.replay.check()
    assert str(caught.value).splitlines() == [
        "2 of 4 recorded requests were received",
        "1 different:",
        "  line 4: expected MOD_IDENTIFY (23 02 00 00 50 01), got MOT_MOVE_HOME (43 04 01 00 50 01)",
        "2 missing:",
        "  line 9: MOT_MOVE_HOME (43 04 01 00 50 01)",
        "  line 10: MOT_REQ_VELPARAMS (14 04 01 00 50 01)",
    ]


def test_a_lenient_replay_continues_at_the_next_equal_request() -> None:
    host = Host(lenient=True)
    host.send(HOME)  # IDENTIFY and ASK were left out
    assert [mismatch.line for mismatch in host.replay.mismatches] == [4]
    host.send(IDENTIFY)  # not in the rest of the recording
    host.send(ASK)
    assert [data for _, data in host.wait(5)] == [VELPARAMS[:6], VELPARAMS[6:], HOMED]
    assert not host.replay.ok
    assert [mismatch.line for mismatch in host.replay.mismatches] == [4, 10]
    assert host.replay.missing == [
        "line 4: MOD_IDENTIFY (23 02 00 00 50 01)",
        "line 5: MOT_REQ_VELPARAMS (14 04 01 00 50 01)",
    ]
    assert (host.replay.seen, host.replay.requests) == (2, 4)


def test_a_request_after_the_end_is_a_difference() -> None:
    host = Host(f"{HEADING}0 > {ASK.hex()}\n")
    host.send(ASK, bytes.fromhex("ffff00005001"))
    assert [str(mismatch) for mismatch in host.replay.mismatches] == [
        "after the end of the recording: got unknown (ff ff 00 00 50 01)"
    ]
    assert not host.replay.ok


def test_differences_are_bounded_and_counted() -> None:
    host = Host()
    for _ in range(3):
        host.send(HOME * 1000)
    assert len(host.replay.mismatches) == 1000
    assert "3000 different:" in host.replay.summary
    assert len(host.replay.summary.splitlines()) < 30


@pytest.mark.parametrize("text", [HEADING, f"{HEADING}3 < 00\n"])
def test_a_recording_may_have_no_requests(text: str) -> None:
    host = Host(text)
    assert host.replay.ok
    host.replay.host_came()
    assert [data.hex() for _, data in host.wait(0)] == (["00"] if "<" in text else [])
    assert [row.state for row in host.replay.rows()] == ["at the end"]
    host.send(ASK)
    assert not host.replay.ok


def test_a_damaged_length_is_given_up_as_in_the_recording() -> None:
    huge = "53 04 00 80 d0 01"  # declares a packet of 32 KiB
    host = Host(f"{HEADING}0 > {huge}\n3 > {ASK.hex()}\n3.1 < 01\n")
    assert host.replay.requests == 1
    host.send(bytes.fromhex(huge))
    host.clock.advance(2)
    host.send(ASK)
    assert host.wait(1) == [(2.1, b"\x01")]
    assert host.replay.ok


def test_garbage_is_not_a_request() -> None:
    host = Host(f"{HEADING}0 > ff ff ff ff ff ff ff {ASK.hex()}\n0.1 < 01\n")
    host.send(ASK)
    assert host.wait(1) == [(0.1, b"\x01")]
    assert host.replay.ok


def test_commands_of_an_ms2000_are_replayed() -> None:
    text = """# stagewire capture 1 protocol=asi_ms2000 unit=MS2000
0.0 > 18 61 03 3a 18 3f 3a
0.1 < 01 02 03 42
0.2 > ff 52
"""
    host = Host(text)
    host.send(bytes.fromhex("1861033a18"))
    host.send(bytes.fromhex("3f3a"))
    assert [data.hex() for _, data in host.wait(1)] == ["010203", "42"]
    host.send(bytes.fromhex("3a"))  # a stray terminator
    host.send(bytes.fromhex("ff52"))
    assert host.replay.ok


def test_the_text_of_an_ms2000_is_compared_and_answered() -> None:
    host = Host("""# stagewire capture 1 protocol=asi_ms2000 unit=MS2000
0.0 > 57 20 58 0d
0.1 < 3a 41 20 30 0d 0a
0.2 > ff 42 18 61 03 3a
0.3 < 01 02 03
""")
    host.send(b"W X\r")
    assert b"".join(data for _, data in host.wait(1)) == b":A 0\r\n"
    host.send(b"W Y\r")
    assert str(host.replay.mismatches[0]) == (
        "line 4: expected SWITCH_TO_LOW_LEVEL (ff 42), got 'W Y\\r'"
    )
    host.send(bytes.fromhex("ff42 1861033a"))
    assert [data for _, data in host.wait(1)][-1] == b"\x01\x02\x03"
    assert (host.replay.seen, host.replay.requests, host.replay.missing) == (3, 3, [])


def test_each_line_of_text_gets_its_own_answer() -> None:
    host = Host("""# stagewire capture 1 protocol=asi_ms2000 unit=MS2000
0.0 > 57 20 58 0d 0d 2f 0d ff 42 18 3f 3a
0.1 < 3a 41 20 30 0d 0a 4e 0d 0a 62
""")
    answers = [(b"W X\r", b":A 0\r\n"), (b"\r", b""), (b"/\r", b"N\r\n"), (b"\xffB", b"")]
    for request, answer in [*answers, (b"\x18?:", b"b")]:
        host.send(request)
        assert b"".join(data for _, data in host.wait(1)) == answer
    assert host.replay.ok


def test_a_recording_may_name_an_unknown_unit() -> None:
    host = Host("# stagewire capture 1 protocol=thorlabs_apt unit=KDC101\n0 > 140401005001\n")
    assert host.replay.unit.name == "KDC101"
    host.send(ASK)
    assert host.replay.ok
    nameless = Host("# stagewire capture 1 protocol=thorlabs_apt\n")
    assert nameless.replay.unit.name == "recorded"


def test_a_replay_notices_a_host_through_a_line_with_faults() -> None:
    came: list[bytes] = []
    line = FaultyLink(Host().replay, ["to_host drop frame message=MOT_GET_VELPARAMS"])
    line.on_send = came.append
    line.host_came()
    assert came == [HOMED]


def test_faults_apply_to_a_replay() -> None:
    host = Host()
    line = FaultyLink(host.replay, ["to_host drop frame message=MOT_GET_VELPARAMS"])
    came: list[bytes] = []
    line.on_send = came.append
    for request in (IDENTIFY, ASK, HOME, ASK):
        line.receive(request)
        host.clock.advance(1)
    host.clock.advance(5)
    assert came == [HOMED, VELPARAMS[:6], VELPARAMS[6:], HOMED]
    with pytest.raises(FaultError, match="no channel 1 in a recording"):
        FaultyLink(host.replay, ["stick channel=1"])
    with pytest.raises(FaultError, match="give hex=BYTES"):
        FaultyLink(Host("# stagewire capture 1 protocol=thorlabs_apt\n").replay, ["to_host flood"])


def test_a_replay_is_loaded_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "session.txt"
    path.write_text(SESSION, encoding="utf-8")
    assert load_replay(path, SteppedClock()).requests == 4
    path.write_text(SESSION.replace("14.1", "x"), encoding="utf-8")
    with pytest.raises(CaptureError, match=r"session\.txt, line 13: 'x00000' is not a time"):
        load_replay(path, SteppedClock())
    path.write_text("# stagewire capture 1 protocol=nothing\n", encoding="utf-8")
    with pytest.raises(
        CaptureError, match=r"session\.txt, line 1: no protocol nothing is installed"
    ):
        load_replay(path, SteppedClock())


REQUEST, ANSWER = "43 04 01 00", "15 04 0e 00 81 50 01"
CUT_OFF = "line {}: the recording ends in the middle of {}, {} ({} …)"


@pytest.mark.parametrize(
    ("rest", "said"),
    [
        ([f"15 > {REQUEST}"], [(14, "a request", "which is left out", REQUEST)]),
        ([f"15 > {REQUEST}", "15 > 50 01"], []),
        (["15 > 53 04 06 00 d0 01 01 00", "17 > 92 04 00 00 50 01"], []),  # given up before the end
        ([f"15 < {ANSWER}"], [(14, "an answer", "sent as recorded", ANSWER)]),
        (
            [f"15 < {ANSWER}", "16 > 43"],
            [
                (15, "a request", "which is left out", "43"),
                (14, "an answer", "sent as recorded", ANSWER),
            ],
        ),
    ],
)
def test_an_incomplete_frame_at_the_end_is_reported(
    rest: list[str], said: list[tuple[int, str, str, str]]
) -> None:
    summary = Host(SESSION + "\n".join(rest)).replay.summary.splitlines()
    told = [line for line in summary if "ends in the middle" in line]
    assert told == [CUT_OFF.format(*each) for each in said]


START, STOP = bytes.fromhex("110000005001"), bytes.fromhex("120000005001")


@settings(deadline=None, max_examples=25)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([ASK, START, STOP, IDENTIFY, ACK, bytes.fromhex("050000005001")]),
            st.integers(0, 400),
        ),
        max_size=8,
    )
)
def test_a_recorded_virtual_controller_is_played_back_to_the_nanosecond(
    session: list[tuple[bytes, int]],
) -> None:
    clock = SteppedClock()
    instrument = make_instrument(find_unit("TDC001"), clock, Options())
    text = io.StringIO()
    writer = CaptureWriter(text, Heading("thorlabs_apt", "TDC001"))
    said: list[tuple[float, bytes]] = []

    def on_send(data: bytes) -> None:
        writer.write(clock.now, Direction.TO_HOST, data)
        said.append((clock.now / SECOND, data))

    instrument.on_send = on_send
    for request, milliseconds in session:
        writer.write(clock.now, Direction.TO_CONTROLLER, request)
        instrument.receive(request)
        clock.advance(milliseconds / 1000)

    host = Host(text.getvalue())
    came: list[tuple[float, bytes]] = []
    for request, milliseconds in session:
        came += host.send(request)
        came += host.wait(milliseconds / 1000)
    assert came == said
    assert host.replay.ok
