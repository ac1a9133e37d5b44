"""Virtual controllers with the package of an overlay, as its device classes see them."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from checkout import ROOT
from overlay_packages import command, environment_of, generate, run
from stagewire_cli.main import main

OVERLAYS = ("issue_37", "later_issues")

START = """\
import stagewire_virtual as virtual
from stagewire_apt import PROTOCOL, devices, messages as m
from stagewire_virtual.factory import why_not
from stagewire_virtual.instrument import units_of
from stagewire_virtual.linking import SteppedLink

UNITS = {name: unit for name, unit in units_of(PROTOCOL).items() if not why_not(unit)}


def information(unit, address=0x50, **options):
    with getattr(virtual, unit)(**options) as controller:
        controller.write(m.HwReqInfo().pack(dest=address, source=0x01))
        [event] = controller.read_frames()
        return event


def opened(unit, options={}, **arguments):
    controller = getattr(virtual, unit)(**options)
    return controller, getattr(devices, unit).open(SteppedLink(controller), **arguments)


def status_of(axis, unit):
    dc = UNITS[unit].facts["status"] == "dc"
    return axis.get_dc_status_update() if dc else axis.get_status_update()


"""

MOVES = """\
for unit in NAMES:
    controller, device = opened(unit)
    with controller, device:
        assert device.get_info().model_number == unit, unit
        axis = device.bay(1) if UNITS[unit].facts["address"] == "rack" else device
        axis = axis.channel(2) if UNITS[unit].facts["channels"] == 2 else axis
        axis.home()
        axis.move_absolute(counts=3000)
        axis.move_relative(counts=-1000)
        status = status_of(axis, unit)
        assert status.position == 2000, (unit, status)
        move = axis.start_move_absolute(counts=200_000)
        axis.stop()
        status = status_of(axis, unit)
        assert status.position < 200_000 and not axis.is_moving(), (unit, status)
"""


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The folder with the package of each overlay."""
    return {
        overlay: generate(tmp_path_factory.mktemp(overlay), f"thorlabs_apt/{overlay}")
        for overlay in OVERLAYS
    }


@pytest.fixture(scope="module")
def package(packages: dict[str, Path]) -> Path:
    """The folder with the package of Issue 37."""
    return packages["issue_37"]


@pytest.mark.parametrize("overlay", OVERLAYS)
def test_every_unit_reports_its_hardware_information(
    overlay: str, packages: dict[str, Path]
) -> None:
    """Clients depend on the hardware version of some units; the stage id is in bytes 76 and 77."""
    program = """\
VERSIONS = {"KDC101": 3, "KST201": 4, "LTS150": 3, "LTS300": 3}
for unit in UNITS:
    address = 0x50 if UNITS[unit].facts["address"] == "generic_usb" else 0x11
    info = information(unit, address).frame.message
    assert info.notes == f"Stagewire virtual {'RACK' if UNITS[unit].facts['address'] == 'bay' else unit}"
    assert (info.hw_version, info.mod_state) == (VERSIONS.get(unit, 0), 0), unit
    raw = information(unit, address, stage_id=0x1234).raw
    assert raw[6 + 76 : 6 + 78] == bytes((0x34, 0x12)), unit
"""
    run(packages[overlay], START + program)


def test_a_serial_number_never_has_the_prefix_of_an_unsupported_unit(package: Path) -> None:
    """No prefix of the KVS30 is known; 93 is the highest that belongs to no unit."""
    program = """\
assert information("KVS30").frame.message.serial_number // 1_000_000 == 93
assert information("BBD302", 0x11).frame.message.serial_number // 1_000_000 == 103
"""
    run(package, START + program)


@pytest.mark.parametrize(
    "units",
    [
        ("KDC101", "KVS30"),
        ("KST101", "KST201", "TST101"),
        ("BSC201", "BSC202", "BSC203", "MST602"),
        ("K10CR1", "LTS150", "LTS300", "MLJ050", "MLJ150"),
        ("KBD101", "TBD001", "BBD301", "BBD302", "BBD303"),
        ("TDC001", "BSC103", "BBD102"),
    ],
)
def test_motors_home_move_and_stop(units: tuple[str, ...], package: Path) -> None:
    run(package, f"{START}NAMES = {units!r}\n{MOVES}")


def test_a_kdc101_moves_its_stage_by_millimetres(package: Path) -> None:
    program = """\
from stagewire_apt import stages

controller, kdc = opened("KDC101", {"stage": stages.Z825B}, stage="Z825B")
with controller, kdc:
    kdc.home()
    kdc.move_absolute(mm=1.5)
    assert abs(kdc.get_dc_status_update().position_mm - 1.5) < 1e-4
    assert kdc.get_vel_params().max_velocity_mm_per_s < 2.6
"""
    run(package, START + program)


def test_the_status_has_the_bits_of_the_unit_in_which_nothing_is_wrong(package: Path) -> None:
    program = """\
for unit, bits in {"KDC101": 0x100, "KBD101": 0x10000100, "TDC001": 0, "KST101": 0x100}.items():
    controller, device = opened(unit)
    with controller, device:
        assert device.get_status_bits().status_bits & 0x10000100 == bits, unit
"""
    run(package, START + program)


def test_a_rotation_stage_has_its_own_stage(package: Path) -> None:
    program = """\
from stagewire_apt import stages

controller, stage = opened("K10CR1")
with controller, stage:
    stage.home()
    stage.move_absolute(counts=stages.K10CR1.scale("position", "K10CR1").to_counts("90"))
    assert controller.instrument.rows()[0].position == "90.0000 deg"
"""
    run(package, START + program)


def test_a_stepper_sends_the_status_in_the_length_of_its_unit(package: Path) -> None:
    program = """\
LONG, SHORT = m.MotGetStatusUpdateLong, m.MotGetStatusUpdate
for unit, sent in {"BSC201": LONG, "BSC203": LONG, "KST201": SHORT, "LTS150": SHORT}.items():
    controller, device = opened(unit)
    with controller, device:
        axis = device.bay(1) if UNITS[unit].facts["address"] == "rack" else device
        status = axis.get_status_update()
        assert (status.position, type(status.message)) == (0, sent), unit
        assert not axis.is_moving()
"""
    run(package, START + program)


def test_rich_responses_have_the_layout_of_the_overlay(packages: dict[str, Path]) -> None:
    program = """\
with virtual.BSC103(quirks={"rich_responses"}, answer_unsupported=True) as controller:
    controller.write(m.MotMoveJog(chan_ident=1, direction=7).pack(dest=0x21, source=0x01))
    [event] = controller.read_frames()
    said = event.frame.message
    assert (said.msg_ident, said.code, said.notes) == (0, 1, "Command refused"), said
"""
    for package in packages.values():
        run(package, START + program)


def test_a_filter_flipper_takes_its_transit_time(package: Path) -> None:
    program = """\
controller, flipper = opened("MFF101")
with controller, flipper:
    assert flipper.get_status_bits().status_bits == 0x1
    flipper.set_mff_oper_params(
        transit_time=1000, transit_time_adc=169, dig_io1_oper_mode=1, dig_io1_sig_mode=1,
        dig_io1_pulse_width=10, dig_io2_oper_mode=1, dig_io2_sig_mode=1, dig_io2_pulse_width=10,
    )
    flipper.jog("REVERSE")
    controller.advance(0.9)
    assert flipper.is_moving() and flipper.get_status_bits().status_bits == 0x20
    controller.advance(0.2)
    assert not flipper.is_moving() and flipper.get_status_bits().status_bits == 0x2
    controller.power_cycle()
    assert controller.instrument.rows()[0].position == "reverse"
"""
    run(package, START + program)


def test_a_solenoid_counts_its_times_in_milliseconds(package: Path) -> None:
    """The TSC001 counts in steps of 250 us: the same counts are four times as long here."""
    program = """\
from stagewire.errors import OutOfRangeError
controller, solenoid = opened("KSC101")
with controller, solenoid:
    solenoid.set_sol_cycle_params(on_time_ms=100, off_time_ms=200, num_cycles=2)
    assert solenoid.get_sol_cycle_params().message.on_time == 100
    solenoid.set_sol_operating_mode(operating_mode="SOLENOID_AUTO")
    solenoid.set_sol_state(state="SOLENOID_ON")
    seen = []
    for _ in range(7):
        seen.append(solenoid.get_sol_state().state)
        controller.advance(0.1)
    assert seen == [1, 2, 2, 1, 2, 2, 2], seen
    for given in ({"on_time": 99}, {"on_time": 10_000_001}, {"on_time_ms": 99}):
        try:
            solenoid.set_sol_cycle_params(off_time=100, num_cycles=1, **given)
        except OutOfRangeError as error:
            assert "MOT_SET_SOL_CYCLEPARAMS.on_time, page 87 of Issue 3" in str(error), error
        else:
            raise AssertionError(given)
controller, solenoid = opened("TSC001")
with controller, solenoid:
    solenoid.set_sol_cycle_params(on_time_ms=100, off_time_ms=200, num_cycles=2)
    assert solenoid.get_sol_cycle_params().message.on_time == 400
    try:
        solenoid.set_sol_cycle_params(on_time=399, off_time=400, num_cycles=1)
    except OutOfRangeError as error:
        assert "must be 400 to 40000000 (raw counts of ms), not 399" in str(error), error
    else:
        raise AssertionError("399 counts are less than 100 ms")
"""
    run(package, START + program)


def test_a_set_is_stored_in_each_of_its_lengths(package: Path) -> None:
    program = """\
controller, kdc = opened("KDC101")
with controller, kdc:
    written = kdc.change_kcube_mmi_params(disp_brightness=60, preset_pos3=7)
    assert (written.disp_brightness, kdc.get_kcube_mmi_params().preset_pos3) == (60, 7)
    short = m.MotSetKcubeMmiParamsShort(1, 1, 0, 0, 0, 0, 0, 61, 0, 0)
    kdc.session.send(short, dest=0x50)
    read = kdc.get_kcube_mmi_params()
    assert (read.disp_brightness, read.preset_pos3) == (61, 7)
controller, bsc = opened("BSC203")
with controller, bsc:
    bsc.bay(2).set_dig_outputs(bit="digital_output_1")
    assert bsc.bay(2).get_dig_outputs().bit == 1
    assert bsc.bay(1).get_dig_outputs().bit == 0
"""
    run(package, START + program)


def test_an_unsupported_unit_is_refused_with_the_reason(package: Path) -> None:
    output = command(package, "virtual", "M30X", "--for", "0", status=2)
    assert output.count("\n") == 1
    assert "M30X cannot be simulated: Issue 37 has its" in output


def test_the_command_serves_a_unit_of_the_overlay(package: Path) -> None:
    """The command uses the package that Python imports."""
    serving = [sys.executable, "-c", "from stagewire_cli.main import run; run()"]
    serving += ["virtual", "KDC101", "--travel", "60000", "--tcp", "127.0.0.1:0"]
    program = """\
with devices.KDC101.open(URL) as kdc:
    assert kdc.info.model_number == "KDC101"
    kdc.home()
    kdc.move_absolute(counts=20000)
    assert kdc.get_dc_status_update().position == 20000
"""
    with subprocess.Popen(
        serving, env=environment_of(package), stdout=subprocess.PIPE, text=True
    ) as server:
        try:
            assert server.stdout is not None
            url = server.stdout.readline().split()[-1]
            run(package, f"{START}URL = {url!r}\n{program}")
        finally:
            server.terminate()


RENAMING = """\
overlay: renaming
title: New names of two messages.
summary: Renames messages that virtual controllers use.
document: {title: A later issue, issue: "99", date: May 2026, pages: 1}
renames:
  parameter_sets: {MOT_VELPARAMS: {to: MOT_SPEEDPARAMS, spelling: speed params}}
  messages: {MOT_MOVE_JOG: {to: MOT_MOVE_STEP, spelling: move step}%s}
"""
RENAMED = """\
from stagewire.errors import MotionTimeoutError, NotReadyError
from stagewire_apt import TDC001

with TDC001.open("virtual://TDC001", motion_timeout=0.5) as tdc:
    print(tdc.get_speed_params().max_velocity)


    def attempt(move):
        try:
            move()
        except NotReadyError as error:
            print(error)
        except MotionTimeoutError:
            print("no end")
            tdc.stop()

    attempt(lambda: tdc.jog(1))
    attempt(lambda: tdc.move_relative(counts=5))
    tdc.set_speed_params(min_velocity=0, acceleration=100, max_velocity=1000)
    print(tdc.get_speed_params().max_velocity)
    attempt(lambda: tdc.move_relative(counts=5))
"""


def renamed(tmp_path: Path, *more: str) -> Path:
    """Return a package with an overlay that renames messages."""
    spec = tmp_path / "thorlabs_apt"
    shutil.copytree(ROOT / "spec" / "thorlabs_apt", spec)
    shutil.copytree(ROOT / "spec" / "schema", tmp_path / "schema")
    (spec / "overlays" / "renaming").mkdir()
    (spec / "overlays" / "renaming" / "overlay.yaml").write_text(RENAMING % "".join(more))
    options = ["--overlay", "thorlabs_apt/renaming", "--base"]
    assert main(["generate", "--spec", str(spec), "--out", str(tmp_path / "out"), *options]) == 0
    return tmp_path / "out" / "python"


def test_virtual_controllers_lose_the_behaviour_of_renamed_messages(tmp_path: Path) -> None:
    """As ``docs/how-to/overlays.md`` says."""
    first, jog, refused, second, move, warning = run(renamed(tmp_path), RENAMED).splitlines()
    assert (first, jog, second, move) == ("0", "no end", "1000", "no end")
    assert "move_relative was not sent" in refused
    for text in (refused, warning):
        assert "acceleration is 0; max_velocity is 0" in text


def test_a_unit_whose_kind_no_message_shows_cannot_be_simulated(tmp_path: Path) -> None:
    package = renamed(tmp_path, ", MOT_MOVE_HOME: {to: MOT_GO_HOME, spelling: go home}")
    output = command(package, "stop", "virtual://TDC001", status=1)
    assert "TDC001 cannot be simulated yet: a virtual channel needs one of the messages" in output
