"""The piezo units and messages of the overlays for Issue 37 and for programs of the vendor."""

from __future__ import annotations

from pathlib import Path

import pytest

from checkout import ROOT
from overlay_packages import run
from stagewire_cli.main import main
from stagewire_generator import check
from stagewire_generator.model import Protocol

SPEC = ROOT / "spec" / "thorlabs_apt"
NAMES = ("thorlabs_apt/issue_37", "thorlabs_apt/vendor_software")
LENGTHS = {
    "PZ_SET_PPC_PIDCONSTS": {12},
    "PZ_SET_PPC_NOTCHPARAMS": {16},
    "PZ_SET_PPC_IOSETTINGS": {14},
    "PZ_SET_PIDCRITERIA": {14},
    "KPZ_GET_KCUBEMMIPARAMS": {34},
    "KPZ_SET_KCUBETRIGIOCONFIG": {22, 12},
    "KSG_SET_KCUBEMMIPARAMS": {8},
    "KSG_SET_KCUBETRIGIOCONFIG": {22},
    "KPC_GET_KCUBETRIGIOCONFIG": {32},
    "KPC_GET_KCUBEMMIPARAMS": {34},
    "KPC_GET_IOSETTINGS": {14},
}
UNITS = {
    "BPC302": ("rack", 2),
    "BPC303": ("rack", 3),
    "PPC001": ("generic_usb", 1),
    "PPC102": ("rack", 2),
    "KPZ101": ("generic_usb", 1),
    "KSG101": ("generic_usb", 1),
    "CT1P": ("generic_usb", 1),
    "KPC101": ("generic_usb", 1),
}


@pytest.fixture(scope="module")
def protocol() -> Protocol:
    [found] = check(SPEC, overlays=list(NAMES))
    return found


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The path of the package ``stagewire_apt`` with the overlays that are on by default."""
    out = tmp_path_factory.mktemp("piezo")
    assert main(["generate", "--spec", str(SPEC), "--out", str(out)]) == 0
    return out / "python"


@pytest.mark.parametrize("name", LENGTHS)
def test_messages_have_the_lengths_of_the_byte_tables(protocol: Protocol, name: str) -> None:
    [found] = [message for message in protocol.messages if message.name == name]
    assert {layout.length for layout in found.layouts} == LENGTHS[name]


@pytest.mark.parametrize("name", UNITS)
def test_units_have_their_address_and_number_of_bays(protocol: Protocol, name: str) -> None:
    unit = protocol.units["units"][name]
    assert (unit["address"], unit.get("bays", 1), unit["channels"]) == (*UNITS[name], 1)
    assert unit["status"] == "piezo"


def test_units_of_issue_3_get_the_messages_of_the_lists_of_issue_37(package: Path) -> None:
    program = """\
from stagewire_apt import devices, messages as m
for name in ("TPZ001", "TSG001", "MPZ601", "BPC202", "BPC301"):
    assert "HW_RICHRESPONSE" in getattr(devices, name).unit.messages, name
assert "PZ_GET_OUTPUTLUT" in devices.TPZ001.unit.messages
assert "PZ_GET_OUTPUTLUT" not in devices.KPZ101.unit.messages
"""
    run(package, program)


def test_digital_outputs_of_motherboard_and_module_have_one_name(package: Path) -> None:
    """A class with both kinds of outputs would rename the methods of all classes."""
    program = """\
from stagewire_apt import devices
assert hasattr(devices.KDC101, "set_dig_outputs")
with devices.BPC303.open("virtual://BPC303") as rack:
    rack.set_dig_outputs(dig_op=1)
    assert rack.get_dig_outputs().dig_op == 1
    rack.bay(2).set_dig_outputs(bit="digital_output_1")
    assert rack.bay(2).get_dig_outputs().bit == 1
"""
    run(package, program)


def test_the_voltage_range_of_a_kpc101_is_its_full_scale(package: Path) -> None:
    """Counts as in the vendor's XA software: 32767 is 75 V or 150 V."""
    program = """\
from stagewire_apt import devices
with devices.KPC101.open("virtual://KPC101", max_volts=150) as cube:
    cube.set_output_volts(volts=37.5)
    assert cube.get_output_volts().voltage in (16383, 16384)
    cube.change_io_settings(voltage_range="RANGE_150V")
    assert round(cube.get_output_volts().volts, 2) == 75.0
"""
    run(package, program)


def test_virtual_piezo_units_follow_the_messages_of_the_overlays(package: Path) -> None:
    program = """\
from stagewire_apt import devices
with devices.KPC101.open("virtual://KPC101") as cube:
    cube.set_max_travel(um=30)
    assert cube.get_max_travel().um == 30
    cube.set_pos_control_mode(mode="CLOSED_LOOP")
    cube.set_output_pos(um=15)
    assert round(cube.get_output_pos().um, 2) == 15.0
with devices.BPC303.open("virtual://BPC303") as rack:
    assert "hardware_75v" in str(rack.bay(3).get_pz_status_bits())
"""
    run(package, program)


def test_frames_of_the_xa_software_are_read(package: Path) -> None:
    """Frames that it sent to a simulated KPC101, with other numbers in every field."""
    program = """\
from stagewire_apt import messages as m
trigger = m.decode(bytes.fromhex(
    "FC 07 20 00 D0 01 01 00 0B 00 01 00 02 00 01 00 11 11 00 00 22 22 00 00 33 00 02 00 44 00 55 00"
    "00 00 00 00 00 00"
)).message
assert isinstance(trigger, m.KpcSetKcubeTrigIoConfig)
assert (trigger.lower_lim, trigger.upper_lim, trigger.smoothing_samples) == (0x1111, 0x2222, 0x33)
assert (trigger.monitor_signal, trigger.monitor_filter, trigger.monitor_output) == (2, 0x44, 0x55)
settings = m.decode(bytes.fromhex("F3 08 0E 00 D0 01 01 00 46 00 03 00 21 00 96 00 07 00 01 00")).message
assert isinstance(settings, m.KpcSetIoSettings)
assert (settings.voltage_limit, settings.analog_input, settings.filter) == (70, 3, 33)
assert (settings.voltage_range, settings.force_sense, settings.strain_gauge_option) == (150, 7, 1)
travel = m.decode(bytes.fromhex("4F 06 04 00 D0 01 01 00 64 00")).message
assert isinstance(travel, m.PzSetMaxTravel) and travel.travel == 100
"""
    run(package, program)


def test_criteria_of_the_ct1p_are_those_of_the_vendor_s_settings(package: Path) -> None:
    program = """\
from stagewire_apt import messages as m
from stagewire_apt.enumerations import NearTargetCriterion
assert (NearTargetCriterion.STRAIN_GAUGE, NearTargetCriterion.ENCODER) == (64, 65)
raw = m.PzSetPidCriteria(1, 64, 1, 10).pack(0x50, 1)
assert raw.hex(" ") == "9b 06 0e 00 d0 01 01 40 01 00 00 00 0a 00 00 00 00 00 00 00", raw.hex(" ")
"""
    run(package, program)
