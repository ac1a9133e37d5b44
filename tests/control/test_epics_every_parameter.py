"""Every parameter set and status of every unit as records: names, kinds, and what a put sends."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from epics_parameters import Line, all_records, kinds, parts, run, units

from checkout import ROOT
from stagewire._codec.flags import Enumeration
from stagewire._devices.tables import Given
from stagewire.devices import Parameter, ParameterKind, parameter_sets, status_set
from stagewire.errors import BadValueError, LimitError, OutOfRangeError
from stagewire_apt.aio import BBD302, TDC001, TSC001
from stagewire_epics.parameter_fields import kind_of
from stagewire_epics.parameters import ParameterRecords, StatusRecords
from stagewire_epics.records import Kind, Severity
from stagewire_virtual.factory import simulated_units

UNITS = list(units())
SIMULATED = [unit for unit in UNITS if unit.__name__ in simulated_units()]


# Names and kinds


@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: str(unit.__name__))
def test_every_set_of_every_unit_becomes_valid_records(unit: type[Any]) -> None:
    for kind in kinds(unit):
        records = all_records(kind)
        names = [record.name for record in records]
        assert len(set(names)) == len(names)
        for record in records:
            assert re.fullmatch(r"LAB:x(:[A-Z0-9_]+){1,3}", record.name), record.name
            assert len(record.name) <= 60
            assert record.description
            assert bool(record.choices) == (record.kind is Kind.CHOICE)
            assert len(record.choices) <= 16
            assert all(len(text.encode()) < 26 for text in record.choices)
            if record.name != "LAB:x:REFRESH":
                assert record.alarm.severity is Severity.INVALID  # nothing is open yet
        assert all(sets_of(kind))
        expected = {name: writable for one in sets_of(kind) for name, writable in one}
        found = {record.name: record.writable for record in records}
        assert found == {
            **expected,
            **({"LAB:x:REFRESH": True} if "LAB:x:REFRESH" in found else {}),
        }


def sets_of(kind: type[Any]) -> Iterator[list[tuple[str, bool]]]:
    """Yield the name of each record of each set, and whether it can be changed, by the scheme."""
    status = status_set(kind)
    for name, one in parameter_sets(kind).items():
        prefixes = ["STATUS" if status is not None and name == status.name else name]
        for choices in one.arguments.values():
            prefixes = [f"{prefix}:{choice}" for prefix in prefixes for choice in choices]
        bits = [p for p in one.parameters.values() if p.kind is ParameterKind.BITS]
        names = [name for parameter in bits for name in parameter.names]
        yield [
            (f"LAB:x:{f'{prefix}:{field}'.upper()}", parameter.changeable)
            for prefix in prefixes
            for parameter in one.parameters.values()
            for field in (
                (
                    f"{parameter.name}:{name}" if names.count(name) > 1 else name
                    for name in parameter.names
                )
                if parameter in bits
                else (parameter.name,)
            )
        ]


def test_the_scheme_of_the_names() -> None:
    names = {record.name for record in all_records(BBD302.bay_class)}
    assert names >= {
        "LAB:x:VEL_PARAMS:MAX_VELOCITY",
        "LAB:x:TRIGGER:TRIGIN_HIGH",
        "LAB:x:IO_CONFIG:BNC1:MODE",
        "LAB:x:STATUS:HOMED",
        "LAB:x:STATUS:VELOCITY",
        "LAB:x:REFRESH",
    }
    assert not any("CHAN_IDENT" in name or "IO_PORT" in name for name in names)


def test_the_page_states_the_longest_name() -> None:
    names = {record.name for unit in UNITS for kind in kinds(unit) for record in all_records(kind)}
    longest = max(map(len, names)) - len("LAB:x")
    page = (ROOT / "docs" / "how-to" / "epics.md").read_text("utf-8")
    assert f"The longest one in the registry has {longest} after the name of the part." in page


def choice(names: int, length: int = 1, **given: Any) -> Parameter:
    """Return a parameter with so many names, of so many characters."""
    table = Enumeration("Table", {chr(65 + n) * length: n for n in range(names)})  # type: ignore[arg-type]
    argument = Given("mode", "mode", minimum=0, maximum=255, choices=table, **given)  # type: ignore[arg-type]
    return Parameter("mode", ParameterKind.CHOICE, {}, table, argument)  # type: ignore[arg-type]


def test_an_enumeration_that_channel_access_cannot_transfer_is_a_text() -> None:
    assert kind_of(choice(16, 25)) is Kind.CHOICE
    assert kind_of(choice(17, 25)) is Kind.TEXT
    assert kind_of(choice(16, 26)) is Kind.TEXT
    assert kind_of(choice(2, open=True)) is Kind.TEXT
    assert kind_of(choice(2, modifiers=128)) is Kind.TEXT


def test_only_the_sets_that_were_asked_for_are_published() -> None:
    records = ParameterRecords(TDC001, "LAB:x", ("vel_params", "vel_params")).records
    assert [record.name for record in records] == [
        "LAB:x:VEL_PARAMS:MIN_VELOCITY",
        "LAB:x:VEL_PARAMS:ACCELERATION",
        "LAB:x:VEL_PARAMS:MAX_VELOCITY",
        "LAB:x:REFRESH",
    ]
    assert ParameterRecords(TDC001, "LAB:x", ()).records == ()
    with pytest.raises(
        BadValueError, match=r"TDC001 has no parameter set 'speed' \(choose all, or"
    ):
        ParameterRecords(TDC001, "LAB:x", ("speed",))
    with pytest.raises(BadValueError, match="TSC001 reports no status bits"):
        StatusRecords(TSC001, "LAB:x")


def test_a_name_that_is_too_long_is_refused() -> None:
    with pytest.raises(
        BadValueError, match="has 61 characters, and the name of a record may have 60"
    ):
        ParameterRecords(TDC001, "L" * 33, ("vel_params", "home_params"))
    ParameterRecords(TDC001, "L" * 32, ("vel_params", "home_params"))


# Every unit


@pytest.mark.parametrize("unit", SIMULATED, ids=lambda unit: str(unit.__name__))
def test_every_record_of_every_unit_is_read_and_a_put_is_one_change(
    unit: type[Any], tmp_path: Path
) -> None:
    log = tmp_path / "line.txt"

    async def main() -> None:
        async with unit.open(f"virtual://{unit.__name__}", log=log) as device:
            if hasattr(unit, "switch_to_low_level"):
                await device.switch_to_low_level()
            line = Line(log)
            for part in parts(device):
                await check_part(part, line)

    run(main)


async def check_part(part: Any, line: Line) -> None:
    """Read all records of a part, and put the value of each back."""
    records = ParameterRecords(type(part), "LAB:x")
    records.bind(part)
    await records.refresh()
    line.sent()
    for record in records.records:
        assert record.alarm.severity is Severity.NO_ALARM, (record.name, record.alarm.message)
        assert record.checked(record.value) == record.value
        if record.kind is Kind.INTEGER:
            assert record.value in range(-(2**31), 2**31)
    for record in records.records:
        if record.writable and record.name != "LAB:x:REFRESH":
            value = record.value
            try:
                await record.put(value)
                expected = 1
            except (
                LimitError
            ):  # virtual stages hold an acceleration that is above the limit of a real one
                assert "MLS203" in str(part.scales.stage)
                expected = 0
            assert len(line.writes()) == expected, record.name
            assert record.value == value
            assert record.alarm.severity is Severity.NO_ALARM
    await records.lost("the test has ended")
    if status_set(type(part)) is not None and type(part).__name__ not in ("KIM001", "PDXC2"):
        # these two send a shorter status than the KIM101
        status = StatusRecords(type(part), "LAB:x")
        await status.request(part)
        for record in status.records:
            assert record.alarm.severity is Severity.NO_ALARM
            assert not record.writable


def test_a_read_only_number_fits_the_integers_of_channel_access() -> None:
    """Its range is not stated, so no value of its field may be larger."""

    async def check(device: Any) -> int:
        checked = 0
        for part in parts(device):
            for one in parameter_sets(type(part)).values():
                arguments = {name: choices[0] for name, choices in one.arguments.items()}
                values = await getattr(part, one.read)(**arguments)
                for parameter in one.parameters.values():
                    if kind_of(parameter) is Kind.INTEGER and not parameter.changeable:
                        field = vars(one.values)[parameter.name].field
                        with pytest.raises(OutOfRangeError):
                            values.message.replace(**{field: 2**31})
                        checked += 1
        return checked

    async def main() -> None:
        checked = 0
        for unit in SIMULATED:
            async with unit.open(f"virtual://{unit.__name__}") as device:
                if hasattr(unit, "switch_to_low_level"):
                    await device.switch_to_low_level()
                checked += await check(device)
        assert checked > 100

    run(main)
