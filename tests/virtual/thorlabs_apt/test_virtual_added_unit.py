"""Adding a unit of a known family to the registry takes one line and no code for its virtual controller."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from typing import Any

import pytest

from checkout import ROOT
from stagewire_apt import PROTOCOL
from stagewire_cli.main import main
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.errors import VirtualError
from stagewire_virtual.factory import make_instrument
from stagewire_virtual.instrument import Instrument, units_of
from stagewire_virtual.options import Options, Settings

# Units that are not in Issue 3, each as one line of units.yaml.
LINES = {
    "BSC203": (
        "{title: 3 channel benchtop stepper driver, page: 27, address: rack, channels: 1, bays: 3, "
        "family: card_slot_stepper, status: stepper, stages: [APT_STEPPER], update_rate_hz: 10, "
        "keep_alive: MOT_ACK_DCSTATUSUPDATE}"
    ),
    "KDC101": (
        "{title: 1 channel K-Cube DC servo driver, page: 27, address: generic_usb, channels: 1, "
        "family: dc_servo_cube, status: dc, stages: [], update_rate_hz: 20, "
        "keep_alive: MOT_ACK_DCSTATUSUPDATE}"
    ),
    "BPC303": (
        "{title: 3 channel benchtop piezo driver, page: 93, address: rack, channels: 1, bays: 3, "
        "family: benchtop_piezo_2011, status: piezo, stages: [], update_rate_hz: 10, "
        "keep_alive: PZ_ACK_PZSTATUSUPDATE}"
    ),
}
PREFIXES = {"BSC203": "70", "KDC101": "27", "BPC303": "71"}
"""The prefixes of their serial numbers, from a related unit or from public drivers."""


@pytest.fixture(scope="module")
def registry(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return the registry generated from the spec with these lines."""
    folder = tmp_path_factory.mktemp("added")
    without = shutil.ignore_patterns("overlays")  # an overlay describes some of these units
    shutil.copytree(ROOT / "spec", folder / "spec", ignore=without)
    path = folder / "spec" / "thorlabs_apt" / "units.yaml"
    text = path.read_text("utf-8")
    added = "".join(f"  {name}: {line}\n" for name, line in LINES.items())
    assert text.count("\nunits:\n") == 1
    path.write_text(text.replace("\nunits:\n", f"\nunits:\n{added}"), "utf-8")
    head = path.with_name("protocol.yaml")  # no document is a second witness of these units
    head.write_text(head.read_text("utf-8").replace("witness: complete", "witness: true"), "utf-8")
    out = folder / "generated"
    arguments = [
        "generate",
        "--spec",
        str(folder / "spec"),
        "--out",
        str(out),
        "--target",
        "registry",
    ]
    assert main(arguments) == 0
    return json.loads((out / "registry" / "thorlabs_apt.json").read_text("utf-8"))


class Host:
    """The host of an instrument, which records its answers."""

    def __init__(self, registry: Any, name: str) -> None:
        self.clock = SteppedClock()
        unit = units_of(PROTOCOL, registry)[name]
        options = Options(channels=(Settings(travel=50_000),))
        self.instrument: Instrument = make_instrument(unit, self.clock, options)
        self.heard: list[str] = []
        self.instrument.on_send = lambda frame: self.heard.append(frame.hex(" "))

    def say(self, text: str, seconds: float = 0.0) -> list[str]:
        """Send a frame; return the frames received immediately and in the given time."""
        self.heard.clear()
        self.instrument.receive(bytes.fromhex(text))
        self.clock.advance(seconds)
        return list(self.heard)


def test_the_added_units_are_those_of_the_registry_without_overlays(registry: Any) -> None:
    """The installed registry has units of the same names from Issue 37, in families of their own."""
    assert "overlays" not in registry["document"]
    installed = units_of(PROTOCOL)
    families = {name: unit.facts["family"] for name, unit in units_of(PROTOCOL, registry).items()}
    assert families["BPC303"] != installed["BPC303"].facts["family"]
    assert families["KDC101"] != installed["KDC101"].facts["family"]


@pytest.mark.parametrize(
    ("name", "address"), [("BSC203", "11"), ("KDC101", "50"), ("BPC303", "11")]
)
def test_added_units_report_their_hardware_information(
    registry: Any, name: str, address: str
) -> None:
    (text,) = Host(registry, name).say(f"05 00 00 00 {address} 01")
    said = bytes.fromhex(text)
    assert said[10:18].rstrip(b"\0 ").decode() == name
    assert str(int.from_bytes(said[6:10], "little")).startswith(PREFIXES[name])


def test_an_added_rack_of_steppers_moves(registry: Any) -> None:
    host = Host(registry, "BSC203")
    assert host.say("60 00 02 00 11 01") == ["61 00 02 01 01 11"]
    assert host.say("60 00 03 00 11 01") == ["61 00 03 02 01 11"]
    assert host.say("13 04 0e 00 a3 01 01 00 00 00 00 00 20 4e 00 00 10 27 00 00") == []
    # 1250 in 2 * sqrt(1250/20000) = 0.5 s
    assert host.say("53 04 06 00 a3 01 01 00 e2 04 00 00", 0.499) == []
    host.clock.advance(0.002)
    assert host.heard[0].startswith("64 04 0e 00 81 23 01 00 e2 04 00 00")


def test_an_added_cube_has_its_family_addresses_and_its_own_rate(
    registry: Any,
) -> None:
    host = Host(registry, "KDC101")
    for address in ("50", "11", "21"):
        assert host.say(f"11 02 01 00 {address} 01") == [f"12 02 01 01 01 {address}"]
    assert len(host.say("11 00 00 00 50 01", 1.01)) == 20


def test_an_added_rack_of_piezo_controllers_answers(registry: Any) -> None:
    host = Host(registry, "BPC303")
    assert host.say("83 06 06 00 a2 01 01 00 f2 04 f2 04") == []
    assert host.say("84 06 01 00 22 01") == ["85 06 06 00 81 22 01 00 f2 04 f2 04"]
    assert host.say("84 06 01 00 50 01") == []


def test_an_added_unit_without_a_simulated_kind_of_channel_is_refused() -> None:
    unit = units_of(PROTOCOL)["TDC001"]
    facts = {**unit.facts, "name": "KLC101", "messages": ["HW_REQ_INFO", "HW_GET_INFO"]}
    klc = replace(unit, name="KLC101", facts=facts)
    with pytest.raises(
        VirtualError, match=r"^KLC101 cannot be simulated yet: a virtual channel needs"
    ):
        make_instrument(klc, SteppedClock(), Options())
