"""The faulty line itself: without a defect it changes nothing, and with one only what the defect states."""

from __future__ import annotations

from random import Random

import pytest
from firmware_bench import BENCHES, bench
from firmware_commands import CommandFirmware, FaultyCommandLink
from firmware_defects import Draw, Says, Takes
from firmware_frames import ID, Frame, cut, fields_of, is_message, is_whole
from firmware_line import FaultyLink, Firmware

from stagewire.links import Link
from stagewire_conformance.device.report import Report

ASK = bytes.fromhex("14 04 01 00 50 01")  # MOT_REQ_VELPARAMS
TOLD = bytes.fromhex("15 04 0E 00 81 50 01 00 00 00 00 00 11 22 00 00 33 44 55 00")


def passed(report: Report) -> list[tuple[str, list[tuple[float, bool, bytes]]]]:
    """Return all traffic, check by check."""
    return [
        (outcome.check.id, [(entry.time, entry.sent, entry.raw) for entry in outcome.entries])
        for outcome in report.outcomes
    ]


@pytest.mark.parametrize("name", ["TDC001", "RACK", "BPC301", "TSC001"])
def test_without_a_defect_every_byte_passes_on_time(name: str) -> None:
    unit = bench(name)
    plain = unit.run(unit.line())
    assert passed(unit.run(FaultyLink(unit.line(), Firmware(), unit.status))) == passed(plain)


def test_without_a_defect_every_byte_of_a_command_passes() -> None:
    unit = bench("MS2000")
    plain = unit.run(unit.line())
    line = FaultyCommandLink(unit.line(), CommandFirmware())
    assert passed(unit.run(line)) == passed(plain)


def test_every_unit_has_a_bench() -> None:
    assert {unit.unit for unit in BENCHES.values()} >= {"BBD103", "RACK", "TSG001", "MFC2000"}
    assert all(unit.checks for unit in BENCHES.values())


# Frames


def test_fields_of_a_frame() -> None:
    frame = Frame(TOLD)
    assert (frame.name, frame.dest, frame.source, frame.place) == (
        "MOT_GET_VELPARAMS",
        1,
        0x50,
        0x50,
    )
    assert (frame.channel, frame["acceleration"], frame["max_velocity"]) == (1, 0x2211, 0x554433)
    assert frame.with_("acceleration", -1).raw[12:16] == b"\xff\xff\xff\xff"
    assert frame.with_("chan_ident", 2).channel == 2
    assert Frame(ASK).with_("chan_ident", 2).raw == bytes.fromhex("14 04 02 00 50 01")


def test_a_frame_with_other_bytes() -> None:
    frame = Frame(TOLD)
    assert frame.to(0x22).raw[4:6] == b"\xa2\x50"
    assert frame.coming_from(0x22).raw[4:6] == b"\x81\x22"
    assert frame.renamed("MOT_GET_JOGPARAMS").raw[:2] == ID["MOT_GET_JOGPARAMS"].to_bytes(
        2, "little"
    )
    assert frame.with_packet(b"ab").raw == bytes.fromhex("15 04 02 00 81 50") + b"ab"
    assert frame.patched(2, b"\x0f").raw[2:4] == b"\x0f\x00"


def test_two_layouts_of_the_same_length() -> None:
    dc = fields_of("MOT_MOVE_COMPLETED", 14, "dc")
    stepper = fields_of("MOT_MOVE_COMPLETED", 14, "stepper")
    assert "velocity" in dc
    assert "enc_count" in stepper


def test_bytes_are_split_at_the_ends_of_frames() -> None:
    assert [*cut(ASK + TOLD + ASK[:3])] == [ASK, TOLD, ASK[:3]]
    assert [*cut(TOLD[:-1])] == [TOLD[:-1]]
    assert is_whole(TOLD)
    assert not is_whole(TOLD[:-1])
    assert not is_whole(ASK[:5])


def test_bytes_that_are_not_a_message() -> None:
    assert is_message(ASK)
    assert is_message(TOLD)
    unknown = bytes.fromhex("FE 0E 00 00 50 01")
    too_long = bytes.fromhex("14 04 01 00 D0 01 00")
    assert not any(map(is_message, (unknown, too_long, TOLD[:-1], ASK + b"\0")))


# Hooks


class Listed(Firmware):
    """Records received and sent messages."""

    def __init__(self) -> None:
        self.seen: list[tuple[str, str | bytes]] = []

    def takes(self, frame: Frame) -> None:
        self.seen.append(("takes", frame.name))
        super().takes(frame)

    def takes_odd(self, raw: bytes) -> None:
        self.seen.append(("odd", raw))
        super().takes_odd(raw)

    def says(self, frame: Frame) -> None:
        self.seen.append(("says", frame.name))
        super().says(frame)


def line(firmware: Firmware) -> Link:
    return FaultyLink(bench("TDC001").line(), firmware, "dc")


def test_messages_and_other_bytes_are_separated() -> None:
    firmware = Listed()
    link = line(firmware)
    link.write(ASK + ASK)
    link.write(ASK[:4])
    link.read(0.2)
    assert firmware.seen == [
        ("takes", "MOT_REQ_VELPARAMS"), ("takes", "MOT_REQ_VELPARAMS"), ("odd", ASK[:4]),
        ("says", "MOT_GET_VELPARAMS"), ("says", "MOT_GET_VELPARAMS"),
    ]  # fmt: skip


def test_a_delayed_message_arrives_later() -> None:
    class Late(Firmware):
        def says(self, frame: Frame) -> None:
            self.say(frame.raw, after=0.5)
            self.say(b"now")

    link = line(Late())
    link.write(ASK)
    assert link.clock is not None
    assert link.read(2.0) == b"now"
    began = link.clock()
    assert link.read(0.1) == b""
    assert len(link.read(2.0)) == 20
    assert link.clock() == pytest.approx(began + 0.5)


def test_changes_of_sent_and_received_messages() -> None:
    link = line(Says(lambda f: f.name == "MOT_GET_VELPARAMS", lambda f: [f, f.raw[:6]]))
    link.write(ASK)
    assert len(link.read(1.0)) == 26
    link = line(Takes(lambda f: f.name == "MOT_REQ_VELPARAMS", lambda f: []))
    link.write(ASK)
    assert link.read(1.0) == b""


def test_the_values_of_a_unit_after_power_on() -> None:
    draw = Draw(bench("TDC001"), Random(1))
    asked = next(a for a in draw.all_asked() if a.request == "MOT_REQ_VELPARAMS")
    assert draw.present(asked).name == "MOT_GET_VELPARAMS"
    assert asked.is_answer(draw.present(asked))


def test_a_command_is_changed() -> None:
    class Deaf(CommandFirmware):
        def takes(self, frame: object, raw: bytes) -> bytes:
            return b"x" + self.pass_on(raw)

    link = FaultyCommandLink(bench("MS2000").line(), Deaf())
    link.write(b"\xffB")  # the low-level format
    assert link.read(0.1) == b"x"
    link.write(b"\x18i\x06:")
    assert link.read(0.1) == b"xEMOT :"
    link.write(b"\x18zz")
    assert link.read(0.1) == b""
