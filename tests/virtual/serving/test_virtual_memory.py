"""Controllers in memory, with a stepped clock."""

from __future__ import annotations

import pytest
from echo_instrument import TICK, EchoInstrument, Notebook
from hypothesis import given, settings
from hypothesis import strategies as st

import stagewire_virtual as virtual
from stagewire.errors import BadValueError, StagewireError
from stagewire.framing import Garbage, ReplyReceived, TextReceived
from stagewire_apt import messages as apt
from stagewire_apt import stages
from stagewire_ms2000 import messages as ms
from stagewire_virtual.clock import SECOND, SteppedClock
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.errors import UnpluggedError, VirtualError
from stagewire_virtual.faults.link import FaultyLink
from stagewire_virtual.serving.link import MemoryLink

REQ_INFO = bytes.fromhex("05 00 00 00 50 01")
START_UPDATES = bytes.fromhex("11 00 00 00 50 01")


def echo_link(clock: SteppedClock | None = None) -> VirtualController:
    return VirtualController(EchoInstrument, clock, "echo")


def test_written_bytes_are_answered_immediately() -> None:
    with echo_link() as link:
        assert link.write(b"hello") == 5
        assert (link.link.received, link.link.sent) == (5, 1)
        assert link.read(2) == b"he"
        assert link.read() == b"llo"
        assert link.read() == b""
        assert link.clock.now == 0


@pytest.mark.parametrize("data", [bytearray(b"abc"), memoryview(b"abc")])
def test_bytes_like_objects_can_be_written(data: bytes) -> None:
    with echo_link() as link:
        link.write(data)
        assert link.read() == b"abc"


def test_writing_a_string_is_refused() -> None:
    with echo_link() as link, pytest.raises(BadValueError, match="bytes, not str"):
        link.write("abc")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("size", "timeout", "read", "passed"),
    [
        (None, 0, b"", 0),
        (None, 0.009, b"", 0.009),
        (None, 1, TICK, 0.01),  # returns as soon as there are enough bytes
        (5, 1, TICK, 0.01),
        (6, 1, TICK + TICK[:1], 0.02),
        (11, 0.025, 2 * TICK, 0.025),  # returns the bytes received by then
        (0, 1, b"", 0),
    ],
)
def test_a_read_advances_the_clock_until_there_are_enough_bytes(
    size: int | None, timeout: float, read: bytes, passed: float
) -> None:
    with echo_link() as link:
        link.write(b"t")
        assert link.read(size, timeout) == read
        assert link.clock.now == pytest.approx(passed * SECOND)


@pytest.mark.parametrize(
    ("size", "timeout"), [(-1, 0), (1, -1), (1, float("nan")), (1, float("inf")), (1, 1e300)]
)
def test_a_negative_size_or_an_infinite_timeout_is_refused(size: int, timeout: float) -> None:
    with (
        echo_link() as link,
        pytest.raises(BadValueError, match=r"size of at least 0 and a finite"),
    ):
        link.read(size, timeout)


def test_controllers_on_one_clock_have_the_same_time() -> None:
    clock = SteppedClock()
    with echo_link(clock) as one, echo_link(clock) as other:
        one.write(b"t")
        clock.advance(0.005)
        other.write(b"t")
        one.advance(0.01)
        assert (one.read(), other.read()) == (TICK, TICK)
        assert one.clock.now == other.clock.now == clock.now == 0.015 * SECOND


def test_a_controller_in_memory_requires_a_stepped_clock() -> None:
    with pytest.raises(VirtualError, match=r"SteppedClock, not RealClock: .*; tcp\(\) and pty\(\)"):
        VirtualController(EchoInstrument, virtual.RealClock())  # type: ignore[arg-type]


def test_an_unplugged_line_returns_earlier_bytes_and_then_raises() -> None:
    with echo_link() as link:
        link.write(b"before, unread")
        link.unplug()
        link.plug_in()
        assert link.read() == b""
        link.write(b"before")
        link.unplug()
        assert link.read() == b"before"
        with pytest.raises(UnpluggedError, match="is unplugged"):
            link.read(timeout=1)
        with pytest.raises(UnpluggedError, match=r"plug_in\(\)"):
            link.write(b"x")
        link.plug_in()
        link.write(b"after")
        assert link.read() == b"after"


def test_messages_while_unplugged_are_lost() -> None:
    with echo_link() as link:
        link.write(b"t")
        link.unplug()
        link.advance(1)
        link.plug_in()
        assert link.read() == b""
        assert link.read(timeout=1) == TICK


def test_memory_is_bounded_and_only_whole_frames_are_dropped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(MemoryLink, "limit", 12)
    book = Notebook()
    link = MemoryLink(EchoInstrument(SteppedClock()), observer=book)
    for chunk in (b"12345", b"abcde", b"ABCDE", b"12"):
        link.write(chunk)
    assert link.dropped == 1
    assert len(book.notes) == 1
    assert "does not read" in book.notes[0]
    assert link.read() == b"12345abcde12"


def test_an_observer_gets_bytes_and_times() -> None:
    book = Notebook()
    clock = SteppedClock()
    link = MemoryLink(EchoInstrument(clock), label="p", observer=book)
    clock.advance(0.5)
    link.write(b"x")
    link.write(b"t")
    clock.advance(0.015)
    half = SECOND // 2
    ticked = half + SECOND // 100
    assert book.lines == [
        (">", half, b"x"),
        ("<", half, b"x"),
        (">", half, b"t"),
        ("<", ticked, TICK),
    ]


def test_a_power_cycle_keeps_the_line_plugged_in() -> None:
    with virtual.TDC001() as tdc:
        tdc.write(START_UPDATES)
        tdc.advance(0.25)
        assert len(tdc.read_frames()) == 2
        tdc.power_cycle()
        assert tdc.read_frames(timeout=1) == []
        tdc.write(REQ_INFO)
        assert tdc.read_frames()[0].frame.message.layout.message == "HW_GET_INFO"


@pytest.mark.parametrize(
    ("name", "address", "completed"),
    [
        ("TDC001", 0x50, apt.MotMoveCompletedDc),
        ("TST001", 0x50, apt.MotMoveCompletedStepper),
        ("BBD102", 0x22, apt.MotMoveCompletedDc),
        ("MST601", 0x21, apt.MotMoveCompletedStepper),
    ],
)
def test_frames_are_decoded_with_the_status_of_the_unit(
    name: str, address: int, completed: type[apt.MotMoveCompletedDc]
) -> None:
    with getattr(virtual, name)(position=1000) as controller:
        controller.write(apt.MotMoveRelative(1, 10).pack(address, 1))
        (event,) = controller.read_frames(timeout=60)
        assert isinstance(event.frame.message, completed)
        assert event.frame.source == address


@pytest.mark.parametrize("quirk", ["zero_addresses", "unswapped_addresses"])
def test_frames_with_unusual_addresses_are_decoded(quirk: str) -> None:
    with virtual.TDC001(quirks=[quirk], position=1000) as controller:
        controller.write(apt.MotMoveRelative(1, 10).pack(0x50, 1))
        (event,) = controller.read_frames(timeout=60)
        assert isinstance(event.frame.message, apt.MotMoveCompletedDc)
        assert event.frame.source != 0x50


def test_an_incomplete_frame_is_kept_until_its_rest_arrives() -> None:
    with virtual.TDC001(faults=["to_host delay byte at=11 by=0.5"]) as tdc:
        tdc.write(REQ_INFO)
        assert tdc.read_frames() == []
        (event,) = tdc.read_frames(timeout=1)
        assert event.frame.message.layout.message == "HW_GET_INFO"


def test_replies_are_decoded_by_the_commands() -> None:
    with virtual.MS2000() as controller:
        controller.write(ms.SwitchToLowLevel().pack())
        position = ms.ReadMotorPosition().pack(24)
        controller.write(position[:2])
        controller.write(position[2:] + ms.ReadIdentification().pack(24))
        first, second = controller.read_frames()
        assert isinstance(first, ReplyReceived)
        assert isinstance(second, ReplyReceived)
        assert first.reply == ms.ReadMotorPositionReply(0)
        assert second.request.message == ms.ReadIdentification()


def test_the_next_command_gives_up_an_unanswered_one() -> None:
    with virtual.MS2000() as controller:
        controller.write(ms.SwitchToLowLevel().pack())
        controller.write(ms.ReadIdentification().pack(99))  # no such axis
        assert controller.read_frames() == []
        controller.write(ms.ReadMotorPosition().pack(24))
        (event,) = controller.read_frames()
        assert isinstance(event, ReplyReceived)
        assert event.reply == ms.ReadMotorPositionReply(0)


def test_a_command_without_a_reply_gives_up_no_other() -> None:
    with virtual.MS2000(faults=["to_host delay frame by=0.5"]) as controller:
        controller.write(ms.SwitchToLowLevel().pack())
        controller.write(ms.ReadIdentification().pack(24))
        assert controller.read_frames() == []
        controller.write(ms.StopMotor().pack(24))
        (event,) = controller.read_frames(timeout=1)
        assert isinstance(event, ReplyReceived)
        assert event.request.message == ms.ReadIdentification()


def test_a_reply_without_a_command_is_garbage() -> None:
    with virtual.MS2000() as controller:
        controller.link.write(b"V\r")  # not through the controller, which decodes replies
        (event,) = controller.read_frames()
        assert isinstance(event, Garbage)


def test_lines_of_text_are_returned_as_events() -> None:
    with virtual.MS2000() as controller:
        controller.write(b"W X\r")
        controller.write(b"/\r")
        assert controller.read_frames() == [TextReceived(b":A 0\r\n"), TextReceived(b"N\r\n")]


def test_a_reply_read_as_bytes_counts_as_answered() -> None:
    with virtual.MS2000() as controller:
        controller.write(ms.SwitchToLowLevel().pack())
        controller.write(ms.ReadMotorPosition().pack(24))
        assert controller.read() == bytes(3)
        controller.write(ms.ReadStatusByte().pack(24))
        (event,) = controller.read_frames()
        assert isinstance(event, ReplyReceived)
        assert event.request.message == ms.ReadStatusByte()


@pytest.mark.parametrize("size", [1, 5, 6, 7, 90])
def test_reading_part_of_a_frame_as_bytes_does_not_split_it(size: int) -> None:
    with virtual.TDC001() as tdc:
        tdc.write(REQ_INFO)
        tdc.read(size)
        tdc.write(REQ_INFO)
        events = tdc.read_frames()
        assert [len(event.raw) for event in events] == [90] * (1 if size == 90 else 2)


def test_a_disconnect_within_a_frame_leaves_a_part_of_it() -> None:
    with virtual.TDC001(faults=["to_host disconnect byte at=7"]) as tdc:
        tdc.write(REQ_INFO)
        assert len(tdc.read()) < 90
        with pytest.raises(UnpluggedError):
            tdc.read()


@settings(max_examples=30)
@given(st.lists(st.binary(max_size=40), max_size=8), st.floats(0, 2))
def test_the_same_requests_at_the_same_times_get_the_same_answers(
    chunks: list[bytes], step: float
) -> None:
    def session() -> bytes:
        with virtual.TDC001(seed=3, stage=stages.Z8) as tdc:
            said = b""
            for chunk in chunks:
                tdc.write(chunk)
                said += tdc.read(timeout=step)
            return said

    assert session() == session()


def test_a_controller_can_be_closed_twice() -> None:
    link = echo_link()
    link.close()
    link.close()
    with pytest.raises(StagewireError):
        link.write(b"x")


@pytest.mark.parametrize(
    ("fault", "noted"),
    [("stick channel=1", "channel 1 is stuck"), ("to_host flood count=2", "begins")],
)
def test_a_fault_that_begins_immediately_is_noted(fault: str, noted: str) -> None:
    book = Notebook()
    line = FaultyLink(virtual.TDC001().instrument, [fault])
    link = MemoryLink(line, observer=book)
    link.write(b"")
    assert book.notes == [f"{fault}: {noted}"]


def test_faults_and_refusals_are_noted() -> None:
    book = Notebook()
    line = FaultyLink(EchoInstrument(SteppedClock()), ["to_host drop frame at=1"])
    link = MemoryLink(line, observer=book)
    link.write(b"lost")
    link.write(b"heard")
    line.instrument.on_refusal("not today")
    assert link.read() == b"heard"
    assert len(book.notes) == 2
    assert book.notes[0].startswith("to_host drop frame at=1: ")
    assert book.notes[1] == "not today"
    assert [what for kind, _, what in book.lines if kind == "<"] == [b"heard"]
