"""quantities.h converts like the runtime for all numbers, and has exactly the scales of the registry."""

from __future__ import annotations

import random
import re
import struct
import subprocess
from collections.abc import Sequence
from fractions import Fraction
from math import gcd
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from toolchain import C_WARNINGS, CORTEX_M0, C, compiles, need, symbols

import stagewire_apt
import stagewire_ms2000
from parts import first_of
from stagewire.protocols import Protocol
from stagewire.quantities import Scale, exact, round_half_away
from stagewire_conformance.registry import Json, registry_of
from stagewire_conformance.scales import in_unit, scale_of

PROTOCOLS = (stagewire_apt.PROTOCOL, stagewire_ms2000.PROTOCOL)
GREATEST = 2**63 - 1
LEAST = -(2**63)
UNTOUCHED = 111  # initial value of a result in the program

TO_COUNTS, FROM_COUNTS, SHARE_NUMERATOR, SHARE_DENOMINATOR = 0, 1, 6, 7
NARROW = {2: (-(2**15), 2**15 - 1), 3: (0, 2**16 - 1), 4: (-(2**31), 2**31 - 1), 5: (0, 2**32 - 1)}

Question = tuple[int, int, int, int, int]

# Small numbers, and numbers around powers of two, are most likely to be ties or limits.
_NEAR = st.builds(lambda bit, off: (1 << bit) + off, st.integers(0, 63), st.integers(-3, 3))
_POSITIVE = (st.integers(1, 100) | _NEAR | st.integers(1, GREATEST)).filter(
    lambda n: 0 < n <= GREATEST
)
_ANY = st.builds(
    lambda n, sign: max(LEAST, min(GREATEST, sign * n)),
    st.integers(0, 100) | _NEAR | st.integers(0, 2**63),
    st.sampled_from((1, -1)),
)


class Converter:
    """The C program: answers any number of questions at a time."""

    def __init__(self, program: Path) -> None:
        self.program = program

    def __call__(self, questions: Sequence[Question]) -> list[int | None]:
        """Return the results; None only for errors."""
        asked = b"".join(struct.pack("=5q", *question) for question in questions)
        done = subprocess.run([str(self.program)], input=asked, capture_output=True, check=True)
        assert not done.stderr, done.stderr.decode()
        answers = list(struct.iter_unpack("=2q", done.stdout))
        assert len(answers) == len(questions)
        assert all(status == 0 or result == UNTOUCHED for status, result in answers)
        return [result if status == 0 else None for status, result in answers]


@pytest.fixture(scope="module")
def converter(tmp_path_factory: pytest.TempPathFactory) -> Converter:
    """The program, which stops at undefined behaviour."""
    need("gcc")
    program = tmp_path_factory.mktemp("quantities") / "converter"
    sanitized = ["-fsanitize=undefined", "-fno-sanitize-recover=all", "-O1"]
    source = Path(__file__).with_name("quantities_main.c")
    compiles("gcc", "-std=c99", *C_WARNINGS, *sanitized, f"-I{C}", source, "-o", program)
    return Converter(program)


def fits(value: int, least: int = LEAST, greatest: int = GREATEST) -> int | None:
    """Return a result, or None if it does not fit."""
    return value if least <= value <= greatest else None


def expected(question: Question) -> int | None:
    """Return the result of the runtime for a question."""
    which, first, second, numerator, denominator = question
    if min(second, numerator, denominator) <= 0:
        return None
    scale = Scale.counts_per("mm", numerator, denominator)
    if which == FROM_COUNTS:
        return fits(round_half_away(scale.from_counts(first) * second))
    return fits(scale.to_counts(Fraction(first, second)), *NARROW.get(which, (LEAST, GREATEST)))


# The arithmetic


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 5), _ANY, _POSITIVE, _POSITIVE, _POSITIVE), min_size=1))
@example([(TO_COUNTS, LEAST, 1, 1, 1), (TO_COUNTS, LEAST, 1, GREATEST, GREATEST)])
@example([(FROM_COUNTS, LEAST, 1, 1, 1), (FROM_COUNTS, LEAST, GREATEST, GREATEST, GREATEST)])
@example([(TO_COUNTS, n, 2, 1, 1) for n in range(-5, 6)])
@example([(FROM_COUNTS, n, 1, 2, 1) for n in range(-5, 6)])
def test_conversions_equal_those_of_the_runtime(
    converter: Converter, questions: list[Question]
) -> None:
    assert converter(questions) == [expected(question) for question in questions]


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 5), _ANY, _ANY, _ANY, _ANY), min_size=1))
def test_arguments_must_be_positive(converter: Converter, questions: list[Question]) -> None:
    assert converter(questions) == [expected(question) for question in questions]


def tie(random_: random.Random) -> Question:
    """Return a question whose answer is a tie, or as close as possible to one."""
    odd, part, numerator, denominator = (
        random_.getrandbits(random_.randrange(1, 21)) | 1 for _ in range(4)
    )
    first = odd * part * denominator + random_.randrange(-1, 2)
    return TO_COUNTS, first * random_.choice((1, -1)), 2 * part, numerator, denominator


def plain(random_: random.Random) -> Question:
    """Return a question with numbers of random length; about half of the answers fit."""
    first, *others = (random_.getrandbits(random_.randrange(1, 64)) for _ in range(4))
    second, numerator, denominator = (other or 1 for other in others)
    sign = random_.choice((1, -1))
    return random_.randrange(6), first * sign, second, numerator, denominator


@pytest.mark.parametrize("rounds", first_of([5_000, 125_000]))
def test_conversions_of_random_numbers_equal_those_of_the_runtime(
    converter: Converter, rounds: int
) -> None:
    random_ = random.Random(20)
    questions = [make(random_) for _ in range(rounds) for make in (tie, plain, tie, plain)]
    answers = converter(questions)
    refused = 0
    for question, answer in zip(questions, answers, strict=True):
        which, first, second, numerator, denominator = question
        if which == FROM_COUNTS:
            above, below = abs(first) * denominator * second, numerator
        else:
            above, below = abs(first) * numerator, second * denominator
        magnitude = (2 * above + below) // (
            2 * below
        )  # the result of expected(), without fractions
        value = magnitude if first >= 0 else -magnitude
        assert answer == fits(value, *NARROW.get(which, (LEAST, GREATEST))), question
        refused += answer is None
    assert len(questions) // 10 < refused < len(questions) // 2
    assert [expected(question) for question in questions[:5000]] == answers[:5000]


@settings(deadline=None)
@given(_ANY, _ANY, st.integers(1, 2**32 - 1))
@example(GREATEST, GREATEST, 2**32 - 1)
@example(3, GREATEST, 32767)
@example(GREATEST - 1, 2**62, 2)
def test_a_scale_that_depends_on_a_setting(
    converter: Converter, numerator: int, denominator: int, full_scale: int
) -> None:
    found = converter([
        (which, numerator, denominator, full_scale, 0)
        for which in (SHARE_NUMERATOR, SHARE_DENOMINATOR)
    ])  # fmt: skip
    if min(numerator, denominator) <= 0:
        assert found == [None, None]
        return
    scale = Fraction(full_scale * denominator, numerator)
    none = scale.numerator > GREATEST
    assert found == ([None, None] if none else [scale.numerator, scale.denominator])
    assert none or gcd(*filter(None, found)) == 1


# Conversions in the documents


def stated_values() -> list[tuple[str, str, Json, Scale, Fraction]]:
    """Return every value that a document states in units and in counts, with its exact scale."""
    found = []
    for protocol in PROTOCOLS:
        registry = registry_of(protocol)
        for entry in protocol.vectors()["examples"]:
            stated = entry.get("stated", [])
            for item in stated if isinstance(stated, list) else stated.values():
                scale = scale_of(registry, item)
                value = in_unit(exact(item["value"]), item["unit"], scale.unit)
                found.append((protocol.name, entry["id"], item, scale, value))
    return found


def test_the_conversions_in_the_documents(converter: Converter) -> None:
    found = stated_values()
    assert {name for name, *_ in found} == {protocol.name for protocol in PROTOCOLS}
    asked = [
        (TO_COUNTS, *value.as_integer_ratio(), *scale.counts_per_unit.as_integer_ratio())
        for *_, scale, value in found
    ]
    assert converter(asked) == [item["exact"] for _, _, item, *_ in found]
    back = [
        (FROM_COUNTS, item["exact"], 10**6, *scale.counts_per_unit.as_integer_ratio())
        for _, _, item, scale, _ in found
    ]
    assert converter(back) == [
        round_half_away(scale.from_counts(item["exact"]) * 10**6) for _, _, item, scale, _ in found
    ]


# The scales


def known_scales(data: Json) -> dict[str, Fraction]:
    """Return the constants of a registry, by name without the prefix."""
    found: dict[str, Fraction] = {}

    def add(name: str, rule: Json) -> None:
        for key, value in rule.items():
            if key.startswith("counts_per_"):
                found[name.upper()] = Fraction(value["numerator"], value["denominator"])
            elif key.endswith("_per_count"):
                found[name.upper()] = Fraction(value["denominator"], value["numerator"])
        for part in ("units", "conflict"):
            for word, scale in rule.get(part, {}).items():
                add(f"{name}_{word}", scale)
        for case, inner in rule.get("cases", {}).items():
            add(f"{name}_{case}", inner["scale"])

    for name, quantity in data["quantities"].items():
        add(name, quantity["scale"])
    for stage in data["stages"]:
        for controller, scales in stage["controllers"].items():
            for name, rule in scales.items():
                add(f"{stage['name']}_{controller}_{name}", rule)
    return found


def scales_by_setting(data: Json) -> dict[str, int]:
    """Return the functions of a registry, by name without the prefix, with their full scale."""
    found = {}
    for name, quantity in data["quantities"].items():
        rule = quantity["scale"]
        cases = {f"_{case}": inner["scale"] for case, inner in rule.get("cases", {}).items()}
        for case, scale in {"": rule, **cases}.items():
            if "counts_at_setting" in scale:
                found[f"{name}{case}".lower()] = scale["counts_at_setting"]
    return found


@pytest.mark.parametrize("protocol", PROTOCOLS, ids=lambda protocol: protocol.name)
def test_the_scales_equal_those_of_the_registry(protocol: Protocol, tmp_path: Path) -> None:
    need("gcc")
    prefix = protocol.package.removeprefix("stagewire_")
    header = (C / protocol.package / "quantities.h").read_text("utf-8")
    scales, settings = known_scales(protocol.registry()), scales_by_setting(protocol.registry())
    assert scales
    assert set(re.findall(r"^#define [A-Z0-9]+_SCALE_(\w+)", header, re.M)) == set(scales)
    functions = re.findall(r"^static inline \w+ [a-z0-9]+_scale_(\w+)\(", header, re.M)
    assert set(functions) - {"of_share"} == set(settings)
    lines = [
        f"{{ const {prefix}_scale it = {prefix.upper()}_SCALE_{name};"
        ' printf("%" PRId64 "/%" PRId64 "\\n", it.numerator, it.denominator); }'
        for name in scales
    ]
    lines += [
        f"{{ {prefix}_scale it; const {prefix}_ratio setting = {{375, 5}};"
        f" if ({prefix}_scale_{name}(&setting, &it) != {prefix.upper()}_OK) return 1;"
        ' printf("%" PRId64 "/%" PRId64 "\\n", it.numerator, it.denominator); }'
        for name in settings
    ]
    text = (
        f'#include <inttypes.h>\n#include <stdio.h>\n#include "{protocol.package}/quantities.h"\n'
    )
    source, program = tmp_path / "scales.c", tmp_path / "scales"
    source.write_text("\n".join([f"{text}int main(void)\n{{", *lines, "return 0; }\n"]), "utf-8")
    compiles("gcc", "-std=c99", *C_WARNINGS, f"-I{C}", source, "-o", program)
    printed = [Fraction(line) for line in compiles(program).split()]
    assert printed == [*scales.values(), *(Fraction(counts, 75) for counts in settings.values())]


def comments(header: str) -> dict[str, str]:
    """Return the comment on each macro, and each separate comment under its own text."""
    found = {}
    for text, name in re.findall(r"/\*\*?((?:[^*]|\*(?!/))*)\*/\n(?:#define (\w+))?", header):
        words = " ".join(re.sub(r"^ \* ?", "", text, flags=re.M).split())
        found[name or words] = words
    return found


def test_the_comments_name_the_source_of_a_scale() -> None:
    found = comments((C / "stagewire_apt" / "quantities.h").read_text("utf-8"))
    velocity = found["APT_SCALE_MLS203_BBD10X_VELOCITY"]
    for fact in ("MLS203 on BBD10x", "mm/s", "page 14", "16777216/125", "“134218”"):
        assert fact in velocity
    assert "page 29" in found["APT_SCALE_MLS203_BBD10X_ENCODER_POSITION"]
    assert "767367 per mm/s" in found["APT_SCALE_Z8_TDC001_VELOCITY"]
    assert "APT_SCALE_Z8_TDC001_ACCELERATION" not in found
    [unknown] = [text for text in found if text.startswith("acceleration of Z8 on TDC001")]
    assert "no scale" in unknown
    assert "263 per mm/s^2" in unknown


# The machine


def test_both_packages_have_the_same_arithmetic() -> None:
    def arithmetic(protocol: Protocol) -> str:
        prefix = protocol.package.removeprefix("stagewire_")
        text = (C / protocol.package / "quantities.h").read_text("utf-8")
        begin, end = text.index("#include <stdbool.h>"), text.index("/** Convert as ")
        return text[begin:end].replace(f"{prefix}_", "").replace(f"{prefix.upper()}_", "")

    first, *others = map(arithmetic, PROTOCOLS)
    assert others == [first] * len(others)


@pytest.mark.matrix
def test_a_cortex_m0_needs_no_library_functions(tmp_path: Path) -> None:
    need("arm-none-eabi-gcc")
    source, made = tmp_path / "conversions.c", tmp_path / "conversions.o"
    source.write_text(
        """
        #include "stagewire_apt/quantities.h"
        apt_status in(const apt_ratio *value, const apt_scale *scale, int32_t *counts);
        apt_status out(int64_t counts, const apt_scale *scale, int64_t *thousandths);
        apt_status share(const apt_ratio *volts, apt_scale *scale);
        apt_status in(const apt_ratio *value, const apt_scale *scale, int32_t *counts)
        { return apt_to_counts_int32(value, scale, counts); }
        apt_status out(int64_t counts, const apt_scale *scale, int64_t *thousandths)
        { return apt_from_counts(counts, scale, 1000, thousandths); }
        apt_status share(const apt_ratio *volts, apt_scale *scale)
        { return apt_scale_output_volts(volts, scale); }
        """,
        "utf-8",
    )
    for level in ("-Os", "-O2"):
        options = ["-std=c99", *CORTEX_M0, level, *C_WARNINGS, f"-I{C}"]
        compiles("arm-none-eabi-gcc", *options, "-c", source, "-o", made)
        found = symbols("arm-none-eabi-nm", made)
        assert {"in", "out", "share"} <= {name for name, _, _ in found}
        assert not [name for name, kind, _ in found if kind == "U"]
