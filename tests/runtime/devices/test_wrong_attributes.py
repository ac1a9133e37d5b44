"""Assignments to attributes that a device does not have."""

from __future__ import annotations

from typing import Any

import pytest

import stagewire_virtual as virtual
from stagewire_apt import BPC203, KDC101, TPZ001, aio
from stagewire_virtual import stepped
from stagewire_virtual.linking import SteppedLink


def opened(cls: Any, controller: Any, **options: Any) -> Any:
    return cls.open(SteppedLink(controller), identify=False, **options)


def test_a_misspelt_attribute_is_refused_with_the_nearest_names() -> None:
    with opened(TPZ001, virtual.TPZ001()) as piezo:
        with pytest.raises(AttributeError, match=r"TPZ001 has no attribute 'volt' .*output_volts"):
            piezo.volt = 3
        with pytest.raises(AttributeError, match="did you mean set_output_volts, "):
            piezo.set_output_volt = 3
        with pytest.raises(AttributeError, match=r"attribute 'xyzzy' that can be set$"):
            piezo.xyzzy = 3
        assert "volt" not in vars(piezo)


def test_bays_and_channels_refuse_them_too() -> None:
    with opened(BPC203, virtual.BPC203()) as rack, pytest.raises(AttributeError, match="BPC203Bay"):
        rack.bay(1).volt = 3


def test_a_property_without_a_setter_cannot_be_set() -> None:
    refused = pytest.raises(AttributeError, match=r"^position of KDC101 cannot be assigned$")
    with opened(KDC101, virtual.KDC101()) as kdc, refused:
        kdc.position = 3


def test_an_attribute_is_not_assigned_in_asyncio() -> None:
    async def main() -> None:
        async with aio.TPZ001.open("virtual://TPZ001", identify=False) as piezo:
            with pytest.raises(AttributeError, match=r"cannot be assigned; use set_volts\(\)$"):
                piezo.volts = 3

    stepped.run(main())


def test_methods_can_be_replaced_as_mocks_do(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(TPZ001, virtual.TPZ001()) as piezo:
        monkeypatch.setattr(piezo, "get_output_volts", lambda: 7)
        assert piezo.get_output_volts() == 7


class Named(TPZ001):
    """A class of a user, with an attribute of its own."""

    label: str


def test_a_class_of_a_user_declares_its_attributes() -> None:
    with opened(Named, virtual.TPZ001()) as piezo:
        piezo.label = "left"
        assert piezo.label == "left"
