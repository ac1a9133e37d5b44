"""The exact factors of scales are compared with the numbers in their printed texts."""

from __future__ import annotations

import pytest

from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.lint.witness.scales import compare_scales
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import Document


def compared(protocol: Protocol, key: str, number: object, printed: str) -> Comparison:
    """Compare one scale of an invented quantity."""
    scale = {key: number, "printed": printed}
    document = Document("quantities.yaml", {"quantities": {"speed": {"scale": scale}}}, {})
    comparison = Comparison(protocol, document)
    compare_scales(comparison, {"quantities": [document]})
    return comparison


@pytest.mark.parametrize(
    ("key", "right", "wrong", "printed"),
    [
        ("us_per_count", "512/5", "513/5", "102.4"),
        ("counts_per_mm_per_s", "16777216/125", "16777400/125", "134218"),
        ("counts_per_mm", 20000, 20001, "10 x 20,000"),
        ("counts_per_mm_per_s", "34304", "34307", "3430 counts/sec = 0.1 mm/sec"),
        ("ms_per_count", "1/7", "1/8", "7KHz (0.14 ms)"),
        ("ms_per_count", "1/4", "1/5", "250 µs"),
        ("um_per_count", "1/10", "2/10", "steps of 100nm"),
        ("v_per_count", "1/10", "1/11", "1/10 volt steps"),
        ("counts_per_v", "10", "11", "1/10 volt steps"),
        ("counts_per_percent", "32767/100", "32768/100", "0 to 32767 (0 to 100%)"),
        ("counts_per_percent", "255/100", "256/100", "0 (Off) to 255 (brightest)"),
        ("counts_at_setting", 19000, 19001, "10V/ms i.e. 1266 x 150 / 19000"),
    ],
)
def test_a_factor_is_one_of_the_printed_numbers(
    protocol: Protocol, key: str, right: object, wrong: object, printed: str
) -> None:
    """Each is rounded to its printed digits; a ratio of two numbers is also a factor."""
    agreed = compared(protocol, key, right, printed)
    assert not agreed.differences
    assert agreed.compared == 1
    different = compared(protocol, key, wrong, printed).differences
    assert list(different) == ["scales/speed/scale"]
    assert different["scales/speed/scale"].printed == printed
    assert different["scales/speed/scale"].encoded == str(wrong)


@pytest.mark.parametrize("printed", ["milliseconds", ""])
def test_a_text_without_numbers_is_not_compared(protocol: Protocol, printed: str) -> None:
    assert not compared(protocol, "ms_per_count", 1, printed).compared
