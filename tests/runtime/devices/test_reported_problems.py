"""The problems that users of other drivers report most, each with a test that is named for it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from inertial_controller import controller, moves
from recording_link import RecordingLink

import stagewire
import stagewire_apt.aio as aio
import stagewire_virtual as virtual
from serial_ports import linux, macos, port, show, windows
from stagewire import Stage
from stagewire._links import usb
from stagewire.errors import (
    BadValueError,
    LinkOpenError,
    ReplyTimeoutError,
    UnknownScaleError,
    UnsupportedError,
    WrongUnitError,
)
from stagewire.protocols import load_protocol
from stagewire_apt import (
    BBD102,
    BBD302,
    BSC103,
    BSC201,
    BSC203,
    K10CR1,
    KBD101,
    KDC101,
    KIM101,
    KST101,
    LTS150,
    LTS300,
    MFF101,
    TBD001,
    TDC001,
    TPZ001,
    devices,
)
from stagewire_apt import (
    messages as m,
)
from stagewire_cli.main import main
from stagewire_virtual.factory import simulated_units
from stagewire_virtual.linking import SteppedLink

APT: Any = load_protocol("thorlabs_apt")
UNITS = {unit["name"]: unit for unit in APT.registry()["units"]}

# ======================================================================================================
# Opening: ports, addresses, scales, models, classes, statuses and serial numbers
# ======================================================================================================


@pytest.fixture(autouse=True)
def no_ports(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A computer without ports and without USB devices."""
    show(monkeypatch)
    monkeypatch.setattr(usb, "SYSFS", tmp_path / "sysfs")


@pytest.fixture
def kdc101(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The name of a port with a KDC101 that has the serial number 27000001."""
    with virtual.KDC101(serial_number=27000001, stage_id=7).pty() as served:
        show(monkeypatch, linux("/dev/none", "83000002"), linux(served.url, "27000001"))
        yield served.url


def plugged_in(folder: Path, serial_number: str, driver: str = "") -> None:
    """Describe a controller without a port as Linux does."""
    interface = folder / "sysfs" / "1-2" / "1-2:1.0"
    interface.mkdir(parents=True)
    (interface.parent / "serial").write_text(f"{serial_number}\n", encoding="utf-8")
    if driver:
        (folder / driver).mkdir()
        (interface / "driver").symlink_to(folder / driver)


def sent(line: RecordingLink) -> list[tuple[str, int]]:
    """Return the names and the destinations of the written messages."""
    return [
        (event.frame.message.layout.message, event.frame.dest)
        for event in APT.framer().feed(line.raw)
    ]


class TestPortNotFoundOrDriverNotBound:
    def test_a_controller_is_opened_by_its_serial_number(self, kdc101: str) -> None:
        with KDC101.open(serial_number=27000001) as device:
            assert (device.serial_number, device.url) == (27000001, "usb://27000001")
        for url in ("usb://27000001", "USB://27000001/"):
            with stagewire.open(url) as device:
                assert type(device) is KDC101
        with stagewire.open(serial_number=27000001) as device:
            assert type(device) is KDC101

    def test_and_in_asyncio(self, kdc101: str) -> None:
        async def opened() -> int | None:
            async with aio.KDC101.open(serial_number=27000001) as device:
                await device.reconnect()  # the port is looked up again
                number: int | None = device.serial_number
                return number

        assert asyncio.run(opened()) == 27000001

    def test_and_by_the_command(self, kdc101: str, capsys: pytest.CaptureFixture[str]) -> None:
        for arguments in (
            ["stop", "usb://27000001"],
            ["move", "usb://27000001", "--to", "0.1", "--yes"],
            ["doctor", "usb://27000001"],
        ):
            assert main(arguments) == 0, capsys.readouterr()
        assert "KDC101" in capsys.readouterr().out

    @pytest.mark.parametrize(
        "made",
        [windows("COM3", "27000001"), macos("/dev/cu.x", "27000001")],
        ids=["windows", "macos"],
    )
    def test_the_port_is_found_on_every_system(
        self, monkeypatch: pytest.MonkeyPatch, made: Any
    ) -> None:
        show(monkeypatch, made)
        assert usb.port_with("27000001").device == made.device

    def test_a_missing_port_is_reported_with_those_that_are_there(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        show(monkeypatch, linux("/dev/ttyUSB0", "83000002"), port("/dev/ttyS0"))
        with pytest.raises(
            LinkOpenError,
            match=r"usb://27000001 .*connected: 83000002 \(/dev/ttyUSB0\)\. .*stagewire doctor",
        ):
            KDC101.open(serial_number=27000001)
        show(monkeypatch)
        for url in ("usb://27000001", "usb://"):
            with pytest.raises(LinkOpenError, match=r"no port has a serial number|expected usb://"):
                stagewire.open(url)

    @pytest.mark.parametrize(
        ("driver", "shown"), [("", "no driver is bound"), ("usbfs", "the driver usbfs is bound")]
    )
    def test_a_controller_without_a_driver_is_named(
        self, tmp_path: Path, driver: str, shown: str
    ) -> None:
        plugged_in(tmp_path, "27000001", driver)
        with pytest.raises(LinkOpenError, match=f"plugged in, but {shown} .*stagewire doctor"):
            KDC101.open(serial_number=27000001)

    def test_two_ports_with_one_serial_number_are_not_guessed(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        show(monkeypatch, linux("/dev/ttyUSB0", "27000001"), linux("/dev/ttyUSB1", "27000001"))
        with pytest.raises(
            LinkOpenError, match=r"2 ports .*: /dev/ttyUSB0, /dev/ttyUSB1; open one"
        ):
            KDC101.open(serial_number=27000001)

    @pytest.mark.parametrize("number", [None, 0, "27000001", True])
    def test_a_url_or_a_serial_number_is_required(self, number: Any) -> None:
        for call in (KDC101.open, stagewire.open, aio.KDC101.open):
            with pytest.raises(BadValueError, match=r"serial_number.* such as"):
                call(serial_number=number)


class TestWrongAddress:
    @pytest.mark.parametrize("name", sorted(UNITS.keys() & simulated_units().keys()))
    def test_open_sends_only_requests_to_the_addresses_of_the_unit(self, name: str) -> None:
        """Except the messages that switch off its outputs, once it is known to be the unit."""
        cls, unit = getattr(devices, name), getattr(devices, name).unit
        if unit.kind == "bay":
            line, there = RecordingLink(virtual.rack(name)), {unit.bays[0]}
        else:
            line = RecordingLink(getattr(virtual, name)())
            there = {unit.address, *(unit.bays if unit.kind == "rack" else ())}
        with cls.open(line):
            got = sent(line)
            effects = {one["name"]: one["effect"] for one in APT.registry()["messages"]}
            assert got
            assert {dest for _, dest in got} <= there
            off = {order.message: order.values for order in unit.safe_state}
            messages = [event.frame.message for event in APT.framer().feed(line.raw)]
            switching = [one for one in messages if type(one) in off]
            assert [type(one) for one in switching] == list(off)  # each once
            for one in switching:
                assert off[type(one)].items() <= one.values().items()
                before = messages[: messages.index(one)]
                assert any(isinstance(other, m.HwReqInfo) for other in before)
            requests = [one.layout.message for one in messages if type(one) not in off]
            assert {effects[one] for one in requests} <= {"none", "stream"}
            assert all("_SET_" not in one for one in requests)

    @pytest.mark.parametrize(
        ("cls", "own", "others"),
        [(BSC201, 0x50, "0x11 or 0x21"), (TBD001, 0x21, "0x50 or 0x11")],
    )
    def test_silence_names_the_other_addresses_but_nothing_is_sent_there(
        self, cls: Any, own: int, others: str
    ) -> None:
        line = RecordingLink(getattr(virtual, cls.unit.name)())
        line.twist = lambda data: b""
        with pytest.raises(
            ReplyTimeoutError, match=f"Only {own:#04x} was asked.*at {others}: pass"
        ):
            cls.open(line, timeout=0.1)
        assert {dest for _, dest in sent(line)} == {own}

    def test_another_address_is_an_explicit_choice(self) -> None:
        line = RecordingLink(virtual.TBD001())
        line.twist = lambda data: b""
        with pytest.raises(ReplyTimeoutError, match=r"Only 0x50 was asked.*at 0x21 or 0x11"):
            TBD001.open(line, address=0x50, timeout=0.1)
        assert {dest for _, dest in sent(line)} == {0x50}

    def test_a_rack_is_not_asked_by_a_guess(self, monkeypatch: pytest.MonkeyPatch) -> None:
        with virtual.BSC103(serial_number=70000001).tcp() as served:
            with pytest.raises(
                WrongUnitError, match=r"at 0x50; give .*only by its name or with bay="
            ):
                stagewire.open(served.url)
            with stagewire.open(served.url, serial_number=70000001) as rack:
                assert type(rack) is BSC103

    def test_the_number_of_another_unit_is_refused_before_the_line_is_opened(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        show(monkeypatch, linux("/dev/none", "70000001"))
        for url, options in (
            ("/dev/none", {}),
            ("usb://70000001", {}),
            (None, {"serial_number": 70000001}),
        ):
            with pytest.raises(
                WrongUnitError, match=r"70000001 belongs to a BSC103 or BSC203.*Nothing was sent"
            ):
                KDC101.open(url, **options)

    def test_a_bay_of_a_rack_has_no_port(self) -> None:
        for opener in (BSC203.open, BSC103.open, stagewire.open):
            with pytest.raises(
                WrongUnitError,
                match=r"90000001 is the serial number of a card.* begins with 70, and use bay\(1\)",
            ):
                opener(serial_number=90000001)

    def test_bay_numbers_start_at_0_on_the_wire_and_at_1_in_calls(self) -> None:
        line = RecordingLink(virtual.BBD102(empty_bays=[2]))
        with BBD102.open(line) as rack:
            frames = [event.frame.message for event in APT.framer().feed(line.raw)]
            asked = [one.bay_ident for one in frames if isinstance(one, m.RackReqBayUsed)]
            assert asked == [0, 1]
            asked = [dest for name, dest in sent(line) if name == "MOT_REQ_PMDSTAGEAXISPARAMS"]
            assert asked == [0x21]  # the second bay is empty
            line.forget()
            rack.bay(1).get_pos_counter()
            assert [dest for _, dest in sent(line)] == [0x21]


class TestWrongOrUnknownScale:
    @pytest.mark.parametrize(
        ("id", "stage", "counts"),
        [(7, "MTS25_Z8", 34555), (8, "MTS50_Z8", 34555), (9, "Z825", 34555), (2, "Z606", 24576)],
    )
    def test_the_scale_is_that_of_the_stage_that_the_controller_reports(
        self, id: int, stage: str, counts: int
    ) -> None:
        line = RecordingLink(virtual.KDC101(stage_id=id))
        with KDC101.open(line) as device:
            assert f"stage {stage}, reported by the controller (id {id} in HW_GET_INFO)" in str(
                device
            )
            device.set_pos_counter(mm=1)
            assert device.get_pos_counter().position == counts

    def test_a_travel_of_the_user_is_checked_with_the_reported_stage(self) -> None:
        with KDC101.open(RecordingLink(virtual.KDC101(stage_id=7)), travel_mm=12) as device:
            assert "travel: 0 to 12 mm" in str(device)
        with pytest.raises(UnknownScaleError, match="travel_mm"):
            KDC101.open(RecordingLink(virtual.KDC101(stage_id=0)), travel_mm=12)

    def test_a_source_can_be_chosen_for_the_reported_stage(self) -> None:
        line = RecordingLink(virtual.KDC101(stage_id=12))
        with KDC101.open(line, scale_source="vendor") as device:
            assert "position: 1638.4 counts per deg" in str(device)

    @pytest.mark.parametrize(("id", "shown"), [(0, "no stage (id 0"), (99, "the stage id 99")])
    def test_an_unknown_id_leaves_the_scale_unknown(self, id: int, shown: str) -> None:
        with KDC101.open(RecordingLink(virtual.KDC101(stage_id=id))) as device:
            assert f"channel 1: no stage; the controller reports {shown} in HW_GET_INFO" in str(
                device
            )
            with pytest.raises(UnknownScaleError):
                device.move_absolute(mm=1)

    def test_the_choice_of_the_user_wins_and_the_report_is_shown(
        self, caplog: pytest.LogCaptureFixture
    ) -> None:
        caplog.set_level(logging.WARNING)
        with KDC101.open(RecordingLink(virtual.KDC101(stage_id=7)), stage="Z825B") as device:
            text = "stage Z825B, chosen by the user; the controller reports MTS25_Z8 (id 7 in HW_GET_INFO)"
            assert text in str(device)
            assert caplog.messages == []  # the same scale and travel
        with KDC101.open(RecordingLink(virtual.KDC101(stage_id=7)), stage="Z606") as device:
            device.set_pos_counter(mm=1)
            assert device.get_pos_counter().position == 24576
        assert "reports MTS25_Z8 (id 7 in HW_GET_INFO), but Z606 was given" in caplog.text

    def test_a_stage_of_the_user_and_a_built_in_stage_are_named_as_such(self) -> None:
        own = Stage.of_user("slide")
        with KDC101.open(RecordingLink(virtual.KDC101(stage_id=7)), stage=own) as device:
            assert "stage slide, your own; the controller reports MTS25_Z8" in str(device)
        with K10CR1.open(RecordingLink(virtual.K10CR1())) as device:
            assert "stage K10CR1, built in" in str(device)

    def test_each_bay_has_the_stage_that_its_controller_reports(self) -> None:
        line = RecordingLink(virtual.BBD102())
        ids = {0x21: 0x10, 0x22: 0x11}
        line.twist = lambda data: b"".join(_with_stage(frame, ids) for frame in _frames(data))
        with BBD102.open(line) as rack:
            text = str(rack)
            assert "bay 1: stage MLS203_X, reported by the controller" in text
            assert "bay 2: stage MLS203_Y, reported by the controller" in text
            assert "(id 17 in MOT_GET_PMDSTAGEAXISPARAMS)" in text

    def test_silence_about_the_stage_leaves_the_scale_unknown(
        self, caplog: pytest.LogCaptureFixture
    ) -> None:
        line = RecordingLink(virtual.KBD101())
        line.twist = lambda data: b"".join(f for f in _frames(data) if f[:2] != b"\xf2\x04")
        with KBD101.open(line, timeout=0.2) as device:
            assert "channel 1: no stage\n" in str(device)
        assert "the stage is unknown" in caplog.text

    def test_the_stage_is_read_again_after_reconnecting(self, monkeypatch: Any) -> None:
        with virtual.KDC101(serial_number=27000001, stage_id=7).pty() as served:
            show(monkeypatch, linux(served.url, "27000001"))
            with KDC101.open(serial_number=27000001) as device:
                device.reconnect()
                assert "stage MTS25_Z8, reported by the controller" in str(device)


def _frames(data: bytes) -> list[bytes]:
    """Return the whole frames in some bytes."""
    found = []
    while len(data) >= 6:
        size = 6 + (int.from_bytes(data[2:4], "little") if data[4] & 0x80 else 0)
        found.append(data[:size])
        data = data[size:]
    return found


def _with_stage(frame: bytes, ids: dict[int, int]) -> bytes:
    """Return a frame with the stage id of its source, if it reports a stage."""
    if frame[:2] != b"\xf2\x04":
        return frame
    return frame[:8] + ids[frame[5]].to_bytes(2, "little") + frame[10:]


class TestReportedModelDiffersFromTheLabel:
    def test_a_bsc201_reports_scc201(self) -> None:
        line = RecordingLink(virtual.BSC201(model="SCC201", serial_number=40000001))
        with BSC201.open(line) as device:
            assert "model SCC201" in str(device)

    def test_an_lts300_reports_lts300c(self) -> None:
        line = RecordingLink(virtual.LTS300(model="LTS300C"))
        with LTS300.open(line, stage="LTS300C") as device:
            assert device.scales.of("position", "mm").counts_per_unit == 409_600

    def test_another_model_is_refused_with_the_class_to_use(self) -> None:
        line = RecordingLink(virtual.TDC001(model="KDC101", serial_number=27000001))
        with pytest.raises(WrongUnitError, match=r"not a TDC001: it reports .*; open it as KDC101"):
            TDC001.open(line)


class TestWrongClassForAPiezoOrALaser:
    def test_a_motor_class_refuses_a_piezo(self) -> None:
        line = RecordingLink(virtual.TPZ001(serial_number=81000001))
        with pytest.raises(WrongUnitError, match="open it as TPZ001"):
            TDC001.open(line)
        with stagewire.open("virtual://TPZ001") as device:
            assert type(device) is TPZ001

    @pytest.mark.parametrize(("number", "name"), [(99000001, "BVC101"), (75000001, "MMR601")])
    def test_a_unit_without_a_class_is_named_before_anything_is_sent(
        self, monkeypatch: pytest.MonkeyPatch, number: int, name: str
    ) -> None:
        show(monkeypatch, linux("/dev/none", str(number)))
        with pytest.raises(UnsupportedError, match=name):
            stagewire.open(serial_number=number)
        with pytest.raises(WrongUnitError, match=f"belongs to a {name}.*; no class supports it"):
            KDC101.open(serial_number=number)

    def test_a_laser_is_refused_after_it_reported_its_model(self) -> None:
        line = RecordingLink(virtual.TDC001(model="TLS001", serial_number=86000001))
        with pytest.raises(
            WrongUnitError, match=r"86000001 and model 'TLS001'.*; open it as TLS001"
        ):
            TDC001.open(line)


class TestStatusOf14Or28Bytes:
    @pytest.mark.parametrize(
        ("cls", "status"),
        [
            (KDC101, m.MotGetDcStatusUpdate),
            (KST101, m.MotGetStatusUpdate),
            (LTS150, m.MotGetStatusUpdate),
            (BSC201, m.MotGetStatusUpdateLong),
        ],
    )
    def test_each_unit_has_the_status_that_it_sends(self, cls: Any, status: type) -> None:
        line = RecordingLink(getattr(virtual, cls.unit.name)())
        with cls.open(line) as device:
            query = getattr(device, "get_status_update", None) or device.get_dc_status_update
            assert type(query().message) is status

    def test_the_longer_status_is_accepted_from_a_unit_that_sends_the_shorter(self) -> None:
        line = RecordingLink(virtual.KST101())
        line.twist = lambda data: b"".join(_longer(frame) for frame in _frames(data))
        with KST101.open(line) as device:
            assert type(device.get_status_update().message) is m.MotGetStatusUpdateLong


def _longer(frame: bytes) -> bytes:
    """Return a frame with 28 bytes of status in place of 14."""
    if frame[:2] != b"\x81\x04" or len(frame) != 20:
        return frame
    return frame[:2] + b"\x1c\x00" + frame[4:] + bytes(14)


class TestSerialNumbersOfNineDigits:
    def test_a_bbd302_is_opened_by_its_number(self, monkeypatch: pytest.MonkeyPatch) -> None:
        with virtual.BBD302(serial_number=103000001).pty() as served:
            show(monkeypatch, linux(served.url, "103000001"))
            with BBD302.open(serial_number=103000001) as device:
                assert device.serial_number == 103000001
            with stagewire.open("usb://103000001") as device:
                assert type(device) is BBD302
        with pytest.raises(
            WrongUnitError, match="103000001 belongs to a BBD301 or BBD302 or BBD303"
        ):
            KDC101.open(serial_number=103000001)


class TestKim101:
    """The channels are the bits 1, 2, 4 and 8; test_channel_bits.py tests every call and channel."""

    @pytest.mark.parametrize(("number", "bit"), [(1, 1), (2, 2), (3, 4), (4, 8)])
    def test_a_channel_is_a_bit_in_moves_and_jogs(self, number: int, bit: int) -> None:
        line, instrument = controller("KIM101")
        with KIM101.open(SteppedLink(line)) as device:
            channel = device.channel(number)
            channel.enable()
            instrument.frames.clear()
            channel.move_absolute(counts=5)
            channel.jog("FORWARD")
        move, jog = (frame for frame in instrument.frames if moves(frame))
        assert (move[:2], move[6:8]) == (b"\xd4\x08", bytes((bit, 0)))
        assert (jog[:2], jog[2:4]) == (b"\xd9\x08", bytes((bit, 1)))
        assert instrument.moved == [bit, bit]


class TestFlippersHaveAddressesOfTheirOwn:
    def test_an_mff101_is_asked_at_0x50_only(self) -> None:
        line = RecordingLink(virtual.MFF101())
        with MFF101.open(line):
            assert {dest for _, dest in sent(line)} == {0x50}
