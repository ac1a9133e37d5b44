"""Bench files of an IOC: errors name the file, the key and the expected value."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from iocs import bench_of, running

from stagewire_epics.bench import BenchError, read_bench
from stagewire_epics.ioc import Ioc

GOOD = bench_of("virtual://TDC001?stage=Z8")


def error_of(tmp_path: Path, text: str) -> str:
    path = tmp_path / "bench.toml"
    path.write_text(text)
    with pytest.raises(BenchError) as error:
        Ioc(read_bench(path))
    return str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"TDC001"', '"TDC009"', "controllers.t: unknown unit TDC009; did you mean TDC001"),
        ("travel_mm", "travel_inch", "controllers.t: unknown option travel_inch"),
        ('controller = "t"', 'controller = "u"', "x: unknown controller 'u'; expected one of t"),
        ('controller = "t"', 'controller = "t"\nbay = 1', "x: a TDC001 has no bay"),
        ('controller = "t"', "", "motors.x.controller: missing; add this key"),
        ("acceleration_time = 0.5", "acceleration_time = 0", "motors.x.acceleration_time: input"),
        (
            "acceleration_time = 0.5",
            "accel = 0.5",
            "motors.x.accel: unknown key",
        ),
        (
            "acceleration_time = 0.5",
            'parameters = "some"',
            'motors.x.parameters: expected "all", or a list',
        ),
        (
            "acceleration_time = 0.5",
            "limits = [5, 1]",
            "motors.x.limits: expected the lower and the upper limit",
        ),
        ("[motors.x]", '[motors."a b"]', "motors.a b"),
        ("[motors.x]", "[motors.x", "not valid TOML"),
        ("[motors.x]", "[engines.x]", "engines: unknown key"),
    ],
)
def test_a_wrong_key_is_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in GOOD
    message = error_of(tmp_path, GOOD.replace(old, new))
    assert message.startswith(f"{tmp_path}/bench.toml: ") or said.startswith("x: a")
    assert said in message


def test_all_problems_are_reported_together(tmp_path: Path) -> None:
    text = GOOD.replace('controller = "t"', "").replace("0.5", '"fast"')
    assert len(error_of(tmp_path, text).splitlines()) == 2


def test_the_same_part_cannot_be_two_motors(tmp_path: Path) -> None:
    text = GOOD + '[motors.y]\ncontroller = "t"\n'
    assert "y and x are the same part" in error_of(tmp_path, text)


def test_a_controller_without_a_motor_is_refused(tmp_path: Path) -> None:
    text = GOOD + '[controllers.u]\nunit = "TDC001"\nurl = "virtual://TDC001"\n'
    assert "controllers.u has no motor and no part" in error_of(tmp_path, text)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(BenchError, match=r"none\.toml: cannot read the bench: No such file"):
        read_bench(tmp_path / "none.toml")


def test_a_piezo_is_not_a_motor(tmp_path: Path) -> None:
    text = """
[controllers.p]
unit = "TPZ001"
url = "virtual://TPZ001"
[motors.x]
controller = "p"
"""
    assert "x: a TPZ001 is not a motor" in error_of(tmp_path, text)


def test_a_rack_needs_a_bay(tmp_path: Path) -> None:
    text = GOOD.replace('"TDC001"', '"BBD102"')
    assert "x: a BBD102 is not a motor; choose one of its parts by bay =" in error_of(
        tmp_path, text
    )


def test_settings_that_the_controller_lacks_are_named_together(
    caplog: pytest.LogCaptureFixture,
) -> None:
    bench = """
[controllers.k]
unit = "KDC101"
url = "virtual://KDC101"
[motors.x]
controller = "k"
"""

    async def body() -> None:
        async with running(bench, connected=False), asyncio.timeout(5):
            while "velocity = NUMBER" not in caplog.text:
                await asyncio.sleep(0.05)

    asyncio.run(body())
    assert "does not report its velocity and acceleration_time in known units" in caplog.text
    assert "acceleration_time = NUMBER for this motor or stage = NAME" in caplog.text
