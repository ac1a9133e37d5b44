"""With the package of Issue 3 alone: controllers newer than the document, their scales, and errors.

``test_issue_3_alone.py`` runs these tests in a process with that package.
"""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire import Scale, Stage
from stagewire.discovery import by_serial_number, device_class
from stagewire.errors import BadValueError, UnknownScaleError, UnsupportedError, WrongUnitError
from stagewire_apt import (
    BBD102,
    BPC301,
    BSC101,
    BSC102,
    BSC103,
    MST601,
    PROTOCOL,
    TDC001,
    TST001,
    aio,
)
from stagewire_apt import messages as m
from stagewire_virtual.controller import VirtualController

UNITS: dict[str, type[Any]] = {
    cls.unit.name: cls for cls in (BBD102, BPC301, BSC101, BSC102, BSC103, MST601, TDC001, TST001)
}


def line_of(unit: str, number: int, model: str | bytes) -> RecordingLink:
    """Return a line to a controller that reports a serial number and a model."""
    kind = UNITS[unit].unit.kind
    controller: VirtualController = (
        virtual.rack(unit) if kind == "bay" else getattr(virtual, unit)()
    )
    line = RecordingLink(controller)
    text = model.encode() if isinstance(model, str) else model
    info = m.HwGetInfo.layout.id.to_bytes(2, "little")

    def twist(data: bytes) -> bytes:
        if not data.startswith(info):
            return data
        return data[:6] + number.to_bytes(4, "little") + text.ljust(8, b"\0") + data[18:]

    line.twist = twist
    return line


def opened(unit: str, number: int, reported: str | bytes = "", **options: Any) -> Any:
    return UNITS[unit].open(line_of(unit, number, reported), **options)


def counts_of_a_mm(device: Any) -> int:
    part = device.bay(1) if hasattr(device, "bay") else device
    part = part.channel(1) if hasattr(part, "channel") else part
    part.set_pos_counter(mm=1)
    counts: int = part.get_pos_counter().position
    return counts


@pytest.mark.parametrize(
    ("unit", "number", "model", "counts"),
    [
        ("TST001", 80000001, "TST001", 25_600),
        # Newer units, with the prefix of the documented unit or another prefix
        ("TST001", 80000001, "TST101", 409_600),
        ("TST001", 26000001, "KST101", 409_600),
        ("BSC101", 40000001, "BSC101", 25_600),
        ("BSC101", 40163084, "SCC201", 409_600),  # what a BSC201 reports
        ("BSC101", 40163084, "BSC201", 409_600),
        ("BSC103", 70000001, "BSC103", 25_600),
        ("BSC103", 70000001, "BSC203", 409_600),
        ("BSC103", 70000001, "SCC201", 409_600),
        ("BSC102", 99000001, "BSC202", 409_600),
        ("MST601", 50000001, "MST601", 25_600),
    ],
)
def test_steppers_that_share_a_prefix_have_the_scales_of_their_model(
    unit: str, number: int, model: str, counts: int
) -> None:
    with opened(unit, number, model, stage="APT_STEPPER") as device:
        assert counts_of_a_mm(device) == counts


@pytest.mark.parametrize("model", ["KDC101", "KDC101 ", b"KDC101\0x", " KDC101", ""])
def test_a_kdc101_has_the_scales_of_a_tdc001_as_the_document_states(model: str | bytes) -> None:
    with opened("TDC001", 27000001, model, stage="Z8") as device:
        assert counts_of_a_mm(device) == 34_304
        assert device.get_vel_params().max_velocity_mm_per_s is not None
        text = str(device)
    assert "KDC101: K-Cube DC servo driver" in text
    assert "scales: TDC001, Issue 37 of the document, page 39" in text


@pytest.mark.parametrize(
    ("unit", "number", "model", "names"),
    [
        ("TST001", 26000001, "", "KST101 or KST201"),
        ("TST001", 26000001, "TST001", "KST101 or KST201 or TST001"),  # an impossible pair
        ("BSC101", 40000001, "", "BSC101 or BSC201"),
        ("BSC103", 70000001, "  ", "BSC103 or BSC203"),
        ("BSC102", 70000001, "", "BSC102 or BSC202"),
        ("TST001", 80000001, "", "TST001 or TST101"),
    ],
)
def test_a_scale_is_unknown_if_the_model_does_not_determine_it(
    unit: str, number: int, model: str, names: str
) -> None:
    with opened(unit, number, model, stage="APT_STEPPER") as device:
        with pytest.raises(
            UnknownScaleError, match=rf"on {names} is unknown: it differs .*pass model="
        ):
            counts_of_a_mm(device)
        text = str(device)
        assert f"may be {names}: pass model= to open to choose one" in text
        assert f"in raw counts only: it differs ({names.split()[0]}" in text
        part = device.bay(1) if hasattr(device, "bay") else device
        part.set_pos_counter(position=7)
        assert part.get_pos_counter().position == 7


def test_the_model_option_decides_if_the_reported_model_does_not() -> None:
    with opened("BSC103", 70000001, stage="APT_STEPPER", model="bsc203") as device:
        assert counts_of_a_mm(device) == 409_600
    with opened("BSC103", 70000001, stage="APT_STEPPER", model="BSC103") as device:
        assert counts_of_a_mm(device) == 25_600


def test_a_model_option_that_contradicts_the_controller_is_refused() -> None:
    with pytest.raises(WrongUnitError, match=r"is BSC103, not BSC203: .*open it without model="):
        opened("BSC103", 70000001, "BSC103", model="BSC203")
    with pytest.raises(
        BadValueError, match=r"'KDC101' cannot be opened as a BSC103 \(choose BSC103, BSC203\)"
    ):
        opened("BSC103", 70000001, "BSC103", model="KDC101")


def test_values_in_mm_are_refused_for_an_alias_without_a_scale() -> None:
    with opened("TST001", 26000001, "KST201", stage="APT_STEPPER") as device:
        with pytest.raises(
            UnknownScaleError,
            match=r"the registry has no scales of APT_STEPPER on KST201; pass stage=Stage.of_user\(\.\.\.\)",
        ):
            device.move_absolute(mm=1)
        assert "KST201: K-Cube stepper driver, second version" in str(device)
        assert "scales: unknown" in str(device)
    mine = Stage.of_user("mine", position=Scale.counts_per("mm", 7))
    with opened("TST001", 26000001, "KST201", stage=mine) as device:
        assert counts_of_a_mm(device) == 7


def test_an_alias_also_has_its_own_velocity_scale() -> None:
    with opened("TST001", 26000001, "KST101", stage="APT_STEPPER") as device:
        written = device.change_vel_params(max_velocity_mm_per_s=1, acceleration_mm_per_s2=1)
        assert (written.max_velocity, written.acceleration) == (21_987_328, 4_506)
        assert "409600 counts per mm (APT_STEPPER, Issue 37 of the document, page 41" in str(device)
    with (
        opened("TST001", 80000001, "TST001", stage="APT_STEPPER") as device,
        pytest.raises(UnknownScaleError, match=r"the scale of velocity .* is unknown"),
    ):
        device.change_vel_params(max_velocity_mm_per_s=1)


def test_a_travel_that_cannot_be_checked_on_the_alias_is_refused() -> None:
    with pytest.raises(UnknownScaleError, match=r"travel_mm cannot be checked: .*KST201"):
        opened("TST001", 26000001, "KST201", stage="APT_STEPPER", travel_mm=12)


def test_a_travel_is_checked_with_the_scale_of_the_alias() -> None:
    line = line_of("TST001", 26000001, "KST101")
    with TST001.open(line, stage="APT_STEPPER", travel_mm=1) as device:
        line.forget()
        with pytest.raises(Exception, match="outside the travel"):
            device.start_move_absolute(counts=409_601)
        assert line.names(device.facts.protocol) == []


@pytest.mark.parametrize(
    ("unit", "number", "model", "text"),
    [
        ("TDC001", 83000001, "KVS30", r"but the model to KVS30 \(vertical stage"),
        ("TDC001", 24000001, "KVS30", "as KVS30 .* does; no class supports it"),
        ("TDC001", 83000001, "XYZ", "but the model to no known unit"),
        ("TDC001", 24000001, "", "no known unit has serial numbers that begin with 24"),
        ("TDC001", 24000001, "TDC001", "no known unit has serial numbers that begin with 24"),
        ("TDC001", 83000001, "TST001", "number belongs to TDC001, but the model to TST001"),
        ("BSC103", 70000001, "BSC102", "as BSC102 does; open it as BSC102"),
        ("MST601", 50000001, "MST602", r"as MST602 \(Two-channel .*no class supports it"),
        ("TST001", 55000001, "K10CR1", r"as K10CR1 \(rotation stage.*no class supports it"),
        ("BBD102", 73000001, "BBD103", "open it as BBD103"),
    ],
)
def test_an_unknown_or_contradicting_identity_is_refused_with_advice(
    unit: str, number: int, model: str, text: str
) -> None:
    with pytest.raises(WrongUnitError, match=text) as caught:
        opened(unit, number, model)
    assert f"is not a {unit}" in str(caught.value)
    assert f"identify=False to use it as a {unit} without this check" in str(caught.value)


@pytest.mark.parametrize(
    ("unit", "number", "model"),
    [
        ("BBD102", 73000001, "ION001 "),
        ("BBD102", 94000001, "ION001 "),
        ("BSC101", 40000001, "SCC201"),
        ("BPC301", 41000001, "PCC301"),
        ("BPC301", 41878356, "BPC301"),
        ("TDC001", 83000001, ""),
        ("TDC001", 83000001, "TDC001"),
    ],
)
def test_the_name_of_a_card_or_a_missing_model_is_accepted(
    unit: str, number: int, model: str
) -> None:
    opened(unit, number, model).close()


def test_without_identification_the_scales_are_those_of_the_class_or_model_option() -> None:
    options: dict[str, Any] = {"stage": "APT_STEPPER", "identify": False}
    with opened("TST001", 24000001, "XYZ", **options) as device:
        assert counts_of_a_mm(device) == 25_600
    with opened("TST001", 24000001, "XYZ", model="KST101", **options) as device:
        assert counts_of_a_mm(device) == 409_600
        assert "identity not read" in str(device)
        assert "KST101: K-Cube stepper driver" in str(device)


def test_asyncio_makes_the_same_decisions() -> None:
    async def main() -> None:
        options: dict[str, Any] = {"stage": "APT_STEPPER"}
        url = "virtual://TST001?serial_number=26000001"
        async with aio.TST001.open(url, **options) as device:
            with pytest.raises(UnknownScaleError, match="KST101 or KST201 or TST001"):
                await device.move_absolute(mm=1)
        async with aio.TST001.open(url, model="KST101", **options) as device:
            await device.set_pos_counter(mm=1)
            assert (await device.get_pos_counter()).position == 409_600
        with pytest.raises(WrongUnitError, match="serial numbers that begin with 24"):
            await aio.TDC001.open("virtual://TDC001?serial_number=24000001")

    asyncio.run(main())


def test_a_reconnected_controller_is_identified_again() -> None:
    url = "virtual://TST001?serial_number=26000001"
    with TST001.open(url, stage="APT_STEPPER", model="KST101") as device:
        device.reconnect()
        assert counts_of_a_mm(device) == 409_600
    with TST001.open(url, stage="APT_STEPPER") as device:
        device.reconnect()
        with pytest.raises(UnknownScaleError, match="pass model="):
            counts_of_a_mm(device)


def test_a_newer_unit_without_a_similar_unit_is_named_but_has_no_class() -> None:
    [known] = by_serial_number(PROTOCOL, "97000001")
    assert (known.name, known.unit) == ("KIM101", None)
    assert "KIM101: not in Issue 3; the registry has no messages for it" in str(known)
    with pytest.raises(UnsupportedError, match="KIM101: not in Issue 3"):
        device_class("KIM101")
