"""The controller of examples/c passes the conformance suite, in stepped and in real time."""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from toolchain import C_WARNINGS, C, compiles, need

from checkout import ROOT
from stagewire.links import Link
from stagewire_conformance.device.execution import Execution, execute
from stagewire_conformance.device.permissions import Permissions, Range
from stagewire_conformance.device.plans import Plan
from stagewire_conformance.device.run import run
from stagewire_conformance.reports import Grade, Sheet, Verdict
from stagewire_conformance.reports.device_sheet import sheet_of_execution

EXAMPLES = ROOT / "examples" / "c"
HARNESS = Path(__file__).with_name("stepped_firmware.c")
CYCLE = 102.4e-6
MOST = 4096
ALL = Permissions(settings=True, motion=Range.parse("0..40mm"), eeprom=True, tuning=True)


class SteppedFirmware(Link):
    """A line to the compiled firmware, whose clock runs only while the line is read."""

    url = "stepped firmware.c"

    def __init__(self, library: Path) -> None:
        self._library = ctypes.CDLL(str(library))
        self._library.stepped_read.restype = ctypes.c_size_t
        self._library.stepped_cycles.restype = ctypes.c_uint32
        self._library.stepped_begin()
        self._began = self._library.stepped_cycles()
        self._cycles = 0
        self._output = ctypes.create_string_buffer(MOST)

    def clock(self) -> float:
        return self._cycles * CYCLE

    def read(self, timeout: float) -> bytes:
        until = self._cycles + math.ceil(timeout / CYCLE)
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


def library(folder: Path, printed: str = "", changed: str = "") -> Path:
    """Compile the firmware as a library, with one text of its sources replaced."""
    need("gcc")
    sources = []
    for name in ("firmware.c", "motor.c"):
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


def sheet(link: Link) -> Sheet:
    """Run the suite with all permissions on the controller as its PICS declares it."""
    plan = Plan.of(None, ALL, pics=EXAMPLES / "pics.toml")
    report = run(link, plan.checks, plan.declared, plan.allowed, plan.seed)
    return sheet_of_execution(Execution(plan=plan, url=link.url, report=report, seconds=0.0))


def assert_passes(result: Sheet) -> None:
    assert [(case.id, finding.text) for case in result.grave() for finding in case.findings] == []
    assert [case.id for case in result.cases(Grade.FRAGILE)] == []
    assert result.verdict is Verdict.PASSED, result.unfinished
    counts = result.counts()
    assert counts[Grade.NOT_RUN] == 0
    assert counts[Grade.PASSED] >= 40
    skipped = {case.why for case in result.cases(Grade.SKIPPED)}
    assert all(why.startswith("the PICS lists ") for why in skipped)


def test_the_firmware_passes_the_suite(tmp_path: Path) -> None:
    assert_passes(sheet(SteppedFirmware(library(tmp_path))))


@pytest.mark.parametrize(
    ("printed", "changed", "found"),
    [
        ("#define GAP_CYCLES 488U", "#define GAP_CYCLES 48800U", "truncated/header"),
        ("#define UPDATE_CYCLES 977U", "#define UPDATE_CYCLES 1954U", "updates/start-stop"),
        ("here + relative", "here + 2 * relative", "move-relative/0x21/1"),
    ],
)
def test_the_suite_finds_broken_firmware(
    printed: str, changed: str, found: str, tmp_path: Path
) -> None:
    result = sheet(SteppedFirmware(library(tmp_path, printed, changed)))
    assert found in {case.id for case in (*result.grave(), *result.cases(Grade.FRAGILE))}


@pytest.fixture
def port(tmp_path: Path) -> Iterator[Path]:
    """The serial port of the controller as the README builds and starts it."""
    need("gcc")
    folder = tmp_path / "examples" / "c"
    shutil.copytree(EXAMPLES, folder)
    compiles("make", "--silent", f"GENERATED={C}", "controller", cwd=folder)
    link = tmp_path / "port"
    process = subprocess.Popen([folder / "controller", link])
    deadline = time.monotonic() + 20
    while not link.exists() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    yield link
    process.terminate()
    assert process.wait(20) == 0


@pytest.mark.proof
@pytest.mark.matrix
def test_the_controller_passes_the_suite_in_real_time(port: Path) -> None:
    plan = Plan.of(None, ALL, pics=EXAMPLES / "pics.toml")
    assert_passes(sheet_of_execution(execute(str(port), plan)))
