"""The runner of the worked examples finds every kind of contradiction, and unexpected passes."""

from __future__ import annotations

from copy import deepcopy
from fractions import Fraction
from functools import partial
from typing import Any

import pytest
import testee_calls

from stagewire.protocols import load_protocol
from stagewire_conformance import Verdict, coverage, run
from stagewire_conformance.arithmetic import evaluate, rounded
from stagewire_conformance.examples import run_capture, run_example
from undocumented import NAME as UNPRINTED
from undocumented import PROTOCOL as WITH_UNPRINTED

APT = load_protocol("thorlabs_apt")
Json = dict[str, Any]

RIGHT: Json = {
    "id": "move", "page": 45, "line": 1, "kind": "tx", "title": "A move",
    "printed": "53 04 06 00 D0 01 01 00 40 0D 03 00",
    "message": "MOT_MOVE_ABSOLUTE", "form": "data", "dest": 0x50, "source": 1,
    "fields": {"chan_ident": 1, "absolute_distance": 200000},
    "verdict": "reproduced",
}  # fmt: skip
STATED: Json = {
    "value": 10, "unit": "mm", "quantity": "position", "stage": "MLS203", "controller": "BBD10x",
    "counts": 200000, "factor": "exact", "exact": 200000,
}  # fmt: skip


def erratum(**changes: Any) -> Json:
    slug = APT.registry()["errata"][0]["id"]
    return {
        **RIGHT,
        "printed": "53 04 06 00 D0 01 01 00 41 0D 03 00",
        "verdict": "erratum",
        "errata": [slug],
        "encoded": RIGHT["printed"],
        "printed_is": {
            "decodes": {
                "form": "data", "dest": 0x50, "source": 1,
                "fields": {"chan_ident": 1, "absolute_distance": 200001},
            }
        },
        **changes,
    }  # fmt: skip


def changed(entry: Json, *path: str, to: Any) -> Json:
    entry = deepcopy(entry)
    inner = entry
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = to
    return entry


failure = partial(testee_calls.failure, APT)
passes = partial(testee_calls.passes, APT)


@pytest.mark.parametrize("verdict", run(APT), ids=lambda verdict: verdict.id)
def test_every_example_and_capture(verdict: Verdict) -> None:
    prose = verdict.kind == "statement" and verdict.detail.startswith("prose")
    assert verdict.outcome == ("noted" if prose else "passed"), verdict.detail


def test_coverage_counts_every_message_once() -> None:
    rows = coverage(APT)
    assert len({row.message for row in rows}) == len(rows) == len(APT.registry()["messages"])
    assert sum(row.examples for row in rows) > 0


def test_a_correct_example_passes() -> None:
    passes(RIGHT)
    passes({**RIGHT, "stated": {"absolute_distance": STATED}})
    passes(erratum())


@pytest.mark.parametrize(
    ("path", "to", "said"),
    [
        (("printed",), "53 04 06 00 D0 01 01 00 41 0D 03 00", "the stated values give"),
        (("fields", "chan_ident"), 2, "have chan_ident 1, expected 2"),
        (("fields", "chan_ident"), 70000, "do not encode"),
        (("fields",), {"chan_ident": 1}, "lacks absolute_distance"),
        (("fields", "speed"), 2, "no field speed"),
        (("message",), "MOT_MOVE_RELATIVE", "have message"),
        (("form",), "header", "do not encode"),
        (("dest",), 0x21, "have dest 80, expected 33"),
        (("source",), 2, "have source 1, expected 2"),
        (("extra",), "00", "have extra bytes (none)"),
        (("printed",), "53 04 06 00", "do not decode"),
        (("breakdown",), {"errata": ["no-such"]}, "unknown erratum no-such"),
    ],
)
def test_a_wrong_example_of_a_frame_fails(path: tuple[str, ...], to: Any, said: str) -> None:
    assert said in failure(changed(RIGHT, *path, to=to))


def test_bytes_that_are_not_stated_fail() -> None:
    entry = {
        **RIGHT, "message": "MOD_IDENTIFY", "form": "header", "fields": {},
        "printed": "23 02 00 07 50 01",
    }  # fmt: skip
    assert "have param2 7, which is not stated" in failure(entry)


def test_the_packet_of_a_message_without_a_layout() -> None:
    entry = {
        **RIGHT, "message": UNPRINTED, "form": "undocumented", "dest": 1, "source": 0x50,
        "fields": {}, "data": "AB CD", "printed": "F1 00 02 00 81 50 AB CD",
    }  # fmt: skip
    testee_calls.passes(WITH_UNPRINTED, entry)
    said = testee_calls.failure(WITH_UNPRINTED, {**entry, "printed": "F1 00 02 00 81 50 AB CE"})
    assert "have the packet abce" in said


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"printed": RIGHT["printed"]}, "unexpected pass"),
        ({"encoded": "53 04 06 00 D0 01 01 00 42 0D 03 00"}, "the stated values give"),
        ({"encoded": None}, "`encoded` does not match"),
        ({"printed_is": {}}, "`printed_is` does not describe"),
        (
            {"printed_is": {"rejected": "truncated"}},
            "unexpected pass: decodes as MOT_MOVE_ABSOLUTE",
        ),
        ({"errata": []}, "the name of the erratum is missing"),
        ({"errata": ["no-such"]}, "unknown erratum no-such"),
        ({"printed": "53 04 06 00 D0 01 01 00 41 0D 03"}, "the printed bytes do not decode"),
        (
            {"printed": "53 04 06 00 D0", "printed_is": {"rejected": "trailing"}},
            "refused as truncated, not as trailing",
        ),
    ],
)
def test_an_invalid_erratum_fails(changes: Json, said: str) -> None:
    assert said in failure(erratum(**changes))


def test_an_erratum_with_rejected_bytes() -> None:
    entry = erratum(printed="53 04 06 00 D0", printed_is={"rejected": "truncated"})
    assert "truncated" in passes(entry)


def test_captures() -> None:
    rejected = {
        **RIGHT, "printed": "53 04 06 00 50 01 01 00 40 0D 03 00", "verdict": "rejected",
        "rejected": "trailing", "page": None,
    }  # fmt: skip
    assert "should be 53 04" in passes(rejected, run_capture)
    assert "refused as trailing" in failure({**rejected, "rejected": "truncated"}, run_capture)
    assert "unexpected pass" in failure({**rejected, "printed": RIGHT["printed"]}, run_capture)
    assert "captured bytes are" in failure(
        {**RIGHT, "printed": "53 04 06 00 D0 01 01 00 41 0D 03 00"}, run_capture
    )
    several = {**rejected, "form": None, "rejected": "bad_length"}
    assert "the stated values cannot be used: MOT_MOVE_ABSOLUTE has several" in failure(
        several, run_capture
    )
    unknown = {"printed": "00 00 00 00 50 01", "verdict": "rejected", "rejected": "unknown_message"}
    assert "no message" in passes({"id": "u", "kind": "published", **unknown}, run_capture)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"exact": 200001}, "is 200000 counts, not 200001"),
        ({"counts": 200001}, "is 200000 counts, not 200001"),
        ({"factor": "printed", "counts": 199999}, "no printed number gives 199999"),
        ({"unit": "V"}, "the registry uses mm, and V cannot be converted"),
        ({"quantity": "warp"}, "unknown quantity warp"),
        ({"stage": "Z8"}, "position of Z8 on BBD10x is not in the registry"),
        ({"value": 20, "exact": 400000, "counts": 400000}, "is 400000 counts, the field 200000"),
    ],
)
def test_stated_values(changes: Json, said: str) -> None:
    entry = {**RIGHT, "stated": {"absolute_distance": {**STATED, **changes}}}
    assert said in failure(entry)


def test_the_rounded_factor_and_its_difference_in_counts() -> None:
    entry = {
        "id": "scale", "page": 14, "line": 1, "kind": "scaling", "title": "200 mm/s",
        "verdict": "reproduced",
        "stated": [
            {
                **STATED, "value": 200, "unit": "mm/s", "quantity": "velocity",
                "counts": 26843600, "factor": "printed", "exact": 26843546,
            }
        ],
    }  # fmt: skip
    assert "26843546 counts exactly, 26843600 by the printed factor (+54)" in passes(entry)


def number(**changes: Any) -> Json:
    return {
        "id": "n", "page": 12, "line": 1, "kind": "stream", "title": "n", "verdict": "reproduced",
        "format": "long", "value": 1000000, "printed": "40 42 0F 00", **changes,
    }  # fmt: skip


def test_numbers() -> None:
    passes(number())
    passes(number(value=-1, printed="FF FF FF FF"))
    passes(number(encoded="40 42 0F 00", printed="00 0F 42 40"))
    assert "unexpected pass" in failure(number(encoded="40 42 0F 00"))
    assert "1000000 is 40 42 0F 00" in failure(number(printed="41 42 0F 00"))
    assert "does not fit into" in failure(number(format="word", value=70000))
    assert "no field of the registry" in failure(number(format="quad"))
    assert "requires an integer" in failure(number(value="1.5"))
    assert "`encoded` does not match" in failure(number(verdict="erratum"))


def scaling(**changes: Any) -> Json:
    return {
        "id": "s", "page": 56, "line": 1, "kind": "scaling", "title": "s", "verdict": "reproduced",
        "arithmetic": "512 * 67", "value": "34304", **changes,
    }  # fmt: skip


def test_arithmetic_statements() -> None:
    passes(scaling())
    passes(scaling(arithmetic="1 / 7", value="0.14", rounded_to="0.01"))
    assert "printed is 34303" in passes(scaling(printed_value="34303"))
    assert "unexpected pass" in failure(scaling(printed_value="34304.0"))
    assert "512 * 67 = 34304, not 34303" in failure(scaling(value="34303"))
    assert "neither `equals` nor `value`" in failure(scaling(value=None))
    assert "divides by zero" in failure(scaling(arithmetic="1 / 0"))


def statement(**claim: Any) -> Json:
    return {
        "id": "c", "page": 63, "line": 1, "kind": "statement", "says": "x", "means": "y",
        "verdict": "reproduced", "claim": claim,
    }  # fmt: skip


def test_claims() -> None:
    noted = run_example(APT, statement(prose=True))
    assert noted.outcome == "noted"
    assert not noted.failed
    passes(statement(flag="dc_status_bits.settled", bit_number=14))
    assert "is bit 14" in failure(statement(flag="dc_status_bits.settled", bit_number=13))
    assert "no bit happy" in failure(statement(flag="dc_status_bits.happy", bit_number=1))
    assert "no happy_bits" in failure(statement(flag="happy_bits.x", bit_number=1))
    passes(statement(undefined="MOT_SET_MOVEVELPARAMS"))
    passes(statement(undefined="StopProfiled"))
    assert "has a layout" in failure(statement(undefined="MOT_MOVE_HOME"))
    passes(statement(enum="channel", missing="CHANBOTH_ID"))
    assert "CHAN1" in failure(statement(enum="channel", missing="CHAN1"))
    passes(statement(range="MOT_MOVE_ABSOLUTE.absolute_distance", maximum=2**31 - 1))
    assert "ranges from" in failure(
        statement(range="MOT_MOVE_ABSOLUTE.absolute_distance", maximum=5)
    )
    half = statement(range="MOT_MOVE_ABSOLUTE.absolute_distance", minimum=-(2**31), maximum=5)
    assert "ranges from" in failure(half)
    assert "no field" in failure(statement(range="MOT_MOVE_ABSOLUTE.speed", maximum=5))
    assert "states neither end" in failure(statement(range="MOT_MOVE_ABSOLUTE.absolute_distance"))
    assert "unknown claim" in failure(statement(rumour=1))
    assert "unknown kind of example" in failure({**statement(prose=True), "kind": "rumour"})


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2 + 3 * 4", 14),
        ("(2 + 3) * 4", 20),
        ("0.1 + 0.2", Fraction(3, 10)),
        ("-1 / 3", Fraction(-1, 3)),
    ],
)
def test_arithmetic_is_exact(text: str, value: Fraction) -> None:
    assert evaluate(text) == value


@pytest.mark.parametrize(
    "text",
    [
        "",
        "2 **",
        "2 ** 9",
        "a",
        "f(1)",
        "1 if 1 else 2",
        "1j",
        "True",
        "'1'",
        "1 / 0",
        "9" * 300,
        "1; 2",
    ],
)
def test_other_expressions_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        evaluate(text)


def test_rounding_goes_away_from_zero() -> None:
    assert rounded(Fraction(5, 2), Fraction(1)) == 3
    assert rounded(Fraction(-5, 2), Fraction(1)) == -3
    with pytest.raises(ValueError, match="positive"):
        rounded(Fraction(1), Fraction(0))
