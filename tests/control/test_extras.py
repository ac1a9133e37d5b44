"""Each package for a control system is an extra: nothing else imports it, and it says what it needs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

FOREIGN = (
    "aioca", "bluesky", "caproto", "epics", "event_model", "ophyd", "ophyd_async", "p4p", "phoebusgen",
    "pymmcore", "pymmcore_plus", "useq",
)  # fmt: skip
CONTROL = ("stagewire_bluesky", "stagewire_epics", "stagewire_pymmcore")
BLOCKER = f"""
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {FOREIGN!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Missing())
"""


def python(code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, "-c", BLOCKER + code, *arguments]
    return subprocess.run(words, capture_output=True, text=True, timeout=60)


def test_the_library_and_the_command_work_without_the_extras() -> None:
    code = """
import stagewire, stagewire_apt.aio, stagewire_ms2000.aio, stagewire_virtual, stagewire_conformance
from stagewire_cli.main import main
for words in ("--help", "ioc --help", "show TDC001", "monitor virtual://TDC001 --for 0.1"):
    assert main(words.split()) == 0, words
assert not {name.partition(".")[0] for name in sys.modules} & set(sys.argv[1:])
"""
    done = python(code, *CONTROL)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("package", "extra"), [("stagewire_bluesky", "bluesky"), ("stagewire_pymmcore", "pymmcore")]
)
def test_a_package_names_the_extra_that_it_needs(package: str, extra: str) -> None:
    done = python(f"import {package}")
    assert done.returncode != 0
    assert f"{package} requires " in done.stderr
    assert f"pip install 'stagewire[{extra}]'" in done.stderr


def test_devices_of_ophyd_async_need_no_ophyd() -> None:
    code = BLOCKER.replace(repr(FOREIGN), repr(("aioca", "epics", "ophyd", "p4p")))
    for module, status in (("", 0), (".epics", 0), (".classic", 1)):
        words = [sys.executable, "-c", f"{code}\nimport stagewire_bluesky{module}"]
        done = subprocess.run(words, capture_output=True, text=True, timeout=60)
        assert done.returncode == status, done.stderr
    assert (
        "stagewire_bluesky.classic requires ophyd: pip install 'stagewire[bluesky-epics]'"
        in done.stderr
    )


def test_the_command_names_the_extra_of_the_ioc(tmp_path: Path) -> None:
    (tmp_path / "bench.toml").write_text("")
    code = "from stagewire_cli.main import main; raise SystemExit(main(sys.argv[1:]))"
    done = python(code, "ioc", str(tmp_path / "bench.toml"))
    assert done.returncode == 2
    assert "stagewire ioc requires caproto: pip install 'stagewire[epics]'" in done.stderr
    assert "Traceback" not in done.stderr
