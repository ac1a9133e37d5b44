"""Calls for the worked examples of the documents send exactly the bytes in the documents.

The calls are in ``worked_calls/``, and the bytes, transcribed from the documents, in
``spec/*/examples.yaml``.
"""

from __future__ import annotations

import ast
from fractions import Fraction
from typing import Any

import pytest
from proof_calls import registry
from proof_examples import (
    CALLS,
    correct,
    examples,
    expected,
    frame_of,
    perform,
    read,
    replies,
    tables_of,
)
from proof_line import SIDES, Side

from stagewire.errors import UnknownScaleError
from stagewire_apt import PROTOCOL

PROTOCOLS = ["thorlabs_apt", "asi_ms2000"]


def entries(protocol: str, **having: Any) -> list[Any]:
    table = read(CALLS, protocol)["calls"]
    return [
        pytest.param(protocol, name, entry, id=f"{protocol}-{name}")
        for name, entry in table.items()
        if all((key in entry) is wanted for key, wanted in having.items())
    ]


def all_entries(**having: Any) -> list[Any]:
    return [entry for protocol in PROTOCOLS for entry in entries(protocol, **having)]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(
    ("protocol", "name", "entry"), all_entries(counts=False, keep_alive=False, unasked=False)
)
def test_the_call_sends_the_bytes_of_the_example(
    side: Side, protocol: str, name: str, entry: Any
) -> None:
    _, _, heard = perform(side, protocol, entry, *replies(protocol, name, entry))
    assert b"".join(event.raw for event in heard).hex(" ") == expected(protocol, name, entry).hex(
        " "
    )


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(("protocol", "name", "entry"), all_entries(counts=True))
def test_the_call_sends_the_counts_that_the_prose_states(
    side: Side, protocol: str, name: str, entry: Any
) -> None:
    _, _, [event] = perform(side, protocol, entry, *replies(protocol, name, entry))
    sent = {field: getattr(event.frame.message, field) for field in entry["counts"]}
    assert sent == entry["counts"]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(("protocol", "name", "entry"), all_entries(gives=True))
def test_the_answer_has_the_values_that_the_example_states(
    side: Side, protocol: str, name: str, entry: Any
) -> None:
    values, _, _ = perform(side, protocol, entry, *replies(protocol, name, entry))
    for attribute, stated in entry["gives"].items():
        if isinstance(stated, str) and stated.startswith(("e.", 'b"')):
            stated = eval(stated, tables_of(protocol))
        value = values
        for step in attribute.split("."):
            value = getattr(value, step)
        if isinstance(stated, bool) or not isinstance(stated, (int, float)):
            assert value == stated, attribute
        elif hasattr(type(values), attribute) and isinstance(value, float):
            assert abs(Fraction(value) - Fraction(str(stated))) <= tolerance(
                values, attribute, entry
            )
        else:
            assert int(value) == stated, attribute


def tolerance(values: Any, attribute: str, entry: Any) -> Fraction:
    """Return half the last digit of a rounded value in the document, or else half a count."""
    if "rounded_to" in entry:
        return Fraction(str(entry["rounded_to"])) / 2
    field = vars(type(values))[attribute].field
    counts = getattr(values.message, field)
    return abs(values.exact(attribute) / counts) / 2 if counts else Fraction(0)


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(("protocol", "name", "entry"), all_entries(keep_alive=True))
def test_an_open_device_sends_the_keep_alive_message_of_the_example(
    side: Side, protocol: str, name: str, entry: Any
) -> None:
    _, far, _ = perform(side, protocol, entry, wait=0.99)
    assert correct(protocol, name) in far.kept_alive


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(("protocol", "name", "entry"), all_entries(unasked=True))
def test_an_unsolicited_message_is_delivered_to_a_subscription(
    side: Side, protocol: str, name: str, entry: Any
) -> None:
    said = correct(protocol, name)
    message, _, _ = perform(side, protocol, entry, said)
    assert message == PROTOCOL.decode(said).message


def read_back() -> list[Any]:
    """Return the entries that write values which can also be read."""
    messages = {unit["name"]: unit["messages"] for unit in registry()["units"]}
    found = []
    for entry in entries("thorlabs_apt", answer=False, counts=False, ends=False, keep_alive=False):
        _, name, call = entry.values
        message = examples("thorlabs_apt")[name]["message"]
        if "_SET_" in message and message.replace("_SET_", "_REQ_") in messages[call["unit"]]:
            found.append(entry)
    return found


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(("protocol", "name", "entry"), read_back())
def test_a_written_value_reads_back_unchanged(
    side: Side, protocol: str, name: str, entry: Any
) -> None:
    """The packet of a SET example, sent back as the GET message, has the values of the call."""
    call = ast.parse(entry["call"].strip(), mode="eval").body
    assert isinstance(call, ast.Call)
    example = examples(protocol)[name]
    source = correct(protocol, name)[4] & 0x7F
    answer = frame_of(example["message"].replace("_SET_", "_GET_"), source, **example["fields"])
    getter = ast.unparse(call.func).replace(".set_", ".get_") + "()"
    values, _, _ = perform(side, protocol, {**entry, "call": getter}, answer)
    for keyword in call.keywords:
        assert keyword.arg is not None
        if keyword.arg in entry.get("unread", ()):
            with pytest.raises(UnknownScaleError):
                getattr(values, keyword.arg)
            continue
        given = eval(compile(ast.Expression(keyword.value), name, "eval"), tables_of(protocol))
        value = getattr(values, keyword.arg)
        if isinstance(value, float):
            assert abs(Fraction(value) - Fraction(str(given))) <= tolerance(values, keyword.arg, {})
        else:
            assert value == given, keyword.arg


# The table of calls


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_every_example_has_a_call_or_a_reason_for_having_none(protocol: str) -> None:
    table = read(CALLS, protocol)
    others = [name for group in table["others"] for name in group["examples"]]
    assert all(group["reason"] for group in table["others"])
    assert len(others) == len(set(others))
    assert set(others) & set(table["calls"]) == set()
    assert set(others) | set(table["calls"]) == set(examples(protocol))


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_every_example_with_values_in_units_has_a_call(protocol: str) -> None:
    table = read(CALLS, protocol)["calls"]
    assert [
        name
        for name, entry in examples(protocol).items()
        if "stated" in entry and name not in table
    ] == []


def differences(entry: Any) -> dict[str, int]:
    """Return the differences between the exact counts of an example and those in the document."""
    stated = entry.get("stated", {})
    found = (
        {}
        if isinstance(stated, list)
        else {field: item["exact"] - item["counts"] for field, item in stated.items()}
    )
    return {field: by for field, by in found.items() if by}


@pytest.mark.parametrize(("protocol", "name", "entry"), all_entries())
def test_the_difference_caused_by_a_rounded_factor_is_stated(
    protocol: str, name: str, entry: Any
) -> None:
    assert entry.get("difference", {}) == differences(examples(protocol)[name])


def test_the_exact_counts_are_sent() -> None:
    """99 mm/s are 13,287,555 counts, not the 13,287,582 of the rounded factor."""
    _, _, [event] = perform(
        SIDES[0], "thorlabs_apt", read(CALLS, "thorlabs_apt")["calls"]["velparams-set"]
    )
    assert event.frame.message.max_velocity == 13_287_582 - 27
