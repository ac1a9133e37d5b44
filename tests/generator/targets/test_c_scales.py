"""quantities.h of test specs: every kind of scale, and unknown scales."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from stagewire_generator import check, render
from stagewire_generator.model import Protocol


def header(protocol: Protocol) -> str:
    return render([protocol], ["c"])[f"c/{protocol.package}/quantities.h"]


def unwrapped(text: str) -> str:
    """Return a text on one line, without the stars at the beginning of comment lines."""
    return re.sub(r"\s+\*\s+|\s+", " ", text)


def constants(text: str) -> dict[str, str]:
    """Return the constants as fractions, by name without the prefix of the package."""
    found = re.findall(
        r"^#define TINY_SCALE_(\w+) .*?INT64_C\((\d+)\), INT64_C\((\d+)\)", text, re.M
    )
    return {name: f"{numerator}/{denominator}" for name, numerator, denominator in found}


@pytest.fixture(scope="module")
def text(good_spec: Path) -> str:
    return header(check(good_spec)[0])


def test_every_known_scale_is_a_constant(text: str) -> None:
    assert constants(text) == {
        "INTERVAL": "5/512",
        "READING_VOLTAGE": "10/3",
        "SAMPLES_TP1": "7/1",
        "SLIDE_TP9_DISTANCE": "400/1",
        "SLIDE_TPX_DISTANCE": "20000/1",
        "SLIDE_TPX_SPEED": "16777216/125",
    }


def test_a_scale_that_depends_on_a_setting_is_a_function(text: str) -> None:
    functions = re.findall(r"tiny_scale_(\w+)\(\n.*\n{\n    return .*UINT32_C\((\d+)\)", text)
    assert functions == [("reading_distance", "4095"), ("share", "32767")]
    assert "32767 counts equal the setting maximum_volts, in V" in unwrapped(text)


def test_an_unknown_scale_is_only_a_comment(text: str) -> None:
    words = unwrapped(text)
    for unknown in (
        "How hard, in Pa (page 2)",
        "reading when display_mode is FORCE, in N (page 2)",
        "speed of Slide on TP9, in mm/s (page 3)",
    ):
        assert f"/* {unknown}: no scale. No page says so. */" in words


def test_a_comment_names_the_source_of_a_scale(text: str) -> None:
    words = unwrapped(text)
    assert (
        "How long, in us (page 2): us_per_count 512/5; printed as “102.4”; source: the crystal. */"
        " #define TINY_SCALE_INTERVAL" in words
    )
    assert "/* Slide: a slide of ten millimetres. TPx: TP1, TP2. */" in words


def test_a_scale_of_too_many_bits_is_not_a_constant(spec: Path) -> None:
    path = spec / "tiny" / "quantities.yaml"
    old = path.read_text(encoding="utf-8")
    for factor, fits in ((2**63 - 1, True), (2**63, False)):
        text = old.replace("512/5", f"1/{factor}").replace('"102.4"', "very small")
        path.write_text(text, encoding="utf-8")
        made = header(check(spec)[0])
        assert ("INTERVAL" in constants(made)) is fits
        assert (f"us_per_count 1/{factor} needs more than 64 bits" in unwrapped(made)) is not fits


def test_the_pages_of_an_overlay_are_named(overlaid: dict[str, Protocol]) -> None:
    assert "(Issue 2, page 1)" in header(overlaid["tiny/second"])


def test_there_is_a_conversion_for_each_type_of_field(text: str, commands: Protocol) -> None:
    for made in (text, header(commands)):
        types = re.findall(r"_to_counts_(u?int\d+)\(", made)
        assert types == sorted(
            set(types), key=lambda t: (int(t.strip("uint")), t.startswith("int"))
        )
        assert types
