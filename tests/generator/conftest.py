"""Specs for the tests of the generator: four small good specs, and copies of them for tests to change.

``good_spec`` has messages with a header, ``good_layouts`` has messages that share an id, ``good_commands``
has commands and their replies, and ``good_packets`` has packets.
"""

from __future__ import annotations

import importlib
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from files import write_files
from quick_specs import quick_specs
from stagewire_generator import check, render
from stagewire_generator.model import Protocol

HERE = Path(__file__).parent
PACKAGES = ("stagewire_tiny", "stagewire_laser", "stagewire_turtle", "stagewire_carousel")


@pytest.fixture(scope="session")
def good_spec() -> Path:
    """The small good spec, which tests must not change."""
    return HERE / "good_spec"


@pytest.fixture
def spec(tmp_path: Path, good_spec: Path) -> Path:
    """A copy of the small good spec."""
    return Path(shutil.copytree(good_spec, tmp_path / "spec"))


@pytest.fixture(scope="session")
def good_commands() -> Path:
    """The small good spec of commands, which tests must not change."""
    return HERE / "good_commands"


@pytest.fixture
def commands_spec(tmp_path: Path, good_commands: Path) -> Path:
    """A copy of the small good spec of commands."""
    return Path(shutil.copytree(good_commands, tmp_path / "commands"))


@pytest.fixture(scope="session")
def overlaid_spec(good_spec: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The good specs of messages and commands with overlays, which tests must not change."""
    folder = tmp_path_factory.mktemp("overlaid") / "spec"
    for name in (good_spec.name, "good_commands", "good_overlays"):
        shutil.copytree(HERE / name, folder, dirs_exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def overlaid(overlaid_spec: Path) -> dict[str, Protocol]:
    """``PROTOCOL/OVERLAY`` -> the protocol with the overlay applied."""
    names = [f"{path.parents[1].name}/{path.name}" for path in overlaid_spec.glob("*/overlays/*")]
    return {
        name: protocol
        for name in sorted(names)
        for protocol in check(overlaid_spec, overlays=[name])
        if name.startswith(f"{protocol.name}/")
    }


@pytest.fixture(scope="session")
def commands(good_commands: Path) -> Protocol:
    return check(good_commands)[0]


@pytest.fixture(scope="session")
def command_files(commands: Protocol) -> dict[str, str]:
    """The files generated from the small good spec of commands."""
    return render([commands])


@pytest.fixture(scope="session")
def layouts() -> Protocol:
    """The small good spec of messages that share an id, and of layouts that depend on the unit."""
    return check(HERE / "good_layouts")[0]


@pytest.fixture(scope="session")
def laser_files(layouts: Protocol) -> dict[str, str]:
    """The files generated from the small good spec of messages that share an id."""
    return render([layouts])


@pytest.fixture(scope="module")
def laser(laser_files: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The package of this spec, installed."""
    folder = tmp_path_factory.mktemp("made")
    write_files(folder, laser_files)
    info = folder / "python" / "stagewire_laser-1.dist-info"
    info.mkdir()
    head = "Metadata-Version: 2.1\nName: stagewire-laser\nVersion: 1\n"
    (info / "METADATA").write_text(head, encoding="utf-8")
    points = "[stagewire.protocols]\nlaser = stagewire_laser:PROTOCOL\n"
    (info / "entry_points.txt").write_text(points, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder / "python")
        yield importlib.import_module("stagewire_laser")
    for name in [name for name in sys.modules if name.partition(".")[0] == "stagewire_laser"]:
        del sys.modules[name]


@pytest.fixture(scope="session")
def good_packets() -> Path:
    """The small good spec of packets, which tests must not change."""
    return HERE / "good_packets"


@pytest.fixture
def packets_spec(tmp_path: Path, good_packets: Path) -> Path:
    """A copy of the small good spec of packets."""
    return Path(shutil.copytree(good_packets, tmp_path / "packets"))


@pytest.fixture(scope="session")
def packets(good_packets: Path) -> Protocol:
    return check(good_packets)[0]


@pytest.fixture(scope="session")
def packet_files(packets: Protocol) -> dict[str, str]:
    """The files generated from the small good spec of packets."""
    return render([packets])


@pytest.fixture(scope="session")
def protocol(good_spec: Path) -> Protocol:
    return check(good_spec)[0]


@pytest.fixture(scope="session")
def files(protocol: Protocol) -> dict[str, str]:
    """The files generated from the small good spec."""
    return render([protocol])


@pytest.fixture(scope="module")
def quick_checking() -> Iterator[None]:
    """Read and check only changed files again."""
    with quick_specs():
        yield


@pytest.fixture
def imported() -> Iterator[Callable[[Path], Any]]:
    """Return a function that imports the package below a folder, without a cached copy."""
    before = list(sys.path)

    def forget() -> None:
        for name in [n for n in sys.modules if n.split(".")[0] in PACKAGES]:
            del sys.modules[name]

    def load_package(folder: Path) -> Any:
        forget()
        sys.path[:] = [str(folder / "python"), *before]
        importlib.invalidate_caches()
        [package] = (folder / "python").glob("*/__init__.py")
        return importlib.import_module(package.parent.name)

    yield load_package
    forget()
    sys.path[:] = before
