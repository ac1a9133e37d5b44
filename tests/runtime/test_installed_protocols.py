"""Installed protocols: their packages, duplicates, and broken packages."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from stagewire import available_protocols, load_protocol
from stagewire.errors import UnknownProtocolError, UnusableProtocolError
from stagewire_cli.main import main

Install = Callable[[str, str, str], None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Return a function that installs a package with some code for the protocol ``orbit``."""

    def make(distribution: str, package: str, code: str) -> None:
        folder = tmp_path / distribution
        info = folder / f"{distribution.replace('-', '_')}-1.dist-info"
        info.mkdir(parents=True)
        head = f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1\n"
        (info / "METADATA").write_text(head, encoding="utf-8")
        points = f"[stagewire.protocols]\norbit = {package}:PROTOCOL\n"
        (info / "entry_points.txt").write_text(points, encoding="utf-8")
        (folder / f"{package}.py").write_text(code, encoding="utf-8")
        monkeypatch.syspath_prepend(folder)
        monkeypatch.delitem(sys.modules, package, raising=False)

    return make


def test_a_protocol_of_one_package_is_loaded(install: Install) -> None:
    assert "orbit" not in available_protocols()
    install("orbit-one", "orbit_one", "from stagewire_ms2000 import PROTOCOL\n")
    assert "orbit" in available_protocols()
    assert load_protocol("orbit") is load_protocol("asi_ms2000")


def test_a_protocol_of_two_packages_is_refused(install: Install) -> None:
    install("orbit-two", "orbit_two", "PROTOCOL = 2\n")
    install("orbit-one", "orbit_one", "PROTOCOL = 1\n")
    assert available_protocols().count("orbit") == 1
    with pytest.raises(UnusableProtocolError) as caught:
        load_protocol("orbit")
    assert str(caught.value) == (
        "protocol orbit is provided by the package orbit_one (installed as orbit-one) and by the "
        "package orbit_two (installed as orbit-two); uninstall all but one"
    )
    assert isinstance(
        caught.value, UnknownProtocolError
    )  # so that handlers of the base class catch it
    assert load_protocol("thorlabs_apt").name == "thorlabs_apt"  # other protocols still work


def test_one_package_in_two_distributions_is_accepted(install: Install) -> None:
    install("orbit-one", "orbit_one", "from stagewire_ms2000 import PROTOCOL\n")
    install("orbit-again", "orbit_one", "from stagewire_ms2000 import PROTOCOL\n")
    assert load_protocol("orbit") is load_protocol("asi_ms2000")


BROKEN = {
    "from stagewire import nothing_of_this_name\n": "cannot import name 'nothing_of_this_name'",
    "PROTOCOLS = 1\n": "no attribute 'PROTOCOL'",
    "raise ValueError('a shape that cannot be')\n": "a shape that cannot be",
    "(\n": "was never closed",
}


@pytest.mark.parametrize("code", BROKEN)
def test_a_package_that_cannot_be_imported_is_refused(install: Install, code: str) -> None:
    install("orbit-broken", "orbit_broken", code)
    with pytest.raises(UnusableProtocolError) as caught:
        load_protocol("orbit")
    said = str(caught.value)
    assert said.startswith(
        "protocol orbit is provided by the package orbit_broken (installed as orbit-broken), "
        "which cannot be imported: "
    )
    assert BROKEN[code] in said
    assert said.endswith("; generate it again with the installed stagewire, or uninstall it")


def test_a_package_without_a_protocol_is_refused(install: Install) -> None:
    install("orbit-other", "orbit_other", "PROTOCOL = 5\n")
    with pytest.raises(UnusableProtocolError) as caught:
        load_protocol("orbit")
    assert str(caught.value) == (
        "protocol orbit is provided by the package orbit_other (installed as orbit-other), which "
        "defines PROTOCOL, but not as a protocol (its type is int); generate it again with the "
        "installed stagewire, or uninstall it"
    )


COMMANDS = {
    "show HW_DISCONNECT": "message HW_DISCONNECT (thorlabs_apt)\n",
    "encode HW_DISCONNECT --dest 0x50": "02 00 00 00 50 01\n",
    "decode 530401002201": "MOT_MOVE_ABSOLUTE (id 0x0453, Issue 3, page 45)\n",
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("code", ["import nothing_of_this_name\n", "PROTOCOL = 5\n"])
def test_the_command_leaves_out_a_broken_protocol(
    install: Install, capsys: pytest.CaptureFixture[str], command: str, code: str
) -> None:
    install("orbit-broken", "orbit_broken", code)
    assert main(command.split()) == 0
    out, err = capsys.readouterr()
    assert out.startswith(COMMANDS[command])
    assert err.startswith("stagewire: skipped: protocol orbit is provided by the package orbit_")
    assert err.count("\n") == 1


def test_commands_that_need_a_broken_protocol_fail(
    install: Install, capsys: pytest.CaptureFixture[str]
) -> None:
    install("orbit-broken", "orbit_broken", "PROTOCOL = 5\n")
    for command in ("conformance examples", "show STOP --protocol orbit"):
        assert main(command.split()) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith("stagewire: protocol orbit is provided by the package orbit_broken")
