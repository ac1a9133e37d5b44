"""Real numbers (IEEE 754): bit patterns in messages, numbers in device classes."""

from __future__ import annotations

import importlib
import math
import struct
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from stagewire._devices import reals
from stagewire._devices.arguments import fields_of
from stagewire._devices.scales import Scales
from stagewire.devices import parameter_sets
from stagewire.errors import BadValueError, OutOfRangeError
from stagewire_apt.devices import KPA101
from stagewire_apt.devices.values import LoopParams2
from stagewire_apt.messages import QuadGetLoopParams2
from stagewire_generator.model import Protocol
from stagewire_generator.real import number_of, pattern_of

SCALES = Scales("LS1", {})


@pytest.fixture
def devices(laser: Any) -> Any:
    """The device classes of the package."""
    return importlib.import_module("stagewire_laser.devices")


def fields(laser: Any, **given: object) -> dict[str, int]:
    """Return the fields of a change of the gains."""
    tables = importlib.import_module("stagewire_laser.devices.tables")
    gains = laser.messages.LaserSetGains
    return fields_of("change_gains", tables.GAINS.given, given, SCALES, of=gains, some=True)


def test_a_range_of_numbers_is_a_range_of_patterns(layouts: Protocol) -> None:
    message = next(m for m in layouts.messages if m.name == "LASER_SET_GAINS")
    gain, offset, bandwidth = message.layouts[0].fields
    assert (gain.minimum, gain.maximum) == (0x3DCCCCCD, 0x42C80000)
    assert (offset.minimum, offset.maximum) == (0, 0xFFFFFFFF)
    assert (bandwidth.minimum, bandwidth.maximum) == (0, 0x40C3880000000000)


def test_messages_carry_patterns(laser: Any) -> None:
    message = laser.messages.LaserSetGains(0x3F800000, 0xBF800000, 0x40C3880000000000)
    data = message.pack(0x50, 0x01)[6:]
    assert struct.unpack("<ffd", data) == (1.0, -1.0, 10000.0)


@pytest.mark.parametrize("gain", [0x3DCCCCCC, 0x42C80001, 0xBF800000])
def test_messages_refuse_patterns_beyond_the_range(laser: Any, gain: int) -> None:
    with pytest.raises(OutOfRangeError):
        laser.messages.LaserSetGains(gain, 0, 0)


def test_device_classes_take_numbers(laser: Any) -> None:
    assert fields(laser, gain=65.7, offset="-0.5", bandwidth=500) == {
        "gain": 0x42836666,
        "offset": 0xBF000000,
        "bandwidth": 0x407F400000000000,
    }


@pytest.mark.parametrize("gain", [0.1, "0.1", 100, 100.0])
def test_the_ends_of_the_range_are_accepted(laser: Any, gain: object) -> None:
    assert fields(laser, gain=gain)["gain"] in (0x3DCCCCCD, 0x42C80000)


@pytest.mark.parametrize("gain", [0, -1, 0.09, 100.1, 1e39, -1e39])
def test_device_classes_refuse_numbers_beyond_the_range(laser: Any, gain: float) -> None:
    with pytest.raises(OutOfRangeError, match=r"change_gains: gain must be 0\.1 to 100, not "):
        fields(laser, gain=gain)


def test_a_number_must_fit_its_size(laser: Any) -> None:
    with pytest.raises(OutOfRangeError, match=r"offset must be a number of 4 bytes, not 1e\+39"):
        fields(laser, offset=1e39)


@pytest.mark.parametrize("gain", [math.nan, math.inf, "fast", True, None.__class__])
def test_device_classes_refuse_everything_else(laser: Any, gain: object) -> None:
    with pytest.raises(BadValueError, match="gain must be a number"):
        fields(laser, gain=gain)


def test_zero_has_no_sign(laser: Any) -> None:
    assert fields(laser, bandwidth=-0.0) == {"bandwidth": 0}


def test_values_are_numbers(laser: Any, devices: Any) -> None:
    message = laser.messages.LaserGetGains(0x42836666, 0x7FC00000, 0x407F400000000000)
    values = devices.values.Gains(message, SCALES)
    assert (values.gain, values.bandwidth) == (65.7, 500.0)
    assert math.isnan(values.offset)
    assert values.asdict()["gain"] == 65.7


def test_programs_that_offer_all_parameters_get_numbers() -> None:
    scales = Scales("KPA101", {})
    parameter = parameter_sets(KPA101)["loop_params_2"].parameters["filter_q"]
    assert parameter.limits(scales) == (0.1, 100.0)
    assert parameter.precision(scales) > 0
    message = QuadGetLoopParams2(0, 0, 0, 0, 0, 0x40A00000, 1, 1)
    assert parameter.plain(LoopParams2(message, scales)) == 5.0
    assert parameter.keyword(0.25, scales) == {"filter_q": 0.25}


def test_docstrings_state_numbers(laser: Any, devices: Any) -> None:
    assert "from 0.1 to 100 (0x3dcccccd to 0x42c80000)" in laser.messages.LaserSetGains.__doc__
    assert ":param gain: from 0.1 to 100." in devices.LS1.set_gains.__doc__


@given(st.integers(0, 0xFFFFFFFF))
@example(0x7F7FFFFF)
@example(0x00000001)
@example(0x80000000)
def test_every_pattern_has_a_number(pattern: int) -> None:
    number = reals.number_of(pattern, 4)
    assert math.isnan(number) or reals.pattern_of(number, 4) == pattern


@given(st.floats(0, 2.0**127, width=32))
def test_the_generator_and_the_runtime_agree(number: float) -> None:
    pattern = reals.pattern_of(number, 4)
    assert float(number_of(pattern, 4)) == reals.number_of(pattern, 4)
    assert pattern_of(repr(number), 4) == pattern
