"""The motor units of the overlay for Issue 37: their messages, serial numbers and device classes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

import overlay_packages
from checkout import ROOT
from overlay_packages import generate
from stagewire_generator import check
from stagewire_generator.model import Protocol

SPEC = ROOT / "spec" / "thorlabs_apt"
NAME = "thorlabs_apt/issue_37"
LINKS = ROOT / "tests" / "runtime" / "sessions"

CONTROLLER = """\
from scripted_links import TestLink
from stagewire import End
from stagewire_apt import PROTOCOL, devices, messages as m

HOST = 0x01
ASKED = []
SENT = []


def answering(serial_number, model, bays=(), short=False):
    def said(frame):
        ASKED.append((type(frame.message).__name__, frame.dest))
        SENT.append(frame.message)
        match frame.message:
            case m.HwReqInfo():
                return m.HwGetInfo(serial_number, model, 16, b"\\1\\2\\3\\0", "", 1, 0, 1)
            case m.RackReqBayUsed():
                return m.RackGetBayUsed(frame.message.bay_ident, 1 if frame.message.bay_ident in bays else 2)
            case m.MotReqVelParams():
                return m.MotGetVelParams(1, 0, 11, frame.dest)
            case m.MotReqDcStatusUpdate():
                return m.MotGetDcStatusUpdate(1, 34304, 0, 0x80000400)
            case m.MotReqStatusBits():
                return m.MotGetStatusBits(1, 0x80000400)
            case m.MotReqKcubeMmiParams():
                if short:
                    return m.MotGetKcubeMmiParamsShort(1, 1, 2, 3, 1, 4, 5, 60, 7, 8)
                return m.MotGetKcubeMmiParams(1, 1, 2, 3, 1, 4, 5, 60, 7, 8, 9, 10)
            case m.MotReqLcdMoveParams():
                return m.MotGetLcdMoveParams(1, 2, 300, 4, 5, 2, 6, 7, 8)
            case m.MotReqMotTrigIoConfig():
                return m.MotGetMotTrigIoConfigShort(1, 2, 1, 1, 11, 2, 3, 4, 5, 6, 7, 8, 9, 10)
            case m.MotReqStatusUpdate():
                long, short_form = m.MotGetStatusUpdateLong, m.MotGetStatusUpdate
                return (short_form if short else long)(1, 1234, 0, 0x80000400)
        return None

    def answer(data):
        frames = [event.frame for event in PROTOCOL.framer(End.DEVICE).feed(data)]
        replies = [(said(frame), frame.dest) for frame in frames]
        return b"".join(reply.pack(HOST, dest) for reply, dest in replies if reply)

    return TestLink(answer)


"""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The path of the package ``stagewire_apt`` with the overlay."""
    return generate(tmp_path_factory.mktemp("issue-37-units"), NAME)


@pytest.fixture(scope="module")
def protocol() -> Protocol:
    [found] = check(SPEC, overlays=[NAME], base=True)
    return found


def run(package: Path, program: str) -> None:
    overlay_packages.run(package, CONTROLLER + program, LINKS)


def messages_of(protocol: Protocol, name: str) -> frozenset[str]:
    return protocol.messages_of(protocol.units["units"][name])


def test_a_class_for_the_kdc101_opens_and_reads(package: Path) -> None:
    program = """\
with devices.KDC101.open(answering(27000001, "KDC101"), stage="Z8") as kdc:
    assert kdc.serial_number == 27000001
    assert kdc.get_vel_params().max_velocity == 0x50
    assert abs(kdc.get_dc_status_update().position_mm - 34304 / 34554.96) < 1e-6
    assert kdc.get_kcube_mmi_params().disp_brightness == 60
assert {dest for _, dest in ASKED} == {0x50}, ASKED
"""
    run(package, program)


def test_a_set_is_written_in_the_length_in_which_the_controller_reports_it(package: Path) -> None:
    program = """\
from stagewire.errors import UnknownFieldError
with devices.KDC101.open(answering(27000001, "KDC101"), stage="Z8") as kdc:
    assert kdc.change_kcube_mmi_params(disp_brightness=61, preset_pos3=11).preset_pos3 == 11
    assert SENT[-1] == m.MotSetKcubeMmiParams(1, 1, 2, 3, 1, 4, 5, 61, 7, 8, 11, 10), SENT[-1]
    kdc.set_kcube_trig_io_config(trig1_mode=0, trig1_polarity=1, trig2_mode=0, trig2_polarity=2)
    assert SENT[-1] == m.MotSetKcubeTrigIoConfig(1, 0, 1, 0, 2), SENT[-1]
with devices.KDC101.open(answering(27000001, "KDC101", short=True), stage="Z8") as kdc:
    read = kdc.get_kcube_mmi_params()
    assert read.disp_brightness == 60 and hasattr(read, "preset_pos2")
    try:
        read.preset_pos3
    except AttributeError as error:
        assert str(error) == (
            "no preset_pos3: the controller sent MOT_GET_KCUBEMMIPARAMS with 28 bytes, without it"
        ), error
    else:
        raise AssertionError("a value that was not sent was read")
    assert kdc.change_kcube_mmi_params(disp_brightness=61).disp_brightness == 61
    assert SENT[-1] == m.MotSetKcubeMmiParamsShort(1, 1, 2, 3, 1, 4, 5, 61, 7, 8), SENT[-1]
    try:
        kdc.change_kcube_mmi_params(preset_pos3=1)
    except UnknownFieldError as error:
        assert "in a shorter packet without preset_pos3; nothing was written" in str(error), error
    else:
        raise AssertionError("a value that the controller does not have was written")
    assert isinstance(SENT[-1], m.MotReqKcubeMmiParams)
"""
    run(package, program)


def test_a_bbd303_has_the_methods_of_its_triggers_and_front_panel(package: Path) -> None:
    program = """\
with devices.BBD303.open(answering(103242814, "BBD303", bays=(0, 1, 2))) as bbd:
    assert bbd.bay(1).get_lcd_move_params().preset_pos3 == 8
    bbd.bay(1).change_lcd_move_params(preset_pos2=70)
    assert SENT[-1] == m.MotSetLcdMoveParams(1, 2, 300, 4, 5, 2, 6, 70, 8), SENT[-1]
    assert bbd.bay(1).get_mot_trig_io_config().num_cycles == 10
    bbd.bay(1).change_mot_trig_io_config(num_cycles=11)
    assert SENT[-1] == m.MotSetMotTrigIoConfigShort(1, 2, 1, 1, 11, 2, 3, 4, 5, 6, 7, 8, 9, 11), SENT[-1]
"""
    run(package, program)


@pytest.mark.parametrize("short", [False, True])
def test_a_stepper_reports_its_status_in_either_length(short: bool, package: Path) -> None:
    program = f"""\
with devices.KST101.open(answering(26000001, "KST101", short={short})) as kst:
    assert kst.get_status_update().position == 1234
    assert not kst.is_moving()
"""
    run(package, program)


def test_a_class_for_the_kst201_opens_by_its_model(package: Path) -> None:
    """KST101 and KST201 share the prefix 26, and each reports its own model."""
    program = """\
from stagewire.errors import WrongUnitError
with devices.KST201.open(answering(26006239, "KST201")) as kst:
    assert kst.get_vel_params().max_velocity == 0x50
    assert kst.get_status_bits().status_bits & 0x400
try:
    devices.KST101.open(answering(26006239, "KST201"))
except WrongUnitError as error:
    assert "KST201" in str(error), error
else:
    raise AssertionError("a KST201 was opened as a KST101")
with devices.KST101.open(answering(26000001, "KST101")):
    pass
"""
    run(package, program)


def test_a_class_for_the_bsc203_counts_bays_from_1_and_sends_them_from_0(package: Path) -> None:
    program = """\
with devices.BSC203.open(answering(70000001, "BSC203", bays=(0, 2)), stage="APT_STEPPER") as bsc:
    assert bsc.get_bay_used(bay_ident=0).bay_state == 1
    assert bsc.get_bay_used(bay_ident=1).bay_state == 2
    assert bsc.bay(1).get_vel_params().max_velocity == 0x21
    assert bsc.bay(3).get_vel_params().max_velocity == 0x23
assert ("RackReqBayUsed", 0x11) in ASKED, ASKED
"""
    run(package, program)


def test_serial_numbers_of_nine_digits_begin_with_three_digits_of_prefix(package: Path) -> None:
    program = """\
with devices.BBD303.open(answering(103242814, "BBD303", bays=(0, 1, 2))) as bbd:
    assert bbd.serial_number == 103242814
    assert bbd.bay(2).get_vel_params().max_velocity == 0x22
"""
    run(package, program)


def test_an_unsupported_unit_is_refused_with_the_reason(package: Path) -> None:
    program = """\
from stagewire.errors import WrongUnitError
try:
    devices.KDC101.open(answering(101000004, "M30X"), stage="Z8")
except WrongUnitError as error:
    assert "no list of messages" in str(error), error
else:
    raise AssertionError("an M30X was opened as a KDC101")
"""
    run(package, program)


def test_every_added_unit_has_a_class(package: Path, protocol: Protocol) -> None:
    issue_3 = {unit for [found] in [check(SPEC, base=True)] for unit in found.units["units"]}
    added = sorted(protocol.units["units"].keys() - issue_3)
    assert len(added) == 47
    run(package, f"for name in {added!r}:\n    assert getattr(devices, name).unit.name == name\n")


@pytest.mark.parametrize(
    ("name", "has", "lacks"),
    [
        ("KDC101", {"MOT_GET_KCUBETRIGIOCONFIG", "MOT_SET_DCPIDPARAMS"}, {"MOT_SET_TRIGGER"}),
        ("KST101", {"MOT_SET_TSTACTUATORTYPE", "MOT_GET_STATUSUPDATE"}, {"MOT_SET_TRIGGER"}),
        ("KST201", {"MOT_GET_KCUBEMMIPARAMS"}, {"MOT_ACK_DCSTATUSUPDATE", "MOT_SET_AVMODES"}),
        ("K10CR1", {"MOT_SET_TRIGGER"}, {"MOT_SET_POWERPARAMS", "HW_DISCONNECT"}),
        ("BSC203", {"MOT_SET_KCUBEKSTLOOPPARAMS"}, {"MOT_ACK_DCSTATUSUPDATE"}),
        ("LTS300", {"MOT_SET_BOWINDEX"}, {"MOT_SET_ENCCOUNTER"}),
        ("MFF101", {"MOT_MOVE_JOG", "MOT_GET_STATUSBITS"}, {"MOT_MOVE_STOP", "MOT_MOVE_HOME"}),
        ("BBD303", {"MOT_MOVE_SYNCHSTART", "MOT_SET_IOCONFIG"}, {"MOT_SET_KCUBEMMIPARAMS"}),
        ("MST602", {"MOT_SET_POWERPARAMS"}, {"MOT_MOVE_VELOCITY"}),
        ("KSC101", {"MOT_SET_SOL_STATE", "MOT_SET_SOL_CYCLEPARAMS"}, {"MOT_MOVE_HOME"}),
    ],
)
def test_messages_are_those_of_the_printed_lists(
    protocol: Protocol, name: str, has: set[str], lacks: set[str]
) -> None:
    found = messages_of(protocol, name)
    assert has <= found
    assert not lacks & found


def test_units_of_issue_3_keep_all_their_messages(protocol: Protocol) -> None:
    [base] = check(SPEC, base=True)
    for name in base.units["units"]:
        missing = messages_of(base, name) - messages_of(protocol, name)
        assert not missing, (name, missing)


def test_units_of_issue_3_have_the_messages_of_the_lists_that_name_them(protocol: Protocol) -> None:
    """The headings of the printed lists name them; the lists of the registry do not."""
    path = SPEC / "overlays" / "issue_37" / "printed" / "lists.yaml"
    document = yaml.safe_load(path.read_text(encoding="utf-8"))
    ids = {
        f"0x{m.id:04X}": m.name for m in protocol.messages if m.id is not None and not m.sub_message
    }
    of_name = {name: m.name for m in protocol.messages for name in (m.name, *m.aliases)}
    lacking: dict[str, set[str]] = {}
    for name in ("TDC001", "TST001", "TSC001", "BSC101", "BSC103", "BBD101", "BBD103", "BBD203"):
        series = re.compile(rf"\b{name[:-1]}[{name[-1]}x]")
        printed = {
            of_name.get(row["name"].removeprefix("MGMSG_"), ids[row["id"]])
            for entry in document["lists"].values()
            if series.search(entry["title"])
            for row in entry["rows"]
        }
        assert printed, name
        lacking[name] = printed - protocol.messages_of(protocol.units["units"][name])
    sets = {name: {message.split("_")[-1] for message in left} for name, left in lacking.items()}
    assert {name: left for name, left in sets.items() if left} == {
        "BSC101": {"KCUBEKSTLOOPPARAMS"},  # page 148: only for KST101 and BSC20x
        "BSC103": {"KCUBEKSTLOOPPARAMS"},
        "BBD101": {"LIMSWITCHPARAMS"},  # page 78: not for BBD10x
        "BBD103": {"LIMSWITCHPARAMS"},
    }
