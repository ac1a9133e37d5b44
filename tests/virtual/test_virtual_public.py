"""The public names of ``stagewire_virtual``, their options, and the cost of the import."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import stagewire_virtual as virtual
from checkout import ROOT
from stagewire.errors import BadValueError
from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.errors import (
    BadOptionError,
    FaultError,
    UnknownPartError,
    UnknownUnitError,
    VirtualError,
)
from stagewire_virtual.factory import Factory, simulated_units
from stagewire_virtual.instrument import all_units
from stagewire_virtual.options import Options, Settings


def test_every_public_name_comes_from_its_listed_module() -> None:
    assert sorted(virtual.__all__) == virtual.__all__
    assert set(virtual.__all__) == set(virtual._MODULES)
    for name, module in virtual._MODULES.items():
        found = getattr(virtual, name)
        assert found is getattr(importlib.import_module(f"stagewire_virtual.{module}"), name)
        assert found.__doc__


def test_type_checkers_see_the_same_names() -> None:
    source = inspect.getsource(virtual)
    block = source[source.index("if TYPE_CHECKING:") : source.index("__all__")]
    seen = {
        name.strip()
        for line in block.splitlines()
        if "from stagewire_virtual" in line
        for name in line.partition(" import ")[2].split(",")
    }
    assert seen == set(virtual.__all__)


def test_every_unit_of_the_registry_can_be_simulated() -> None:
    """test_virtual_added_unit.py has the error of a unit that cannot."""
    assert {*all_units()} == {*simulated_units()}


@pytest.mark.parametrize("name", sorted(simulated_units()))
def test_every_unit_is_a_factory_under_its_name(name: str) -> None:
    assert name in dir(virtual)
    factory = getattr(virtual, name)
    assert isinstance(factory, Factory)
    assert name in repr(factory)
    with factory() as controller:
        assert isinstance(controller, VirtualController)
        assert controller.instrument.unit.name == name
        assert controller.instrument.rows()


def test_units_can_be_imported() -> None:
    from stagewire_virtual import BSC103

    assert isinstance(BSC103, Factory)


@pytest.mark.parametrize("name", ["TDC01", "tdc001", "BSC104"])
def test_an_unknown_unit_suggests_similar_names(name: str) -> None:
    with pytest.raises(
        AttributeError, match=rf"unknown unit {name}; did you mean (TDC001|BSC10)"
    ) as caught:
        getattr(virtual, name)
    assert caught.value.name == name
    assert not hasattr(virtual, "__wrapped__")
    assert not hasattr(virtual, "_private")


def test_a_factory_accepts_all_options_by_keyword() -> None:
    signature = inspect.signature(Factory.__call__)
    short = {field.name for field in dataclasses.fields(Settings)}
    options = {field.name for field in dataclasses.fields(Options)}
    assert set(signature.parameters) == {"self", *short, *options, "clock", "faults"}
    assert all(
        parameter.kind is parameter.KEYWORD_ONLY
        for name, parameter in signature.parameters.items()
        if name != "self"
    )
    given = {
        field.name: signature.parameters[field.name].default
        for field in dataclasses.fields(Options)
    }
    with virtual.TDC001(**given) as told, virtual.TDC001() as untold:
        assert told.instrument.unit is not None
        assert told.instrument.rows() == untold.instrument.rows()


def test_channels_can_have_different_settings() -> None:
    with virtual.BSC103(channels=[Settings(position=1), Settings(position=2)]) as controller:
        assert len(controller.instrument.rows()) >= 3
    with pytest.raises(BadOptionError, match="not both"):
        virtual.TDC001(stage=stages.Z8, channels=[Settings()])


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"line": "rs485"}, r"unknown line type 'rs485' \(choose usb or rs232\)"),
        ({"quirks": ["haste"]}, "no quirk haste"),
        ({"faults": ["to_host explode"]}, "explode"),
        ({"empty_bays": [1]}, "no bay"),
        ({"stage": stages.MLS203}, "the scales of MLS203 on TDC001 are unknown"),
        ({"stage": "Z8"}, r"stage: expected .*stagewire_apt\.stages\.Z8.* not 'Z8'"),
        ({"travel": "1 mm"}, "travel: expected a whole number, not '1 mm'"),
        ({"travel": True}, "travel: expected a whole number, not True"),
        ({"position": 1.5}, "position: expected a whole number, not 1.5"),
        ({"seed": "a"}, "seed: expected a whole number, not 'a'"),
        ({"seed": True}, "seed: expected a whole number, not True"),
        ({"serial_number": "1"}, "serial_number: expected a whole number of eight digits, not '1'"),
        ({"answer_unsupported": 1}, "answer_unsupported: expected True or False, not 1"),
        ({"channels": [{"position": 1}]}, "expected a tuple of Settings, not .*'position': 1"),
        ({"channels": Settings()}, r"channels must be a list; .* write channels=\[Settings"),
        ({"quirks": [1]}, "quirks: expected a set of names"),
        ({"empty_bays": 1}, r"write empty_bays=\[1\]"),
        ({"empty_bays": ["1"]}, "empty_bays: expected a set of whole numbers"),
        ({"strategies": "low"}, "strategies: expected a mapping .* not 'low'"),
        ({"strategies": {"power_on_mode": 1}}, "strategies: expected a mapping"),
        ({"faults": [3]}, "a fault must be a string or a Fault, not 3"),
        # Type checkers accept a string as a list of strings.
        ({"quirks": "long_status"}, r"write quirks=\['long_status'\]"),
        ({"faults": "to_host drop frame"}, r"write faults=\['to_host drop frame'\]"),
    ],
)
def test_making_a_unit_with_an_unsupported_option_raises(
    options: dict[str, object], what: str
) -> None:
    with pytest.raises(VirtualError, match=what):
        virtual.TDC001(**options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "options", [{"line": "usb"}, {"quirks": "long_status"}, {"quirks": ["long_status"]}]
)
def test_options_check_their_types(options: dict[str, Any]) -> None:
    (name,) = options
    with pytest.raises(BadOptionError, match=f"^{name}: expected"):
        Options(**options)


@pytest.mark.parametrize("name", ["travel", "position"])
def test_a_unit_that_moves_nothing_accepts_no_travel(name: str) -> None:
    with pytest.raises(BadOptionError, match="TSC001 moves nothing"):
        virtual.TSC001(**{name: 5})  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["TSC001", "TSG001"])
def test_a_unit_that_moves_nothing_cannot_stick(name: str) -> None:
    make = getattr(virtual, name)
    with (
        make() as controller,
        pytest.raises(UnknownPartError, match=r"no channel 1 that can stick \(none available\)"),
    ):
        controller.instrument.stick("channel 1", True)
    with pytest.raises(FaultError, match="no channel 1 that can stick"):
        make(faults=["stick channel=1"])


@pytest.mark.parametrize("seconds", ["x", None, -1, float("nan"), float("inf")])
def test_an_invalid_time_is_refused(seconds: Any) -> None:
    with virtual.TDC001() as tdc:
        for wait in (tdc.advance, lambda time: tdc.read(timeout=time), tdc.read_frames):
            with pytest.raises(BadValueError, match="seconds"):
                wait(seconds)
        with pytest.raises(BadValueError, match="not 'x' and 0"):
            tdc.read("x")  # type: ignore[arg-type]


def test_a_rack_has_the_given_modules() -> None:
    with virtual.rack("MST601", None, "MPZ601") as rack:
        used = {}
        for bay in range(3):
            rack.write(bytes([0x60, 0, bay, 0, 0x11, 1]))  # RACK_REQ_BAYUSED
            (event,) = rack.read_frames()
            used[bay] = event.raw[3]
        assert used == {0: 1, 1: 2, 2: 1}  # 1 is occupied, 2 is empty
    with pytest.raises(UnknownUnitError, match="MST603"):
        virtual.rack("MST603")
    with pytest.raises(BadOptionError, match="not a module of a rack"):
        virtual.rack("TDC001")


def test_frames_of_modules_are_decoded_with_their_own_status() -> None:
    with virtual.rack(None, "MST601") as rack:
        rack.write(m.MotMoveStop(1, 1).pack(dest=0x22, source=0x01))
        (event,) = rack.read_frames()
        assert event.frame.message == m.MotMoveStoppedStepper(
            1, 0, 0, event.frame.message.status_bits
        )


def test_a_rack_of_modules_accepts_the_options_of_a_unit() -> None:
    options: dict[str, Any] = {"serial_number": 99000007, "answer_unsupported": True}
    with virtual.rack("MST601", None, line="rs232", quirks=["zero_addresses"], **options) as rack:
        rack.write(bytes.fromhex("05 00 00 00 11 01"))  # HW_REQ_INFO
        (event,) = rack.read_frames()
        assert int.from_bytes(event.raw[6:10], "little") == 99000007
        rack.write(bytes.fromhex("60 00 0a 00 11 01"))  # RACK_REQ_BAYUSED of a missing bay
        assert rack.read() == bytes.fromhex("80 00 00 00 00 00")  # HW_RESPONSE
    with pytest.raises(BadOptionError, match="usb or rs232"):
        virtual.rack("MST601", line="rs485")


@pytest.mark.parametrize("bay", [["MST601"], 1, virtual.MST601])
def test_a_bay_must_be_the_name_of_a_module(bay: Any) -> None:
    with pytest.raises(
        BadOptionError, match=r'a bay must be the name .* rack\("MST601", None\), not '
    ):
        virtual.rack("MST601", bay)


def test_a_recorded_session_is_played_back(tmp_path: Path) -> None:
    capture = tmp_path / "bug.txt"
    capture.write_text(
        "# stagewire capture 1 protocol=thorlabs_apt unit=TDC001\n"
        "0.000000 > 05 00 00 00 50 01\n"
        "0.010000 < 91 04 0e 00 81 50 01 00 00 00 00 00 00 00 00 00 00 00 00 80\n"
    )
    with virtual.replay_of(capture) as tdc:
        tdc.write(bytes.fromhex("05 00 00 00 50 01"))
        assert tdc.read() == b""
        assert tdc.read(timeout=1)[:2] == b"\x91\x04"
        assert tdc.clock.now == 10_000_000


def test_the_import_loads_only_the_package() -> None:
    program = (
        "import json, sys, stagewire\n"
        "before = set(sys.modules)\n"
        "import stagewire_virtual\n"
        "print(json.dumps(sorted(set(sys.modules) - before)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert json.loads(done.stdout) == ["stagewire_virtual"]


@pytest.mark.matrix
def test_a_typical_test_passes_strict_type_checking(tmp_path: Path) -> None:
    source = tmp_path / "users.py"
    source.write_text(
        "import stagewire_virtual as virtual\n"
        "from stagewire_apt import stages\n"
        "from stagewire_virtual.pytest_plugin import Controllers\n"
        "with virtual.TDC001(stage=stages.Z8, faults=['to_host drop frame every=2']) as tdc:\n"
        "    count: int = tdc.write(b'')\n"
        "    tdc.advance(2.5)\n"
        "    data: bytes = tdc.read()\n"
        "with virtual.BSC103(channels=[virtual.Settings(position=3)]).tcp() as served:\n"
        "    url: str = served.url\n"
        "def test_x(virtual: Controllers) -> None:\n"
        "    data: bytes = virtual.TDC001(stage=stages.Z8, clock=virtual.SteppedClock()).read()\n"
        "    rack = virtual.rack('MST601', None, channels=[virtual.Settings(position=3)])\n"
        "    url: str = rack.tcp(4001).url\n"
        "virtual.TDC001(stage='Z8')\n"
    )
    done = subprocess.run(  # with the settings of the project, so that its cache is used
        [sys.executable, "-m", "mypy", "--strict", str(source)],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=ROOT,
    )
    errors = [line for line in done.stdout.splitlines() if "error:" in line]
    assert len(errors) == 1, done.stdout + done.stderr
    assert 'incompatible type "str"; expected "Stage | None"' in errors[0]
