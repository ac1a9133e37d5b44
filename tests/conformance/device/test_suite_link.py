"""The guarded link as checks use it: requests and replies, the inbox, keep-alive messages, and waiting."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from watched_links import DeadLink, WatchedLink, declared_as

import stagewire_virtual
from stagewire.protocols import Frame
from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_conformance.device.declaration import Declaration, declare
from stagewire_conformance.device.lines.apt_line import AptLine
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.pics import Pics
from stagewire_virtual.linking import SteppedLink

HOST = 0x01
SIGN = m.MotAckDcStatusUpdate()
ASKED = m.MotReqPosCounter(1)


class ScriptedLink(DeadLink):
    """A line whose other end sends scripted bytes when they are due."""

    def __init__(self, *script: tuple[float, bytes]) -> None:
        super().__init__()
        self.script = list(script)
        self.writes: list[tuple[float, bytes]] = []

    def read(self, timeout: float) -> bytes:
        end = self.now + max(0.0, timeout)
        if self.script and self.script[0][0] <= end:
            due, data = self.script.pop(0)
            self.now = max(self.now, due)
            return data
        self.now = end
        return b""

    def write(self, data: bytes) -> None:
        self.writes.append((self.now, data))


def position(value: int, source: int = 0x50, dest: int = HOST, channel: int = 1) -> bytes:
    return m.MotGetPosCounter(channel, value).pack(dest, source)


def line_to(link: DeadLink | WatchedLink, declared: Declaration | None = None) -> AptLine:
    allowed = Permissions(motion=Range.parse("0..1000counts"))
    return AptLine(link, declared or declare("TDC001"), allowed)


def told(*script: tuple[float, bytes], unit: str = "TDC001") -> AptLine:
    return line_to(ScriptedLink(*script), declare(unit))


# Requests


def test_a_request_returns_its_reply_immediately() -> None:
    line = told((0.2, position(7)))
    heard = line.ask(ASKED, 0x50)
    assert heard is not None
    assert heard.message == m.MotGetPosCounter(1, 7)
    assert (heard.time, line.now) == (0.2, 0.2)
    assert line.heard == []


@pytest.mark.parametrize(
    "other",
    [
        position(1, source=0x22),  # from another bay
        position(1, channel=2),  # for another channel
        m.MotGetEncCounter(1, 1).pack(HOST, 0x50),  # another message
        m.MotGetDcStatusUpdate(1, 1, 0, 0).pack(HOST, 0x50),
        b"\x00" * 5,
        bytes.fromhex("34120200 81 50 0102"),  # an unknown id
    ],
    ids=["bay", "channel", "message", "status", "garbage", "unknown"],
)
def test_other_messages_stay_in_the_inbox(other: bytes) -> None:
    line = told(
        (0.1, other), (0.2, position(7)), unit="BBD102" if other[5:6] == b"\x22" else "TDC001"
    )
    heard = line.ask(ASKED, 0x50)
    assert heard is not None
    assert heard.message.position == 7
    assert b"".join(each.raw for each in line.heard) == other
    assert [each.raw for each in line.listen(0)] == [other]
    assert line.listen(0) == []


@pytest.mark.parametrize("addresses", [(0x50, HOST), (0, 0)], ids=["unswapped", "zero"])
def test_a_reply_with_wrong_addresses_is_accepted(addresses: tuple[int, int]) -> None:
    dest, source = addresses
    line = told((0.1, position(7, dest=dest, source=source)))
    heard = line.ask(ASKED, 0x50)
    assert heard is not None
    assert (heard.dest, heard.source) == addresses


def test_without_a_reply_the_wait_ends_at_the_timeout() -> None:
    line = told()
    assert line.ask(ASKED, 0x50, wait=0.7) is None
    assert line.now == pytest.approx(0.7)


def test_an_earlier_message_is_never_taken_as_the_reply() -> None:
    line = told(
        (0.0, position(1)), (0.5, position(2))
    )  # the first may be a duplicate of an earlier reply
    heard = line.ask(ASKED, 0x50)
    assert heard is not None
    assert heard.message.position == 2
    assert [other.message.position for other in line.listen(0)] == [1]
    line = told((0.0, position(1)), (0.5, position(2)))
    assert [heard.message.position for heard in line.ask_all(ASKED, 0x50)] == [2]


def test_ask_all_returns_a_second_answer_but_not_a_much_later_one() -> None:
    line = told((0.1, position(1)), (0.14, position(1)), (0.3, position(1)))
    assert [heard.time for heard in line.ask_all(ASKED, 0x50)] == [0.1, 0.14]
    assert line.now == pytest.approx(0.15)
    assert [heard.time for heard in line.listen(1)] == [0.3]


def test_ask_all_without_a_reply_returns_other_messages() -> None:
    line = told((0.1, position(1, channel=2)), (0.2, position(1, source=0x22)), unit="BBD102")
    came = line.ask_all(ASKED, 0x21, wait=0.5)
    assert [(heard.source, heard.channel) for heard in came] == [(0x50, 2), (0x22, 1)]
    assert line.now == pytest.approx(0.5)


# Listening


def test_listening_ends_with_the_expected_message() -> None:
    line = told((0.1, position(1)), (0.2, position(2) + position(3)), (0.4, position(4)))
    came = line.listen(9, until=lambda heard: heard.message.position == 2)
    assert [heard.message.position for heard in came] == [1, 2]
    assert line.now == pytest.approx(0.2)
    assert [heard.message.position for heard in line.listen(0)] == [3]


def test_listening_checks_received_messages_first() -> None:
    line = told((0.1, position(1) + position(2)))
    line.ask(ASKED, 0x50)
    came = line.listen(9, until=lambda heard: heard.message.position == 2)
    assert [heard.message.position for heard in came] == [2]
    assert line.now == pytest.approx(0.1)


def test_draining_waits_for_quiet_up_to_a_limit() -> None:
    line = told((0.03, position(1)), (0.07, position(2)), (0.5, position(3)))
    assert [heard.message.position for heard in line.drain()] == [1, 2]
    assert line.now == pytest.approx(0.12)
    talks = [(0.02 * number, position(number)) for number in range(200)]
    endless = told(*talks)
    assert len(endless.drain()) >= 49
    assert endless.now == pytest.approx(1.0, abs=0.03)


def test_half_a_frame_is_given_up_and_the_next_one_is_received() -> None:
    line = told((0.1, position(1)[:9]), (0.5, position(2)))
    came = line.listen(1)
    assert [heard.kind for heard in came] == ["garbage", "message"]
    assert came[0].raw == position(1)[:9]
    assert came[0].time == pytest.approx(0.2)
    assert came[1].message.position == 2


def test_a_frame_that_arrives_in_pieces_is_assembled() -> None:
    raw = position(5)
    line = told(*((0.05 * index, raw[index : index + 1]) for index in range(len(raw))))
    assert [heard.raw for heard in line.listen(2)] == [raw]


KINDS = {
    "message": position(1),
    "unknown": bytes.fromhex("34120200 81 50 0102"),
    "bad_length": bytes.fromhex("12040200 81 50 0100"),
    "garbage": b"\x99",
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_event_is_received_and_described(kind: str) -> None:
    line = told((0.1, KINDS[kind] + position(2)))
    first, second = line.listen(1)
    assert (first.kind, first.raw) == (kind, KINDS[kind])
    assert second.message.position == 2
    assert first.text
    assert [entry.text for entry in line.log if not entry.sent] == [first.text, second.text]
    if kind in ("unknown", "bad_length", "garbage"):
        assert (first.message, first.name, first.channel, first.extra) == (None, "", None, b"")


def test_bytes_beyond_a_layout_are_kept() -> None:
    frame = Frame(m.MotGetPosCounter(1, 3), HOST, 0x50, b"\x01\x02")
    line = told((0.1, frame.encode()))
    heard = line.ask(ASKED, 0x50)
    assert heard is not None
    assert (heard.extra, heard.payload) == (b"\x01\x02", 8)


# Contexts


@pytest.mark.parametrize(
    ("unit", "address", "cls"),
    [
        ("TDC001", 0x50, m.MotMoveCompletedDc),
        ("TDC001", 0, m.MotMoveCompletedDc),
        ("TST001", 0x50, m.MotMoveCompletedStepper),
        ("BBD102", 0x22, m.MotMoveCompletedDc),
    ],
)
def test_the_declared_status_decides_between_layouts(unit: str, address: int, cls: type) -> None:
    raw = (
        bytes.fromhex("6404 0e00")
        + bytes([0x80 | bool(address), address])
        + bytes.fromhex("0100")
        + bytes(12)
    )
    line = told((0.1, raw), unit=unit)
    [heard] = line.listen(1)
    assert type(heard.message) is cls


# Keep-alive messages


def signs(link: ScriptedLink) -> list[tuple[float, int]]:
    raw = SIGN.pack(0, HOST)[:2]
    return [(round(time, 3), data[4]) for time, data in link.writes if data[:2] == raw]


def test_keep_alive_messages_are_sent_twice_a_second_during_a_wait() -> None:
    link = ScriptedLink()
    line = line_to(link)
    line.listen(2.2)
    assert signs(link) == [(0.0, 0x50), (0.5, 0x50), (1.0, 0x50), (1.5, 0x50), (2.0, 0x50)]
    assert all(entry.keep_alive for entry in line.log)


def test_every_bay_gets_its_own_keep_alive_messages() -> None:
    link = ScriptedLink()
    line_to(link, declared_as("BBD102")).listen(0.7)
    assert signs(link) == [(0.0, 0x21), (0.0, 0x22), (0.5, 0x21), (0.5, 0x22)]


def test_no_keep_alive_is_sent_inside_a_silent_block() -> None:
    link = ScriptedLink()
    line = line_to(link)
    with line.silent(), line.silent():
        line.listen(2)
        line.send(ASKED, 0x50)
    assert signs(link) == []
    line.listen(0.1)
    assert len(signs(link)) == 1


@pytest.mark.parametrize(
    "declared",
    [
        declare("TPZ001"),
        declare(Pics(unit="TDC001", line="rs232")),
        declare(Pics(unit="TDC001", unsupported={"MOT_ACK_DCSTATUSUPDATE": "not needed"})),
    ],
    ids=["none in its list", "rs232", "unsupported"],
)
def test_no_keep_alive_is_sent_to_units_without_need(declared: Declaration) -> None:
    link = ScriptedLink()
    line_to(link, declared).listen(2)
    assert signs(link) == []


def test_keep_alive_messages_keep_the_updates_coming() -> None:
    line = line_to(WatchedLink(SteppedLink(stagewire_virtual.TDC001(stage=stages.Z8))))
    line.send(m.HwStartUpdateMsgs(10), 0x50)
    assert len(line.listen(10)) == 100
    with line.silent():
        assert len(line.listen(10)) < 60


def test_time_passes_only_on_the_line() -> None:
    controller = stagewire_virtual.TDC001()
    line = line_to(WatchedLink(SteppedLink(controller)))
    for _ in range(100):
        line.ask(ASKED, 0x50)
    assert controller.clock.now == 0
    line.listen(1.5)
    assert line.now == pytest.approx(1.5)


def test_requests_and_replies_are_decoded_in_the_log() -> None:
    line = told((0.1, position(7)))
    with line.silent():
        line.ask(ASKED, 0x50)
    assert texts(line.log) == [
        "0x01->0x50 MOT_REQ_POSCOUNTER chan_ident=1",
        "0x50->0x01 MOT_GET_POSCOUNTER chan_ident=1 position=7",
    ]


def texts(entries: Iterable) -> list[str]:
    return [entry.text for entry in entries]
