"""The controllers of examples/c pass the conformance suite, in stepped and in real time."""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from toolchain import C_WARNINGS, C, compiles, need

import allowances
from checkout import ROOT
from stagewire import End, FramedMessage
from stagewire.framing import Received
from stagewire.links import Link
from stagewire.protocols import Message
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_conformance.device.execution import Execution, execute
from stagewire_conformance.device.permissions import Range
from stagewire_conformance.device.plans import Plan
from stagewire_conformance.device.run import run
from stagewire_conformance.reports import Grade, Sheet, Verdict
from stagewire_conformance.reports.device_sheet import sheet_of_execution

EXAMPLES = ROOT / "examples" / "c"
HARNESS = Path(__file__).with_name("stepped_firmware.c")
SOURCES = ("firmware.c", "settings.c", "motion.c", "motor.c")
RANGES = {"bbd101": "0..40mm", "kdc101": "0..3mm"}
"""Unit -> the range in which its stage may move."""
MOST = 4096


class SteppedFirmware(Link):
    """A line to the compiled firmware, whose clock runs only while the line is read."""

    url = "stepped firmware"

    def __init__(self, library: Path) -> None:
        self._library = ctypes.CDLL(str(library))
        self._library.stepped_read.restype = ctypes.c_size_t
        self._library.stepped_cycles.restype = ctypes.c_uint32
        self._cycle = 1.024 / self._library.stepped_rate()
        self._cycles = 0
        self._output = ctypes.create_string_buffer(MOST)
        self.power_on()

    def power_on(self) -> None:
        """Switch the controller on, or off and on."""
        self._library.stepped_begin()
        self._began = self._library.stepped_cycles() - self._cycles

    @property
    def lamp(self) -> bool:
        """Whether the lamp on the front panel is lit."""
        return bool(self._library.stepped_lamp())

    @property
    def outputs(self) -> int:
        """The digital outputs that are on, one bit each."""
        return int(self._library.stepped_outputs())

    def clock(self) -> float:
        return self._cycles * self._cycle

    def read(self, timeout: float) -> bytes:
        until = self._cycles + math.ceil(timeout / self._cycle)
        end = ctypes.c_uint32(self._began + until)
        size = self._library.stepped_read(end, self._output)
        self._cycles += (self._library.stepped_cycles() - self._began - self._cycles) % 2**32
        return self._output.raw[:size]

    def write(self, data: bytes) -> None:
        assert self._library.stepped_write(data, ctypes.c_size_t(len(data)))

    def write_now(self, data: bytes) -> None:
        self.write(data)

    def wake(self) -> None:
        """Do nothing: no read waits in real time."""

    def close(self) -> None:
        """Do nothing."""


def library(folder: Path, unit: str, printed: str = "", changed: str = "") -> Path:
    """Compile the firmware of a unit as a library, with one text of its sources replaced."""
    need("gcc")
    sources = []
    for name in (f"{unit}.c", *SOURCES):
        text = (EXAMPLES / name).read_text(encoding="utf-8")
        sources.append(folder / name)
        sources[-1].write_text(text.replace(printed, changed) if printed else text, "utf-8")
    texts = "".join(each.read_text(encoding="utf-8") for each in sources)
    assert not printed or (changed in texts and printed not in texts)
    made = folder / "firmware.so"
    compiles(
        "gcc", "-std=c99", "-O2", *C_WARNINGS, "-shared", "-fPIC", f"-I{C}", f"-I{EXAMPLES}",
        *sources, HARNESS, C / "stagewire_apt" / "stagewire_apt.c", "-o", made,
    )  # fmt: skip
    return made


def plan_of(unit: str) -> Plan:
    """Return the run with all permissions on a controller as its PICS declares it."""
    motion = Range.parse(RANGES[unit])
    everything = allowances.everything(motion)
    return Plan.of(None, everything, pics=EXAMPLES / f"{unit}.toml")


def sheet(link: Link, unit: str) -> Sheet:
    """Run the suite on a controller in stepped time."""
    plan = plan_of(unit)
    report = run(link, plan.checks, plan.declared, plan.allowed, plan.seed)
    return sheet_of_execution(Execution(plan=plan, url=link.url, report=report, seconds=0.0))


def assert_passes(result: Sheet, unit: str) -> None:
    """Assert that a run was complete, without a finding."""
    assert [(case.id, finding.text) for case in result.grave() for finding in case.findings] == []
    assert [case.id for case in result.cases(Grade.FRAGILE)] == []
    assert result.verdict is Verdict.PASSED, result.unfinished
    counts = result.counts()
    assert counts[Grade.NOT_RUN] == 0
    assert counts[Grade.PASSED] >= {"bbd101": 50, "kdc101": 91}[unit]
    skipped = {case.why for case in result.cases(Grade.SKIPPED)}
    assert all(why.startswith("the PICS lists ") for why in skipped)
    assert unit != "kdc101" or not skipped


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    """Unit -> its library."""
    return {unit: library(tmp_path_factory.mktemp(unit), unit) for unit in RANGES}


@pytest.fixture
def kdc101(compiled: Mapping[str, Path], tmp_path: Path) -> SteppedFirmware:
    """The line to a new KDC101; its library is a copy, because a loaded one has only one controller."""
    return SteppedFirmware(shutil.copy(compiled["kdc101"], tmp_path / "own.so"))


@pytest.mark.parametrize("unit", RANGES)
def test_the_firmware_passes_the_suite(unit: str, compiled: Mapping[str, Path]) -> None:
    assert_passes(sheet(SteppedFirmware(compiled[unit]), unit), unit)


@pytest.mark.parametrize(
    ("unit", "printed", "changed", "found"),
    [
        ("bbd101", "#define GAP CYCLES(50U)", "#define GAP CYCLES(5000U)", "truncated/header"),
        ("bbd101", "UPDATE CYCLES(100U)", "UPDATE CYCLES(200U)", "updates/start-stop"),
        ("bbd101", "here + move.rel", "here + 2 * move.rel", "move-relative/0x21/1"),
        ("kdc101", "UNACKNOWLEDGED 50U", "UNACKNOWLEDGED 90U", "keep-alive"),
        ("kdc101", "move.to - backlash.backlash", "move.to - 0 * backlash.backlash", "backlash/0x50/1"),
        pytest.param(
            "kdc101", "end = motor->velocity < 0 ? 0 :", "end = motor->velocity < 0 ? -99999 * ONE_COUNT :",
            "limits/0x50/1", marks=pytest.mark.matrix,
        ),
        pytest.param(
            "kdc101", "meets_limit(motor, before);", "false; (void)before; (void)meets_limit;",
            "soft-limits/0x50/1", marks=pytest.mark.matrix,
        ),
        pytest.param(
            "kdc101", "move.velocity = set.home_velocity;", "", "home-again/0x50/1/velocity",
            marks=pytest.mark.matrix,
        ),
        pytest.param(
            "kdc101", "(uint32_t)set.jog_max_velocity", "move.velocity",
            "move-jog/0x50/1/continuous",
            marks=pytest.mark.matrix,
        ),
        pytest.param(
            "kdc101", "(void)setting->renew(changed, kept);",
            "if (setting->renew(changed, kept)) { kept[8] ^= 1U; }",
            "readback/0x50/MOT_SET_KCUBEPOSTRIGPARAMS/1", marks=pytest.mark.matrix,
        ),
    ],
)  # fmt: skip
def test_the_suite_finds_broken_firmware(
    unit: str, printed: str, changed: str, found: str, tmp_path: Path
) -> None:
    result = sheet(SteppedFirmware(library(tmp_path, unit, printed, changed)), unit)
    assert found in {case.id for case in (*result.grave(), *result.cases(Grade.FRAGILE))}


# Behaviour that the suite cannot see: across a power cycle, on the front panel, or outside the document


def asked(line: SteppedFirmware, *messages: FramedMessage) -> Message | None:
    """Send messages to a KDC101, and return the reply to the last one; None without one."""
    for message in messages:
        line.write(message.pack(dest=0x50, source=0x01))
    framer = PROTOCOL.framer(End.HOST)
    framer.tell(0x50, status="dc")
    events = framer.feed(line.read(0.1))
    frames = [event.frame for event in events if isinstance(event, Received)]
    assert len(frames) <= 1
    return frames[0].message if frames else None


def test_only_saved_settings_outlive_a_power_cycle(kdc101: SteppedFirmware) -> None:
    modes, backlash = asked(kdc101, m.MotReqAvModes(1)), asked(kdc101, m.MotReqGenMoveParams(1))
    assert isinstance(modes, m.MotGetAvModes)
    assert isinstance(backlash, m.MotGetGenMoveParams)
    changed = m.MotSetAvModes(1, 1), m.MotSetGenMoveParams(1, 50)
    assert asked(kdc101, *changed, m.MotSetEepromParams(1, m.MotSetAvModes.layout.id)) is None
    kdc101.power_on()
    assert asked(kdc101, m.MotReqAvModes(1)) == modes.replace(mode_bits=1)
    assert asked(kdc101, m.MotReqGenMoveParams(1)) == backlash


def test_values_outside_their_range_change_nothing(kdc101: SteppedFirmware) -> None:
    panel = asked(kdc101, m.MotReqKcubeMmiParams(1))
    assert isinstance(panel, m.MotGetKcubeMmiParams)
    wrong = {"js_max_vel": 5, "disp_brightness": 101}
    message = m.MotSetKcubeMmiParams.keep(panel.values() | wrong)
    assert asked(kdc101, message, m.MotReqKcubeMmiParams(1)) == panel


def test_a_shorter_layout_keeps_the_values_that_it_does_not_have(kdc101: SteppedFirmware) -> None:
    panel = asked(kdc101, m.MotReqKcubeMmiParams(1))
    assert isinstance(panel, m.MotGetKcubeMmiParams)
    whole = panel.replace(js_sensitivity=7, disp_dim_level=3)
    short = {name: whole.values()[name] for name in m.MotSetKcubeMmiParamsShort.layout.fields}
    messages = (
        m.MotSetKcubeMmiParams(**panel.values() | {"js_sensitivity": 7}),
        m.MotSetKcubeMmiParamsShort(**short),
    )
    assert asked(kdc101, *messages, m.MotReqKcubeMmiParams(1)) == whole


def test_another_channel_is_not_answered_and_does_not_move(kdc101: SteppedFirmware) -> None:
    assert asked(kdc101, m.MotReqVelParams(2)) is None
    assert asked(kdc101, m.MotMoveHome(2)) is None
    status = asked(kdc101, m.MotReqDcStatusUpdate(1))
    assert isinstance(status, m.MotGetDcStatusUpdate)
    assert status.status_bits_flags.names == ("channel_enabled", "motor_connected")


@pytest.mark.parametrize(
    "wrong", [{"home_velocity": 0}, {"limit_switch": 0}, {"limit_switch": 4}, {"home_direction": 1}]
)
def test_home_parameters_that_cannot_home_move_nothing(
    wrong: dict[str, int], kdc101: SteppedFirmware
) -> None:
    home = asked(kdc101, m.MotReqHomeParams(1))
    assert isinstance(home, m.MotGetHomeParams)
    asked(kdc101, m.MotSetHomeParams(**home.values() | wrong), m.MotMoveHome(1))
    status = asked(kdc101, m.MotReqDcStatusUpdate(1))
    assert isinstance(status, m.MotGetDcStatusUpdate)
    assert status.position == 0
    assert "homing" not in status.status_bits_flags.names


def test_a_motor_at_rest_answers_a_stop(kdc101: SteppedFirmware) -> None:
    for mode in (1, 2):  # hosts wait for the answer, for example the vendor's XA software
        stopped = asked(kdc101, m.MotMoveStop(1, mode))
        assert isinstance(stopped, m.MotMoveStoppedDc)
        assert (stopped.position, stopped.velocity) == (0, 0)
        assert not stopped.status_bits_flags.moving_forward


def test_the_digital_outputs_are_those_of_the_message(kdc101: SteppedFirmware) -> None:
    assert asked(kdc101, m.ModSetDigOutputs(bit=2), m.ModReqDigOutputs()) == m.ModGetDigOutputs(
        bit=2
    )
    assert kdc101.outputs == 2


def test_the_lamp_obeys_its_setting(kdc101: SteppedFirmware) -> None:
    def lit() -> set[bool]:
        """Return the states of the lamp in half a second."""
        states = set()
        for _ in range(50):
            kdc101.read(0.01)
            states.add(kdc101.lamp)
        return states

    assert lit() == {False}
    asked(kdc101, m.ModIdentify())
    assert lit() == {False, True}
    kdc101.read(5.0)
    assert lit() == {False}
    asked(kdc101, m.MotMoveVelocity(1, 1))
    assert lit() == {True}
    asked(kdc101, m.MotSetAvModes(1, 0))
    assert lit() == {False}


# In real time


@pytest.fixture
def port(unit: str, tmp_path: Path) -> Iterator[Path]:
    """The serial port of a controller as the README builds and starts it."""
    need("gcc")
    folder = tmp_path / "examples" / "c"
    shutil.copytree(EXAMPLES, folder)
    compiles("make", "--silent", f"GENERATED={C}", unit, cwd=folder)
    link = tmp_path / "port"
    process = subprocess.Popen([folder / unit, link])
    deadline = time.monotonic() + 20
    while not link.exists() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    yield link
    process.terminate()
    assert process.wait(20) == 0


@pytest.mark.proof
@pytest.mark.matrix
@pytest.mark.parametrize("unit", RANGES)
def test_the_controller_passes_the_suite_in_real_time(unit: str, port: Path) -> None:
    assert_passes(sheet_of_execution(execute(str(port), plan_of(unit))), unit)
