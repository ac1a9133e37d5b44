"""Reading of printed names, numbers and limits."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from stagewire_generator.lint.witness.reading import (
    Vocabulary,
    amount,
    count,
    find_field,
    limit,
    number,
    real_limit,
    same_name,
    squash,
)
from stagewire_generator.model import Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.model_scales import (
    Factor,
)

BYTE, WORD = 0xFF, 0xFFFF


@pytest.mark.parametrize(
    ("text", "maximum", "wanted"),
    [
        ("0", BYTE, 0),
        ("32,767", WORD, 32767),
        (" 12 ", BYTE, 12),
        ("to 12", BYTE, 12),
        ("-32768", WORD, -32768),
        ("0x1F", BYTE, 31),
        ("1F", BYTE, 31),
        ("1f", BYTE, 31),
        ("0x10", BYTE, 16),
        ("10", BYTE, 10),
        ("-0x01", BYTE, 255),  # two's complement
        ("-0x01", WORD, -1),
        ("-1", BYTE, -1),
        ("", BYTE, None),
        ("-", BYTE, None),
        ("all", BYTE, None),
        (",1", BYTE, None),
        ("1.5", BYTE, None),
        ("+1", BYTE, 1),
        ("1 to 2", BYTE, None),
    ],
)
def test_printed_numbers_are_read(text: str, maximum: int, wanted: int | None) -> None:
    assert number(text, maximum) == wanted


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("0.1", 0x3DCCCCCD),
        ("10,000", 0x461C4000),
        ("1 nA", 0x3089705F),
        ("1 mA", 0x3A83126F),
        ("10 V", 0x41200000),
        ("1 kA", None),
        ("0x10", None),
    ],
)
def test_printed_real_numbers_are_read(text: str, wanted: int | None) -> None:
    assert real_limit(text, 4) == wanted


def test_names_are_compared_by_letters_and_digits() -> None:
    assert squash("Jog Mode") == squash("jog_mode") == squash("JOG-MODE:") == "jogmode"
    assert squash("Kp 2") == "kp2"


def field(protocol: Protocol, name: str) -> Field:
    """Return a field of the small good spec."""
    layouts = (layout for message in protocol.messages for layout in message.layouts)
    return next(f for layout in layouts for f in layout.all_fields if f.name == name)


@pytest.mark.parametrize("printed", ["Not Used", "unused", "Reserved", "Future use", "N/A"])
def test_fillers_match_reserved_fields_only(protocol: Protocol, printed: str) -> None:
    assert same_name(printed, field(protocol, "reserved"))
    assert not same_name(printed, field(protocol, "velocity"))
    assert same_name("VELOCITY", field(protocol, "velocity"))


def test_the_best_matching_field_is_found(protocol: Protocol) -> None:
    """An exact name or its plural has precedence over a part of a name."""
    names = ("max_velocity", "velocity", "gain", "modes")
    fields = [replace(field(protocol, "velocity"), name=name) for name in names]
    for printed, wanted in (
        ("Velocity", "velocity"),
        ("Velocitys", "velocity"),
        ("Max Velocity", "max_velocity"),
        ("Loop Gain", "gain"),
        ("Mode", "modes"),
        ("Mode 2", None),
        ("Veloc", "max_velocity"),
        ("Speed", None),
    ):
        found = find_field(fields, printed)
        assert (found and found.name) == wanted, printed


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("100ms", 250),
        ("10,000s", 25_000_000),
        ("1s", 2500),
        ("100", 100),
        ("0x64", 100),
        ("1m", None),
        ("1 s", None),
    ],
)
def test_a_time_as_a_limit_is_converted_to_counts(
    protocol: Protocol, text: str, wanted: int | None
) -> None:
    factor = Factor("ms_per_count", Fraction(2, 5), "0.4", "", None)
    timed = field(protocol, "sample_time")
    assert timed.quantity
    assert timed.unit == "ms"
    assert limit(text, replace(timed, quantity=replace(timed.quantity, factor=factor))) == wanted


def test_a_time_whose_steps_depend_on_the_unit_is_converted_as_of_the_first_unit(
    protocol: Protocol,
) -> None:
    timed = field(protocol, "sample_time")
    assert timed.quantity
    assert [*timed.quantity.by_unit] == ["TP1"]
    assert limit("1s", timed) == 7000


def test_a_time_is_not_a_limit_in_another_unit(protocol: Protocol) -> None:
    assert limit("1s", field(protocol, "wait")) is None
    assert limit("1s", field(protocol, "marker")) is None
    assert limit("7", field(protocol, "wait")) == 7


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("two", 2),
        ("zero", 0),
        ("nine", 9),
        ("02", 2),
        ("12", 12),
        ("ten", "ten"),
        ("", ""),
        ("-1", "-1"),
    ],
)
def test_counts_are_read_in_figures_and_words(text: str, wanted: int | str) -> None:
    assert count(text) == wanted


WORDS = Vocabulary.of(
    {
        "slots": {}, "whole_slot": "range", "no_size": "None", "axis": "Axis", "cleared": ["off"],
        "signed": ["two's complement"], "unsigned": ["straight"],
        "units": [
            {"printed": "tenths of a micron", "unit": "um", "factor": "1/10"},
            {"printed": "μ m/s", "unit": "um/s", "factor": 1},
        ],
        "notations": {"setup": {"dec": "{prefix} {byte:02}", "hex": "#{prefix:02X}{byte:02X} {key}"}},
    }
)  # fmt: skip


def test_signs_and_units_are_read_with_the_vocabulary() -> None:
    """Unknown words are returned unchanged, and are then a difference."""
    assert WORDS.signed("two's complement") == "signed"
    assert WORDS.signed("straight") == "unsigned"
    assert WORDS.signed("odd") == "'odd'"
    assert WORDS.unit("tenths of a micron") == amount(Fraction(1, 10), "um") == "1/10 um"
    assert WORDS.unit("μ m/s") == "1 um/s"
    assert WORDS.unit("furlongs") == "furlongs"


def test_a_byte_is_written_in_the_notation_of_a_column() -> None:
    assert WORDS.written("setup", "dec", 7, prefix=255) == "255 07"
    assert WORDS.written("setup", "hex", 0x0A, prefix=255, key="{byte}") == "#FF0A {byte}"
    assert WORDS.written("setup", "keyboard", 7) == WORDS.written("axes", "dec", 7) == ""
    assert Vocabulary().written("setup", "dec", 7) == ""


@pytest.mark.parametrize(
    "notation", ["{byte.real}", "{byte:9999}", "{0}", "{}", "{{byte}", "{BYTE}"]
)
def test_a_notation_is_not_a_python_format(notation: str) -> None:
    """A spec must not be able to access attributes or produce endless spaces."""
    words = Vocabulary(notations={"setup": {"dec": notation}})
    assert words.written("setup", "dec", 7) == notation.replace("{byte}", "7")
