"""The motor units of the overlay for Issue 37: their messages, serial numbers and device classes."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from checkout import ROOT
from stagewire_cli.main import main
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


def answering(serial_number, model, bays=()):
    def said(frame):
        ASKED.append((type(frame.message).__name__, frame.dest))
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
                return m.MotGetKcubeMmiParams(1, 1, 2, 3, 1, 4, 5, 60, 7, 8, 9, 10)
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
    out = tmp_path_factory.mktemp("issue-37-units")
    assert main(["generate", "--spec", str(SPEC), "--out", str(out), "--overlay", NAME]) == 0
    return out / "python"


@pytest.fixture(scope="module")
def protocol() -> Protocol:
    [found] = check(SPEC, overlays=[NAME])
    return found


def run(package: Path, program: str) -> str:
    paths = os.pathsep.join([str(package), str(LINKS)])
    environment = {**os.environ, "PYTHONPATH": paths}
    command = [sys.executable, "-c", CONTROLLER + program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def messages_of(protocol: Protocol, name: str) -> frozenset[str]:
    return protocol.messages_of(protocol.units["units"][name])


def test_a_class_for_the_kdc101_opens_and_reads(package: Path) -> None:
    program = """\
with devices.KDC101.open(answering(27000001, "KDC101"), stage="Z8") as kdc:
    assert kdc.serial_number == 27000001
    assert kdc.get_vel_params().max_velocity == 0x50
    assert abs(kdc.get_dc_status_update().position_mm - 34304 / 34554.96) < 1e-6
    reply = kdc.session.ask(m.MotReqKcubeMmiParams(1), (m.MotGetKcubeMmiParams,), dest=0x50)
    assert reply.message.disp_brightness == 60, reply
assert {dest for _, dest in ASKED} == {0x50}, ASKED
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


def test_every_motor_unit_has_a_class(package: Path, protocol: Protocol) -> None:
    issue_3 = {unit for [found] in [check(SPEC)] for unit in found.units["units"]}
    added = sorted(protocol.units["units"].keys() - issue_3)
    assert len(added) == 22
    run(package, f"for name in {added!r}:\n    assert getattr(devices, name).unit.name == name\n")


@pytest.mark.parametrize(
    ("name", "has", "lacks"),
    [
        ("KDC101", {"MOT_GET_KCUBETRIGIOCONFIG", "MOT_SET_DCPIDPARAMS"}, {"MOT_SET_TRIGGER"}),
        ("KST101", {"MOT_SET_TSTACTUATORTYPE", "MOT_GET_STATUSUPDATE"}, {"MOT_SET_TRIGGER"}),
        ("KST201", {"MOT_GET_KCUBEMMIPARAMS"}, {"MOT_SET_LIMSWITCHPARAMS", "MOT_SET_AVMODES"}),
        ("K10CR1", {"MOT_SET_TRIGGER"}, {"MOT_SET_POWERPARAMS", "HW_DISCONNECT"}),
        ("BSC203", {"MOT_SET_KCUBEKSTLOOPPARAMS"}, {"MOT_ACK_DCSTATUSUPDATE"}),
        ("LTS300", {"MOT_SET_BOWINDEX"}, {"MOT_SET_ENCCOUNTER"}),
        ("MFF101", {"MOT_MOVE_JOG", "MOT_GET_STATUSBITS"}, {"MOT_MOVE_STOP", "MOT_MOVE_HOME"}),
        ("BBD303", {"MOT_MOVE_SYNCHSTART", "MOT_SET_IOCONFIG"}, {"MOT_SET_KCUBEMMIPARAMS"}),
        ("MST602", {"MOT_SET_POWERPARAMS"}, {"MOT_MOVE_VELOCITY"}),
        ("KSC101", {"MOT_SET_SOL_STATE"}, {"MOT_SET_SOL_CYCLEPARAMS", "MOT_MOVE_HOME"}),
    ],
)
def test_messages_are_those_of_the_printed_lists(
    protocol: Protocol, name: str, has: set[str], lacks: set[str]
) -> None:
    found = messages_of(protocol, name)
    assert has <= found
    assert not lacks & found


def test_units_of_issue_3_keep_all_their_messages(protocol: Protocol) -> None:
    [base] = check(SPEC)
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
