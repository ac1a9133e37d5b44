"""The overlay of Thorlabs APT for Issue 37: the package with it, and everything that Issue 3 promises."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from checkout import ROOT
from stagewire_cli.main import main
from stagewire_generator import check
from stagewire_generator.change import compare
from stagewire_generator.model import Message, Protocol
from stagewire_generator.model_fields import FlagTable

SPEC = ROOT / "spec" / "thorlabs_apt"
NAME = "thorlabs_apt/issue_37"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The path of the package ``stagewire_apt`` with the overlay."""
    out = tmp_path_factory.mktemp("issue-37")
    assert main(["generate", "--spec", str(SPEC), "--out", str(out), "--overlay", NAME]) == 0
    return out / "python"


@pytest.fixture(scope="module")
def protocol() -> Protocol:
    [found] = check(SPEC, overlays=[NAME])
    return found


def python(package: Path, program: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(package)}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def message(protocol: Protocol, name: str) -> Message:
    [found] = [message for message in protocol.messages if message.name == name]
    return found


def bits(protocol: Protocol, name: str) -> set[str]:
    [table] = [table for table in protocol.flags if table.name == name]
    assert isinstance(table, FlagTable)
    return {bit.name for bit in table.bits}


def test_every_example_of_both_issues_passes(package: Path) -> None:
    run = "from stagewire_cli.main import run; run()"
    program = f"import sys; sys.argv[1:] = ['conformance', 'examples', '--summary']; {run}"
    said = python(package, program)
    assert " 0 failed" in said


def test_nothing_of_issue_3_changes_on_the_wire_unnoticed() -> None:
    """The only changes of existing layouts are those that a later document prints."""
    kinds = {
        (change.kind, change.where.get("message"))
        for change in compare(check(SPEC, base=True), check(SPEC, overlays=[NAME]))
        if change.level.name == "WIRE" and change.kind != "layout-added"
    }
    changed = {name for _, name in kinds if name}
    assert changed <= {
        "HW_GET_INFO",
        "HW_START_UPDATEMSGS",  # starts and stops the status messages of other controllers
        "HW_STOP_UPDATEMSGS",
        "MOD_IDENTIFY",
        "MOT_GET_PMDPOSITIONLOOPPARAMS",
        "MOT_SET_PMDPOSITIONLOOPPARAMS",
        "MOT_GET_PMDCURRENTLOOPPARAMS",
        "MOT_SET_PMDCURRENTLOOPPARAMS",
        "MOT_GET_DCSTATUSUPDATE",
        "MOT_MOVE_COMPLETED",
        "MOT_MOVE_STOPPED",
        "MOT_GET_SOL_CYCLEPARAMS",  # the KSC101 has another range
        "MOT_SET_SOL_CYCLEPARAMS",
        "PZ_GET_TSG_IOSETTINGS",  # the force calibration has four bytes
        "PZ_SET_TSG_IOSETTINGS",
    }


@pytest.mark.parametrize(
    ("name", "lengths"),
    [
        ("MOT_GET_KCUBEMMIPARAMS", {28, 36}),
        ("MOT_GET_KCUBETRIGIOCONFIG", {12, 22}),
        ("MOT_GET_KCUBEPOSTRIGPARAMS", {34, 46}),
        ("MOT_GET_MOTTRIGIOCONFIG", {46, 52}),
        ("MOT_GET_LCDMOVEPARAMS", {24, 50}),
        ("MOT_GET_STATUSUPDATE", {14, 28}),
        ("MOT_SET_MOVESYNCHPARAMS", {20, 38}),
    ],
)
def test_lengths_that_sources_disagree_on_are_both_decoded(
    package: Path, protocol: Protocol, name: str, lengths: set[int]
) -> None:
    found = message(protocol, name)
    assert {layout.length for layout in found.layouts} == lengths
    frames = [
        bytes(
            (found.id or 0).to_bytes(2, "little") + bytes((length, 0, 0x81, 0x50)) + bytes(length)
        )
        for length in lengths
    ]
    program = f"""\
from stagewire_apt import messages
for raw in {frames!r}:
    frame = messages.decode(raw)
    assert frame.message.layout.message == {name!r} and not frame.extra, frame
"""
    python(package, program)


def test_synchronized_moves_are_decoded_with_both_ids_and_sent_with_neither(package: Path) -> None:
    """Page 172 prints the first 4 of 100 points; here they are all."""
    program = """\
from stagewire.errors import OutOfRangeError, UnsupportedError
from stagewire.sessions import FramedCore
from stagewire_apt import PROTOCOL, messages as m
points = bytes.fromhex(
    "00 00 00 00 E0 C8 10 00 70 99 14 00 50 00 00 00 E2 C8 10 00 52 94 14 00 "
    "50 00 00 00 EB C8 10 00 1B 91 14 00 50 00 00 00 F7 C8 10 00 52 90 14 00"
)
rows = ((0, 1100000, 1350000), (80, 1100002, 1348690), (80, 1100011, 1347867), (80, 1100023, 1347666))
for first in (b"\\x80\\x09", b"\\x00\\x0a"):
    raw = first + bytes.fromhex("38 00 D0 01 01 00 03 00 04 00 00 00") + points
    message = PROTOCOL.decode(raw).message
    assert message.rows == rows, message
    assert (message.channels_flags.channel_2, message.pack(0x50, 1)) == (True, raw)
longest = m.MotSetMoveSynchArray(1, 7, 256, 0, range(1024)).pack(0x50, 1)
assert len(longest) == 6 + 4104
[event] = PROTOCOL.framer().feed(longest)
assert event.raw == longest
core = FramedCore(PROTOCOL)
sent = [m.MotSetMoveSynchArray(1, 3, 0, 0, ()), m.MotSetMoveSynchArray0a00(1, 3, 0, 0, ())]
sent += [m.MotMoveSynchStart(1, 3, 1), m.MotMoveSynchStart0a06(1, 3, 1)]
sent += [m.MotSetMoveSynchParams(1, 0, 1, 1, 1, 5), m.MotSetMoveSynchParams0a03(1, 0, 1, 1, 1, 5)]
for message in sent:
    try:
        core.send(message, 0x50, 1.0, 0.0)
    except UnsupportedError as error:
        assert "see the erratum apt37-synch-ids" in str(error), error
    else:
        raise AssertionError(message)
assert core.output(0.0) == b""
try:
    m.MotSetMoveSynchArray(1, 3, 257, 0, ())
except OutOfRangeError as error:
    where = "MOT_SET_MOVESYNCHARRAY.num_points"
    told = "must be 0 to 256 (raw counts), not 257; see page 172 of Issue 37"
    assert str(error) == f"{where} {told}", error
"""
    python(package, program)


def test_renamed_messages_have_both_names(package: Path) -> None:
    program = """\
from stagewire_apt import PROTOCOL, messages as m
assert m.MotSetCurrentLoopParams is m.MotSetPmdCurrentLoopParams
assert PROTOCOL.message_class("MOT_GET_USTATUSUPDATE") is m.MotGetDcStatusUpdate
"""
    python(package, program)


def test_the_commands_know_both_names(package: Path) -> None:
    program = """\
import sys
from stagewire_cli.main import main
assert main(["show", "MOT_GET_USTATUSUPDATE"]) == 0
assert main(["encode", "MOT_REQ_USTATUSUPDATE", "chan_ident=1"]) == 0
assert main(["show", "mts50-z8"]) == 0
assert main(["show", "max200"]) == 0
"""
    said = python(package, program)
    assert "message MOT_GET_DCSTATUSUPDATE (thorlabs_apt)" in said
    assert "also named MOT_GET_USTATUSUPDATE" in said
    assert "also Issue 37, page 125" in said
    assert "90 04 01 00 50 01" in said
    assert "stage MTS50_Z8 (thorlabs_apt)" in said
    assert "stage MAX200_X (thorlabs_apt)" in said
    assert "stage MAX200_Y (thorlabs_apt)" in said


def test_the_status_bits_of_a_controller_are_those_of_page_129(protocol: Protocol) -> None:
    dc = bits(protocol, "dc_status_bits")
    kdc101 = bits(protocol, "kdc101_status_bits")
    assert len(dc) == 32
    assert kdc101 < dc
    assert "motor_connected" in kdc101
    assert "settled" not in kdc101


def test_a_wrong_range_of_a_sensor_contradicts_page_356(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = shutil.copytree(SPEC, tmp_path / "thorlabs_apt")
    file = spec / "overlays" / "issue_37" / "quantities.yaml"
    text = file.read_text()
    for right, wrong in (
        ("-4500", "-4400"),
        ("14500", "14400"),
        ("maximum: 20000}", "maximum: 2000}"),
    ):
        assert text.count(right) == 1
        text = text.replace(right, wrong)
    file.write_text(text)
    assert main(["check", str(spec)]) == 1
    place = "SW040 statements/quantities/tec_temperature/scale/cases/"
    said = capsys.readouterr().out
    for key in (
        "SENSOR_IC_AD59X/minimum",
        "SENSOR_IC_AD59X/maximum",
        "SENSOR_THERM200KOHM/maximum",
    ):
        assert f"{place}{key}: the document has" in said
