"""Parameter sets by name: what the registry states about each, as plain values."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from inspect import signature
from types import ModuleType
from typing import Any

import pytest

import stagewire_apt.aio
import stagewire_apt.devices
import stagewire_ms2000.aio
import stagewire_ms2000.devices
from stagewire.devices import (
    COUNTS,
    InUnits,
    ParameterKind,
    SetOfParameters,
    parameter_sets,
    status_set,
)
from stagewire.errors import BadValueError
from stagewire.quantities import Scale, Stage
from stagewire_apt.devices import BBD302, BPC201, KDC101, KSC101, KST101, TDC001, TPZ001, TSC001
from stagewire_apt.devices.values import PzmotStatusUpdate
from stagewire_ms2000.devices import MS2000

PACKAGES = (
    stagewire_apt.aio,
    stagewire_apt.devices,
    stagewire_ms2000.aio,
    stagewire_ms2000.devices,
)


def parts(package: ModuleType) -> Iterator[type[Any]]:
    """Yield the classes of all devices of a package, and of their bays, channels and axes."""

    def inside(kind: type[Any]) -> Iterator[type[Any]]:
        yield kind
        for name in ("bay_class", "channel_class", "axis_class"):
            if hasattr(kind, name):
                yield from inside(getattr(kind, name))

    for name in package.__all__:
        if hasattr(getattr(package, name), "unit"):
            yield from inside(getattr(package, name))


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: str(package.__name__))
def test_every_value_of_a_set_is_a_parameter_and_its_calls_accept_it(package: ModuleType) -> None:
    checked = 0
    for kind in parts(package):
        for one in parameter_sets(kind).values():
            check_parameters(kind, one)
            checked += 1
    assert checked > 15


def check_parameters(kind: type[Any], one: SetOfParameters) -> None:
    """Compare a set with its values and its methods."""
    single = {name for name in one.values.names if not isinstance(vars(one.values)[name], InUnits)}
    if one.values is PzmotStatusUpdate:  # the short form is that of other units
        single -= {"position", "status_bits"}
    assert len(single - {"chan_ident"} - one.parameters.keys()) == len(one.arguments)
    requested = set(signature(getattr(kind, one.read)).parameters) - {"self", "timeout"}
    assert requested == one.arguments.keys()
    accepted = set(signature(getattr(kind, one.change)).parameters) if one.change else set()
    assert accepted >= one.arguments.keys() or not one.change
    for parameter in one.parameters.values():
        if parameter.changeable:
            assert {parameter.name, *parameter.scaled} <= accepted
        else:
            assert one.change is None
        has_names = parameter.kind in (ParameterKind.CHOICE, ParameterKind.BITS)
        assert bool(parameter.names) == has_names


def test_numbers_have_the_unit_and_the_limits_of_their_scale() -> None:
    stage = Stage.of_user("mine", position=Scale(Fraction(1000), "mm"))
    with TDC001.open("virtual://TDC001?stage=Z8", stage=stage) as tdc:
        position = parameter_sets(TDC001)["pos_counter"].parameters["position"]
        velocity = parameter_sets(TDC001)["vel_params"].parameters["max_velocity"]
        assert position.now(tdc.scales) == ("mm", "mm")
        assert position.precision(tdc.scales) == 3
        assert position.limits(tdc.scales) == (-(2**31) / 1000, (2**31 - 1) / 1000)
        assert position.plain(tdc.get_pos_counter()) == 0.0
        assert position.keyword(1.5, tdc.scales) == {"mm": 1.5}
        assert velocity.now(tdc.scales) == ("max_velocity", COUNTS)
        assert velocity.precision(tdc.scales) == 0
        assert velocity.limits(tdc.scales) == (0, 2**32 - 1)
        assert velocity.keyword(1000.4, tdc.scales) == {"max_velocity": 1000}


def test_limits_are_those_of_the_controller() -> None:
    for unit, ends in ((TSC001, (400, 40_000_000)), (KSC101, (100, 10_000_000))):
        on_time = parameter_sets(unit)["sol_cycle_params"].parameters["on_time"]
        with unit.open(f"virtual://{unit.__name__}") as device:
            low, high = on_time.limits(device.scales) or (0, 0)
            _, shown = on_time.now(device.scales)
            per = (
                1
                if shown == COUNTS
                else device.scales.of(
                    on_time.scaled[on_time.now(device.scales)[0]].quantity, shown
                ).counts_per_unit
            )
        assert (low * per, high * per) == ends


def test_choices_and_bits_are_names() -> None:
    sets = parameter_sets(TDC001)
    switch = sets["lim_switch_params"].parameters["cw_hard_limit"]
    assert not switch.closed  # values can be combined with SWAPPED
    assert switch.keyword("MAKES|SWAPPED", None) == {"cw_hard_limit": "MAKES|SWAPPED"}  # type: ignore[arg-type]
    assert switch.keyword("7", None) == {"cw_hard_limit": 7}  # type: ignore[arg-type]
    with TDC001.open("virtual://TDC001") as tdc:
        tdc.change_lim_switch_params(cw_hard_limit="MAKES|SWAPPED")
        assert switch.plain(tdc.get_lim_switch_params()) == "MAKES|SWAPPED"
        tdc.change_lim_switch_params(cw_hard_limit="MAKES")
        assert switch.plain(tdc.get_lim_switch_params()) == "MAKES"
        status = status_set(TDC001)
        assert status is not None
        assert "homed" not in status.parameters["status_bits"].plain(tdc.get_dc_status_update())
    mode = parameter_sets(TPZ001)["pos_control_mode"].parameters["mode"]
    assert mode.closed
    assert mode.names == ("OPEN_LOOP", "CLOSED_LOOP", "OPEN_LOOP_SMOOTH", "CLOSED_LOOP_SMOOTH")


def test_bits_have_the_names_of_the_unit() -> None:
    bits = parameter_sets(BBD302.bay_class)["dc_status_update"].parameters["status_bits"]
    assert "initializing" in bits.names
    other = parameter_sets(KDC101)["dc_status_update"].parameters["status_bits"]
    assert "initializing" not in other.names


def test_texts_and_bytes_are_plain() -> None:
    sets = parameter_sets(TDC001)["info"].parameters
    with TDC001.open("virtual://TDC001") as tdc:
        info = tdc.get_info()
        assert sets["model_number"].plain(info) == "TDC001"
        assert sets["software_version"].plain(info) == bytes(info.software_version).hex()


def test_a_set_states_the_arguments_of_its_request() -> None:
    assert parameter_sets(BBD302.bay_class)["io_config"].arguments == {
        "io_port": ("BNC1", "BNC2", "BNC3")
    }
    assert parameter_sets(BBD302)["bay_used"].arguments == {"bay_ident": ("BAY_1", "BAY_2")}
    assert parameter_sets(BPC201)["bay_used"].arguments == {"bay_ident": ("BAY_1",)}
    assert parameter_sets(TDC001)["bay_used"].arguments == {}


def test_the_status_is_the_one_with_the_position() -> None:
    for kind, name in (
        (TDC001, "dc_status_update"),
        (MS2000.axis_class, "motor_position_and_status"),
        (BPC201, "pz_status_bits"),
        (KST101, "status_update"),
    ):
        status = status_set(kind)
        assert status is not None
        assert status.name == name
    assert status_set(TSC001) is None


def test_a_class_of_your_own_is_the_same_part() -> None:
    class Mine(TDC001):
        """A device of a user."""

    assert parameter_sets(Mine).keys() == parameter_sets(TDC001).keys()


@pytest.mark.parametrize("kind", [int, "TDC001", stagewire_apt.devices.BBD302.__base__])
def test_other_classes_are_refused(kind: Any) -> None:
    with pytest.raises(BadValueError, match=r"such as TDC001|belongs to no controller"):
        parameter_sets(kind)
