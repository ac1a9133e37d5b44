"""Generated device classes: every message has a method, and both sides have the same methods."""

from __future__ import annotations

import ast
import importlib
import inspect
import json
import subprocess
import sys
import typing
from collections.abc import Callable
from functools import cache
from itertools import takewhile
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import stagewire_apt
import stagewire_ms2000
from checkout import ROOT
from stagewire import support
from stagewire._devices.tables import Action, Command, ParameterSet, Query
from stagewire.devices import InUnits, Values
from stagewire_apt.devices import tables, values
from stagewire_generator import check, pipeline, render
from stagewire_generator.model import Protocol
from stagewire_generator.output import write
from stagewire_generator.targets.python.devices.arguments import (
    ARGUMENTS,
    METHODS,
    apart,
    unit_words,
)

PACKAGES = (stagewire_apt, stagewire_ms2000)
BASES = [name for name in support.__all__ if f"Async{name}" in support.__all__ and name != "Motion"]


@cache
def registry(package: str) -> Any:
    path = ROOT / "generated/python" / package / "registry.json"
    return json.loads(path.read_text(encoding="utf-8"))


def units() -> list[tuple[str, str]]:
    return [(p.__name__, u["name"]) for p in PACKAGES for u in registry(p.__name__)["units"]]


def methods(cls: type) -> dict[str, Any]:
    """Return the generated methods of a class, which its parts define."""
    parts = [c for c in cls.__mro__ if ".parts." in c.__module__]
    return {name: f for part in parts for name, f in vars(part).items() if inspect.isfunction(f)}


def base_of(cls: type) -> str:
    """Return the name of the class of the runtime from which a generated class is derived."""
    return next(c.__name__ for c in cls.__mro__ if c.__module__.startswith("stagewire._devices"))


def elements(cls: type) -> list[type]:
    """Return a class of a unit and the classes of its bays, channels or axes."""
    names = ("bay_class", "channel_class", "axis_class")
    inner = [getattr(cls, name) for name in names if hasattr(cls, name)]
    return [cls, *(each for one in inner for each in elements(one))]


def tables_of_function(function: Any) -> list[Any]:
    function = inspect.unwrap(function)
    names = takewhile(lambda name: name != "e", function.__code__.co_names)  # then fixed values
    return [getattr(function.__globals__["t"], name) for name in names if name.isupper()]


def tables_of(cls: type) -> list[Any]:
    """Return the tables that the methods of a class use."""
    found: list[Any] = []
    for function in methods(cls).values():
        found += tables_of_function(function)
    return found


def messages_of(table: Any) -> set[str]:
    """Return the messages that a table sends."""
    if isinstance(table, ParameterSet):
        classes = [table.set, table.req]
    elif isinstance(table, Query):
        classes = [table.req]
    else:
        assert isinstance(table, Action | Command)
        classes = [table.message]
    return {cls.layout.message for cls in classes if cls is not None}


@pytest.mark.parametrize(("package", "unit"), units())
def test_every_message_of_a_unit_can_be_sent_by_a_method(package: str, unit: str) -> None:
    data = registry(package)
    known = next(u for u in data["units"] if u["name"] == unit)["messages"]
    asked = {
        m["name"]
        for m in data["messages"]
        if m["name"] in known
        and m["direction"] != "to_host"
        and m["layouts"]
        and not m.get("dummy")
    }
    [family] = [u["family"] for u in data["units"] if u["name"] == unit]
    asked -= data["families"][family].get("classes", {}).get("without", {}).keys()
    cls = getattr(importlib.import_module(package), unit)
    sent = set().union(*(messages_of(t) for each in elements(cls) for t in tables_of(each)))
    assert asked == sent & asked
    # A set may have a message that the unit lacks; then there is no method for it.
    for each in elements(cls):
        for name, function in methods(each).items():
            [table] = tables_of_function(function)
            needed = {
                "_get": lambda t: [t.req, t.get],
                "_set": lambda t: [t.set],
                "_change": lambda t: [t.set, t.req, t.get],
                "_establish": lambda t: [t.set, t.req, t.get],
            }
            if isinstance(table, ParameterSet):
                primitive = inspect.unwrap(function).__code__.co_names[0]
                assert {c.layout.message for c in needed[primitive](table)} <= {*known}, name


@pytest.mark.parametrize(("package", "unit"), units())
def test_asyncio_has_the_same_methods(package: str, unit: str) -> None:
    module = importlib.import_module(package)
    both = elements(getattr(module, unit)), elements(getattr(module.aio, unit))
    for cls, twin in zip(*both, strict=True):
        assert cls.__name__ == twin.__name__
        ours, theirs = methods(cls), methods(twin)
        assert ours.keys() == theirs.keys()
        for name, function in ours.items():
            assert inspect.signature(function) == inspect.signature(theirs[name])
            assert inspect.iscoroutinefunction(theirs[name])
            assert not inspect.iscoroutinefunction(function)
            assert function.__doc__ == theirs[name].__doc__


@pytest.mark.parametrize("package", PACKAGES)
def test_no_method_hides_one_of_the_runtime_or_of_another_part(package: ModuleType) -> None:
    for name in package.devices.__all__:
        cls = getattr(package.devices, name)
        bases = [c for c in cls.__mro__ if c.__module__.startswith("stagewire._devices")]
        taken = {n for c in bases for n in vars(c) if not n.startswith("_")}
        every = [
            n for c in cls.__mro__ if ".parts." in c.__module__ for n in vars(c) if n[0] != "_"
        ]
        assert len(every) == len(set(every))
        assert not taken & set(every)


def test_names_of_the_runtime_are_reserved() -> None:
    for name in (*BASES, *(f"Async{base}" for base in BASES)):
        own = {n for n in dir(getattr(support, name)) if not n.startswith("_")}
        if name.endswith("Stoppable"):
            own.remove("stop")  # only classes without a method of this name have this base
        assert own <= METHODS
    assert {name for name in dir(Values) if not name.startswith("_")} <= ARGUMENTS


@pytest.mark.parametrize("package", PACKAGES)
def test_lazy(package: ModuleType) -> None:
    """Importing the package does not import its device classes, but they are available."""
    name = package.__name__
    program = (
        f"import sys, {name}; assert not any('devices' in m or 'aio' in m for m in sys.modules), 1\n"
        f"from {name} import *\n"
        f"import {name}.aio; assert '{name}.aio.units' not in sys.modules\n"
        f"from {name}.devices import *\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
    with pytest.raises(AttributeError, match="no attribute 'TDC002'"):
        _ = package.TDC002
    with pytest.raises(AttributeError, match="no attribute 'TDC002'"):
        _ = package.aio.TDC002


def test_names_in_units() -> None:
    def names(cls: type[Values[Any]]) -> list[str]:
        return [n for n in cls.names if isinstance(vars(cls)[n], InUnits)]

    assert names(values.VelParams) == [
        "min_velocity_mm_per_s", "min_velocity_deg_per_s",
        "acceleration_mm_per_s2", "acceleration_deg_per_s2",
        "max_velocity_mm_per_s", "max_velocity_deg_per_s",
    ]  # fmt: skip
    assert names(values.JogParams)[:2] == ["step_size_mm", "step_size_deg"]
    assert names(values.HomeParams) == [
        "velocity_mm_per_s", "velocity_deg_per_s", "offset_distance_mm", "offset_distance_deg",
    ]  # fmt: skip
    assert names(values.PmdTrackSettleParams) == [
        "time_us", "settle_window_mm", "settle_window_deg", "track_window_mm", "track_window_deg",
    ]  # fmt: skip
    assert names(values.TpzSlewRates) == ["slew_open_volts_per_ms", "slew_closed_volts_per_ms"]
    assert names(values.PosCounter) == ["mm", "deg"]
    assert names(values.OutputLut) == ["volts", "um"]
    assert names(values.TsgReading) == ["um", "volts", "newtons"]


@pytest.mark.parametrize(
    ("unit", "words"),
    [
        ("mm/s^2", "mm_per_s2"),
        ("V/ms", "volts_per_ms"),
        ("N", "newtons"),
        ("Hz", "hz"),
        ("deg", "deg"),
    ],
)
def test_units_as_words(unit: str, words: str) -> None:
    assert unit_words(unit) == words


def test_names_are_unique() -> None:
    assert apart([["a", "x_a"], ["a", "y_a"], ["b"]], {"b"}, "too") == ["x_a", "y_a", "b_too"]
    assert apart([["a"], ["a"]], (), "too") == ["a", "a_too"]


def test_targets_of_absolute_and_relative_moves() -> None:
    targets = {
        name: (table.target, table.stored and (table.stored.table.name, table.stored.field))
        for name, table in vars(tables).items()
        if isinstance(table, Action)
    }
    assert targets == {
        "STOP": (None, None),
        "STOP_LUT_OUTPUT": (None, None),
        "HOME": (None, None),
        "JOG": ("relative", ("jog_params", "jog_step_size")),
        "MOVE_VELOCITY": (None, None),
        "MOVE_RELATIVE": ("relative", None),
        "MOVE_RELATIVE_STORED": ("relative", ("move_rel_params", "relative_distance")),
        "MOVE_ABSOLUTE": ("absolute", None),
        "MOVE_ABSOLUTE_STORED": ("absolute", ("move_abs_params", "absolute_position")),
        "PZMOT_STOP": (None, None),
        "PZMOT_MOVE_VELOCITY": (None, None),
        "PZMOT_MOVE_RELATIVE": ("relative", None),
        "PZMOT_MOVE_RELATIVE_STORED": ("relative", ("kcube_move_relative_params", "rel_distance")),
        "PZMOT_MOVE_ABSOLUTE": ("absolute", None),
        "PZMOT_MOVE_ABSOLUTE_STORED": ("absolute", ("kcube_move_absolute_params", "abs_distance")),
        "PZMOT_JOG": (
            None,
            None,
        ),  # of a KIM101: its step is a number of a parameter set for each direction
        "MOVE_START": (None, None),
        "STOP_XY_SCAN": (None, None),
        "DISABLE_OUTPUT": (None, None),
    }


# Protocols of users


@pytest.fixture(scope="module")
def others(protocol: Protocol, commands: Protocol, packets: Protocol) -> dict[str, dict[str, str]]:
    return {p.name: render([p], targets=["python"]) for p in (protocol, commands, packets)}


def test_packets_have_no_device_classes(others: dict[str, dict[str, str]]) -> None:
    assert not any("/devices/" in path or "/aio/" in path for path in others["carousel"])
    assert any("/devices/" in path for path in others["tiny"])


@pytest.mark.parametrize("side", ["devices", "aio"])
def test_units_of_user_protocols(
    others: dict[str, dict[str, str]],
    side: str,
    tmp_path: Path,
    imported: Callable[..., ModuleType],
) -> None:
    write(tmp_path, others["tiny"])
    package = imported(tmp_path)
    found = importlib.import_module(f"{package.__name__}.{side}")
    assert found.__all__ == ["TP1", "TP2", "TP9", "TP2Bay"]
    bases = {name: base_of(getattr(found, name)) for name in found.__all__}
    assert bases == {
        "TP1": "SingleChannelDevice", "TP2": "RackDevice", "TP9": "SingleChannelModule", "TP2Bay": "Bay",
    }  # fmt: skip
    assert {*methods(found.TP1)} == {
        "go", "go_stored", "start_go", "start_go_stored", "alive", "echo",
    }  # fmt: skip
    assert {*methods(found.TP2)} == {"echo"}
    echo = inspect.signature(found.TP1.echo)
    assert str(echo.parameters["load"]) == "load: 'int | None' = None"
    assert echo.parameters["percent"].kind is inspect.Parameter.KEYWORD_ONLY
    assert typing.get_args(found.TP2.__orig_bases__[0]) == (found.TP2Bay,)


def test_names_that_are_taken(
    spec: Path,
    tmp_path: Path,
    imported: Callable[..., ModuleType],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Names that the runtime or Python use get a suffix."""
    monkeypatch.setattr(
        pipeline, "check_errata", lambda *_: None
    )  # the names are not those printed
    path = spec / "tiny/messages/core.yaml"
    text = path.read_text(encoding="utf-8").replace("call: {name: go}", "call: {name: open}")
    text = text.replace("label: {format", "timeout: {format").replace("blob: {", "names: {")
    path.write_text(text, encoding="utf-8")
    write(tmp_path / "out", render(check(spec), targets=["python"]))
    package = imported(tmp_path / "out")
    assert {*methods(package.TP1)} >= {"pos_open", "start_pos_open"}
    assert [*inspect.signature(package.TP1.echo).parameters] == [
        "self", "timeout_value", "names_value", "load", "percent", "timeout",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("package", "opened", "modifiers"),
    [
        (
            "stagewire_apt",
            {
                "bbd30x_status_bits", "bnt_status_bits", "bpc_status_bits", "channel", "dc_status_bits",
                "hardware_type", "home_direction", "home_limit_switch", "kbd101_status_bits",
                "kdc101_status_bits", "kld101_status_bits", "kls101_status_bits", "kls_status_bits",
                "knob_mode", "la_status_bits", "laser_trigger_mode", "m30x_status_bits",
                "nanotrak_state", "nanotrak_status_bits", "notch_filter_state",
                "output_max_volts_flags", "pdxc2_status_bits", "ppc_feedback_source",
                "quad_status_bits", "rack_status_bits", "stage_axis", "stepper_status_bits",
                "synchronized_trigger", "tbd001_status_bits", "tec_status_bits", "kpc_status_bits",
                "ppc_status_bits", "strain_gauge_status_bits", "tia_range_steps",
                "tld001_status_bits", "tpz_status_bits", "trigger_output_mode", "trigger_port_mode",
            },
            {
                "flipper_signal_mode": ["INVERTED_INPUT", "INVERTED_OUTPUT"],
                "hard_limit": ["SWAPPED"], "software_limit_mode": ["ROTATION_STAGE"],
            },
        ),
        ("stagewire_ms2000", {"axis"}, {}),
    ],
)  # fmt: skip
def test_some_lists_of_names_may_be_incomplete(
    package: str, opened: set[str], modifiers: dict[str, list[str]]
) -> None:
    """This is decided table by table. All others are complete: device classes send only listed values."""
    enumerations, flags = registry(package)["enumerations"], registry(package)["flags"]
    both = enumerations | flags
    assert {name for name, table in both.items() if table.get("open")} == opened
    found = {
        name: [value for value, entry in table["values"].items() if entry.get("modifier")]
        for name, table in enumerations.items()
    }
    assert {name: values for name, values in found.items() if values} == modifiers


def test_a_unit_that_is_a_keyword_is_joined_to_its_field(spec: Path) -> None:
    path = spec / "tiny" / "quantities.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("DISTANCE: {unit: mm,", "DISTANCE: {unit: in,"), encoding="utf-8")
    files = render(check(spec), ["python"])
    module = files["python/stagewire_tiny/devices/values/core.py"]
    ast.parse(module)
    assert '_in = InUnits("encoder_count", "reading", "in")' in module


@pytest.mark.parametrize(
    "words", ["Fraction ByCase", 'it\'s a \\"Fraction\\" by e. t. quantities.']
)
def test_words_of_a_title_are_not_imported(spec: Path, words: str) -> None:
    path = spec / "tiny" / "units.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("title: Tiny positioner", f'title: "{words}"'), encoding="utf-8")
    module = ast.parse(render(check(spec), ["python"])["python/stagewire_tiny/devices/facts.py"])
    imports = [node for node in ast.walk(module) if isinstance(node, ast.ImportFrom)]
    names = {alias.asname or alias.name for node in imports for alias in node.names}
    used = {node.id for node in ast.walk(module) if isinstance(node, ast.Name)}
    assert names <= used
