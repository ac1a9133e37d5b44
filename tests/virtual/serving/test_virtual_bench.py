"""Benches: valid files, and the errors for invalid ones."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path
from typing import Any

import pytest
from echo_instrument import Notebook
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire import Stage
from stagewire_apt import stages
from stagewire_virtual.bench import load_bench, make_bench
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.errors import BenchError, VirtualError
from stagewire_virtual.faults.fault import parse_fault
from stagewire_virtual.instrument import all_units
from stagewire_virtual.options import LinkKind, Options, Settings
from stagewire_virtual.serving.endpoints import PtyEndpoint, TcpEndpoint
from stagewire_virtual.serving.server import Server
from stagewire_virtual.serving.tcp import TcpLink

FULL = """
[[unit]]
name = "tdc001"
label = "x stage"
tcp = "127.0.0.1:4001"
seed = 7
serial_number = 83000001
line = "rs232"
quirks = ["header_only_completion"]
answer_unsupported = true
faults = ["to_host drop frame every=10"]
stage = "Z8"
position = 34304

[[unit]]
name = "BSC102"
pty = "build/y-stage"
empty_bays = [2]
[[unit.channel]]
stage = "APT_STEPPER"
travel = 857600
position = 10

[[unit]]
name = "RACK"
pty = true
bays = ["MST601", "", "MPZ601"]

[[unit]]
name = "MS2000"
tcp = "0"
strategies = { power_on_mode = "low" }
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "bench.toml"
    path.write_text(text, encoding="utf-8")
    return path


def problems(**unit: Any) -> tuple[str, ...]:
    with pytest.raises(BenchError) as caught:
        make_bench([unit], source="here")
    return caught.value.problems


def test_a_file_can_set_every_option(tmp_path: Path) -> None:
    first, second, rack, last = load_bench(written(tmp_path, FULL)).units
    blueprint = first.blueprint
    assert blueprint.unit is not None
    assert (first.label, blueprint.unit.name, first.place) == (
        "x stage",
        "TDC001",
        TcpEndpoint(4001),
    )
    assert blueprint.faults == (parse_fault("to_host drop frame every=10"),)
    assert blueprint.options == Options(
        seed=7,
        serial_number=83000001,
        line=LinkKind.RS232,
        quirks=frozenset({"header_only_completion"}),
        answer_unsupported=True,
        channels=(Settings(stage=stages.Z8, position=34304),),
    )
    assert second.label == "BSC102"
    assert second.place == PtyEndpoint(Path("build/y-stage"))
    assert second.blueprint.options == Options(
        seed=1,  # its position in the bench, so that units of a kind get different serial numbers
        empty_bays=frozenset({2}),
        channels=(Settings(stage=stages.APT_STEPPER, travel=857600, position=10),),
    )
    assert rack.blueprint.unit is None
    assert [module and module.name for module in rack.blueprint.bays] == ["MST601", None, "MPZ601"]
    assert rack.place == PtyEndpoint()
    assert last.place == TcpEndpoint(0)
    assert last.blueprint.options.strategies == {"power_on_mode": "low"}
    for unit in (first, second, rack, last):
        unit.blueprint.make(SteppedClock())


def test_ports_may_be_numbers_and_stage_names_in_any_case() -> None:
    (unit,) = make_bench([{"name": "TDC001", "tcp": 4001, "stage": "z8"}]).units
    assert unit.place == TcpEndpoint(4001)
    assert unit.blueprint.options.channels == (Settings(stage=stages.Z8),)


def test_problems_use_the_given_names_of_keys() -> None:
    with pytest.raises(
        BenchError, match=r"unit 1 \(TDC001\), <travel>, <position>: .*cannot start"
    ):
        make_bench([{"name": "TDC001", "travel": 9, "position": 10}], called="<{}>".format)


def test_only_the_name_of_a_unit_is_required() -> None:
    (unit,) = make_bench([{"name": "TPZ001"}]).units
    assert (unit.place, unit.label, unit.blueprint.options) == (TcpEndpoint(0), "TPZ001", Options())


KNOWN_UNITS = ", ".join(sorted({*all_units(), "RACK"}))
ON_A_TDC001 = sorted(
    stage.name
    for stage in vars(stages).values()
    if isinstance(stage, Stage)
    and "TDC001" in {n for names in stage.controllers.values() for n in names}
)


@pytest.mark.parametrize(
    ("unit", "where", "what"),
    [
        ({}, "unit 1, key name", "missing; give a unit such as TDC001, or RACK"),
        ({"name": "TDC01"}, "unit 1 (TDC01), key name", "did you mean TDC001"),
        ({"name": 3}, "unit 1, key name", "expected a string, not 3"),
        (
            {"name": "TDC001", "label": ["x"]},
            "unit 1 (TDC001), key label",
            "expected a string, not a list",
        ),
        (
            {"name": "TDC001", "colour": 1},
            "unit 1 (TDC001), key colour",
            "unknown key; known keys: name, stage, travel",
        ),
        ({"name": "TDC001", "sede": 1}, "unit 1 (TDC001), key sede", "did you mean seed?"),
        ({"name": "TDC001", "seed": True}, "unit 1 (TDC001), key seed", "an integer, not True"),
        ({"name": "TDC001", "seed": 1.5}, "unit 1 (TDC001), key seed", "an integer, not 1.5"),
        ({"name": "TDC001", "line": "rs485"}, "unit 1 (TDC001), key line", "choose usb or rs232"),
        (
            {"name": "TDC001", "stage": "z91"},
            "unit 1 (TDC001), key stage",
            f"has no stage z91; did you mean Z912? (available on TDC001: {', '.join(ON_A_TDC001)})",
        ),
        (
            {"name": "TDC001", "stage": "rubber"},
            "key stage",
            f"no stage rubber (available on TDC001: {ON_A_TDC001[0]}",
        ),
        ({"name": "TSC001", "travel": 5}, "key travel", "moves nothing"),
        ({"name": "TSG001", "faults": ["stick channel=1"]}, "key faults", "that can stick"),
        ({"name": "TDC001", "stage": "MLS203"}, "key stage", "unknown (known on: BBD101"),
        ({"name": "MS2000", "stage": "Z8"}, "key stage", "has no stage Z8 (none available)"),
        ({"name": "TDC001", "travel": "1 mm"}, "key travel", "an integer, not '1 mm'"),
        ({"name": "TDC001", "quirks": ["haste"]}, "key quirks", "no quirk haste (available:"),
        ({"name": "TDC001", "quirks": "haste"}, "key quirks", "expected a list, not 'haste'"),
        ({"name": "TDC001", "empty_bays": [1]}, "key empty_bays", "it has no bays"),
        ({"name": "MS2000", "strategies": {"mood": "low"}}, "key strategies", "mood"),
        ({"name": "TDC001", "strategies": 3}, "key strategies", "expected a table, not 3"),
        ({"name": "TDC001", "faults": ["to_host explode"]}, "key faults", "explode"),
        ({"name": "TDC001", "faults": ["to_host stick axis=9"]}, "key faults", ""),
        ({"name": "TDC001", "tcp": "here"}, "key tcp", "not a TCP address"),
        ({"name": "TDC001", "tcp": 65536}, "key tcp", "'65536' is not a TCP address"),
        ({"name": "TDC001", "tcp": True}, "key tcp", "'True' is not a TCP address"),
        ({"name": "TDC001", "tcp": "0.0.0.0:4001"}, "key tcp", "--bind 0.0.0.0"),
        ({"name": "TDC001", "tcp": "4001", "pty": True}, "key pty", "give tcp or pty, not both"),
        ({"name": "TDC001", "pty": 3}, "key pty", "expected true, or the name of a symbolic link"),
        ({"name": "TDC001", "channel": [{}, {}]}, "key channel", "settings for 2"),
        ({"name": "TDC001", "channel": [3]}, "key channel", "expected a table, not 3"),
        (
            {"name": "TDC001", "channel": [{"stag": "Z8"}]},
            "channel 1, key stag",
            "did you mean stage?",
        ),
        ({"name": "TDC001", "travel": 3, "channel": [{}]}, "key channel", "not both"),
        ({"name": "TDC001", "bays": ["MST601"]}, "key bays", '(name = "RACK") has named bays'),
        ({"name": "RAK"}, "key name", "did you mean RACK? (known units: BBD101"),
        ({"name": "TDC01"}, "key name", f"(known units: {KNOWN_UNITS})"),
        ({"name": "TDC001", "travel": 0}, "key travel", "requires a travel"),
        (
            {"name": "TDC001", "travel": 9, "position": 10},
            "key travel, key position",
            "cannot start at 10 within a travel of 9",
        ),
        ({"name": "MS2000", "answer_unsupported": True}, "key answer_unsupported", "never answers"),
        # each is valid, but not both
        (
            {"name": "BSC103", "empty_bays": [2, 3], "channel": [{}, {}]},
            "key channel",
            "settings for 2 channels were given, but BSC103 has 1",
        ),
        ({"name": "RACK"}, "(RACK), key bays", "missing; list the modules"),
        (
            {"name": "RACK", "bays": ["MST603"], "channel": [{}]},
            "(RACK), key bays",
            "did you mean MST602 or MST601",
        ),
        (
            {"name": "RACK", "bays": ["TDC001"]},
            "(RACK), key bays",
            "is not a module of a rack (modules: MNA601, MPZ601, MST601, MST602)",
        ),
    ],
)
def test_a_problem_names_its_key_and_the_expected_value(
    unit: dict[str, Any], where: str, what: str
) -> None:
    (problem,) = problems(**unit)
    assert problem.startswith("here: unit 1")
    assert where in problem
    assert what in problem


def test_all_problems_are_reported_together() -> None:
    with pytest.raises(BenchError) as caught:
        make_bench(
            [
                {"name": "TDC001", "tcp": "4001", "quirks": ["haste"], "channel": [{}, {}]},
                {"name": "TDC002", "tcp": "4001", "seed": "x"},
                {"name": "TSC001", "pty": "y", "faults": ["nonsense", "to_host explode"]},
                {"name": "TSC001", "pty": "y", "label": 3},
            ],
            source="bench.toml",
        )
    keys = [problem.partition(", key ")[2].split(":")[0] for problem in caught.value.problems]
    assert sorted(keys[:2]) == ["channel", "quirks"]
    assert keys[2:] == ["name", "seed", "faults", "label", "pty"]
    assert all(word in caught.value.problems[4] for word in ("nonsense", "explode"))
    assert str(caught.value).splitlines() == list(caught.value.problems)


@pytest.mark.parametrize("key", ["tcp", "pty"])
def test_two_units_at_the_same_endpoint_are_refused(key: str) -> None:
    spot = {"tcp": "4001", "pty": "build/x"}[key]
    units = [{"name": "TDC001", key: spot}, {"name": "TSC001"}, {"name": "BSC101", key: spot}]
    with pytest.raises(
        BenchError, match=rf"unit 3 \(BSC101\), key {key}: .*already taken; see .*unit 1"
    ):
        make_bench(units)


def test_several_units_can_use_free_ports() -> None:
    assert len(make_bench([{"name": "TDC001", "tcp": "0"}, {"name": "TDC001"}]).units) == 2
    both = [{"name": "TDC001", "tcp": f"{host}:4001"} for host in ("127.0.0.1", "[::1]")]
    assert len(make_bench(both).units) == 2


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "key unit: missing; each unit begins with a line [[unit]]"),
        ("unit = 3", "key unit: expected a list, not 3"),
        ("[unit]\nname = 'TDC001'", "key unit: expected a list: each begins with a line [[unit]]"),
        ("[[unit]]\nname = 'TDC001'\n[unit.channel]", "begins with a line [[unit.channel]]"),
        ("name = 'TDC001'", "key name: unknown key; known keys: unit"),
        ("[[unit]\n", "not a valid TOML file: "),
        ("[[unit]]\nseed = 1\nseed = 2", "Cannot overwrite a value"),
        ("a = " + "[" * 100_000, "nested too deeply"),
    ],
)
def test_an_invalid_bench_file_is_refused(tmp_path: Path, text: str, what: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(BenchError) as caught:
        load_bench(path)
    assert what in str(caught.value)
    assert str(caught.value).startswith(f"{path}")


def test_an_unreadable_bench_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BenchError, match="cannot be read: No such file"):
        load_bench(tmp_path / "bench.toml")
    with pytest.raises(BenchError, match="cannot be read: Is a directory"):
        load_bench(tmp_path)
    (tmp_path / "bench.toml").write_bytes(b"\xff")
    with pytest.raises(BenchError, match=r"not a valid TOML file: .*utf-8"):
        load_bench(tmp_path / "bench.toml")


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=6,
)
KEYS = st.sampled_from(
    [
        *(
            "name",
            "label",
            "tcp",
            "pty",
            "seed",
            "model",
            "serial_number",
            "hardware_type",
            "stage_id",
            "line",
            "quirks",
            "bays",
            "faults",
        ),
        *(
            "answer_unsupported",
            "empty_bays",
            "strategies",
            "stage",
            "travel",
            "position",
            "channel",
        ),
    ]
)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(["TDC001", "RACK", "MS2000"]), st.dictionaries(KEYS, values, max_size=5))
def test_any_table_is_a_bench_or_a_list_of_problems(name: str, unit: dict[str, Any]) -> None:
    with contextlib.suppress(BenchError):
        assert len(make_bench([{"name": name, **unit}]).units) == 1


def test_the_units_of_a_bench_can_be_served() -> None:
    async def test() -> None:
        book = Notebook()
        (unit,) = make_bench([{"name": "TDC001", "seed": 1}]).units
        async with Server() as server:
            link = unit.link(server.clock, book)
            await server.open(link)
            assert isinstance(link, TcpLink)
            reader, writer = await asyncio.open_connection(link.host, link.port)
            writer.write(bytes.fromhex("05 00 00 00 50 01"))
            assert len(await reader.readexactly(90)) == 90
            writer.close()
        assert [kind for kind, _, _ in book.lines] == ["#", ">", "<"]

    asyncio.run(asyncio.wait_for(test(), 20))


def test_bench_error_is_a_virtual_error() -> None:
    assert issubclass(BenchError, VirtualError)


def test_a_stage_may_have_its_name_in_the_catalogue() -> None:
    for stage in (stages.MLS203_X, stages.MLS203_Y):
        object.__setattr__(stage, "catalogue", ("MLS203/M",))
    object.__setattr__(stages.Z8, "catalogue", ("Z8/M",))
    try:
        (unit,) = make_bench([{"name": "TDC001", "stage": "z8/m"}]).units
        assert unit.blueprint.options.channels == (Settings(stage=stages.Z8),)
        [problem] = problems(name="BBD102", stage="MLS203/M")
        assert "catalogue name of several stages; choose MLS203_X, MLS203_Y" in problem
    finally:
        for stage in (stages.MLS203_X, stages.MLS203_Y, stages.Z8):
            object.__setattr__(stage, "catalogue", ())
