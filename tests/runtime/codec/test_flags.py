"""Named bits and named values; bits and values without a name are kept."""

from __future__ import annotations

import pytest

from stagewire.errors import UnknownFieldError
from stagewire.protocols import Bit, Enumeration, Flags


class Lamp(Flags):
    red = Bit(0x01, "the left one")
    green = Bit(0x02)
    blue = Bit(0x8000_0000)


class Mood(Enumeration):
    CALM = 1
    BUSY = 2


def test_bits_on_a_class_and_on_a_value() -> None:
    assert Lamp.bits == {"red": 1, "green": 2, "blue": 0x8000_0000}
    assert Lamp.green == 2
    lamp = Lamp(0x8000_0001)
    assert lamp.red is True
    assert lamp.green is False
    assert lamp.blue is True
    assert lamp == 0x8000_0001
    assert vars(Lamp)["red"].note == "the left one"
    assert vars(Lamp)["green"].note == ""


@pytest.mark.parametrize(
    ("value", "names", "unnamed", "shown"),
    [
        (0, (), 0, "<Lamp 0>"),
        (2, ("green",), 0, "<Lamp green>"),
        (0x8000_0001, ("red", "blue"), 0, "<Lamp red|blue>"),
        (0x15, ("red",), 0x14, "<Lamp red|0x14>"),
        (0x14, (), 0x14, "<Lamp 0x14>"),
    ],
)
def test_named_and_unnamed_bits(
    value: int, names: tuple[str, ...], unnamed: int, shown: str
) -> None:
    lamp = Lamp(value)
    assert lamp.names == names
    assert lamp.unnamed == unnamed
    assert repr(lamp) == shown


def test_a_value_made_from_named_bits() -> None:
    assert Lamp.of() == 0
    assert Lamp.of(red=True, green=False, blue=True) == 0x8000_0001
    assert type(Lamp.of(red=True)) is Lamp
    with pytest.raises(UnknownFieldError) as caught:
        Lamp.of(red=True, yellow=True)
    assert str(caught.value) == "Lamp has no bit yellow (it has: red, green, blue)"


def test_a_table_without_bits() -> None:
    assert Flags.of() == 0
    assert Flags(3).names == ()
    assert Flags(3).unnamed == 3


def test_named_values() -> None:
    assert Mood.of(2) is Mood.BUSY
    assert Mood.of(3) == 3
    assert type(Mood.of(3)) is int
