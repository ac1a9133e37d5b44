"""What a user writes for the worked examples of the documents puts the documents' bytes on the wire.

``worked_calls/`` has the calls, ``conformance/examples/`` the bytes, which nothing of ours has made.
"""

from __future__ import annotations

import ast
from fractions import Fraction
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml
from proof_calls import registry
from proof_line import SIDES, FarEnd, Side, settled

from stagewire import End
from stagewire.errors import UnknownScaleError
from stagewire.protocol import load_protocol
from stagewire_conformance.hexes import octets

ROOT = Path(__file__).parents[2]
CALLS = Path(__file__).parent / "worked_calls"
PROTOCOLS = ["thorlabs_apt", "asi_ms2000"]


@cache
def read(folder: Path, protocol: str) -> Any:
    return yaml.safe_load((folder / f"{protocol}.yaml").read_text(encoding="utf-8"))


def examples(protocol: str) -> dict[str, Any]:
    found: dict[str, Any] = read(ROOT / "conformance/examples", protocol)["examples"]
    return found


def entries(protocol: str, **having: Any) -> list[Any]:
    table = read(CALLS, protocol)["calls"]
    return [
        pytest.param(protocol, name, entry, id=f"{protocol}-{name}")
        for name, entry in table.items()
        if all((key in entry) is wanted for key, wanted in having.items())
    ]


def all_entries(**having: Any) -> list[Any]:
    return [entry for protocol in PROTOCOLS for entry in entries(protocol, **having)]


def correct(protocol: str, name: str) -> bytes:
    """The bytes of an example, corrected where the document is wrong."""
    entry = examples(protocol)[name]
    if "shown" in entry:  # by a terminal; the reply is a letter or a word
        return str(entry.get("corrected", entry["shown"])).encode("ascii")
    return octets(entry, "encoded" if "encoded" in entry else "printed")


def made(protocol: str, what: Any, source: int | None, own: str) -> bytes:
    """The bytes of an answer: an example's, or those of a message and its fields."""
    if what is True:
        return correct(protocol, own)
    if isinstance(what, str):
        known = what in examples(protocol)
        return correct(protocol, what) if known else bytes.fromhex(what)
    [(message, fields)] = what.items()
    return frame_of(message, source or 0x50, **fields)


def frame_of(message: str, source: int, **given: Any) -> bytes:
    """A frame to the host; what is not given is 0."""
    apt = load_protocol("thorlabs_apt")
    cls = next(
        cls
        for cls in apt.messages
        if cls.layout.message == message
        and not cls.layout.when
        and "undecided" not in cls.layout.form
    )
    blank = {"software_version": bytes(4), "model_number": "", "notes": ""}
    fields = {name: given.get(name, blank.get(name, 0)) for name in cls.layout.fields}
    return cls(**fields).pack(dest=0x01, source=source)


def tables_of(protocol: str) -> dict[str, Any]:
    """What the texts of calls and values call e, f and m."""
    package = load_protocol(protocol).package
    rooms = ("enumerations", "flags", "messages")
    return {room[0]: import_module(f"{package}.{room}") for room in rooms}


class Recorder(FarEnd):
    """Keeps what is written, but for what keeps a session alive, and says what it was told to, once."""

    def __init__(self, protocol: str) -> None:
        self._framer = load_protocol(protocol).framer(*[End.DEVICE] * (protocol == "thorlabs_apt"))
        self.heard: list[Any] = []
        self.kept_alive: list[bytes] = []
        self.to_say: list[bytes] = []

    def take(self, data: bytes) -> list[tuple[float, bytes]]:
        said = []
        for event in self._framer.feed(data):
            if b"_ACK_" in type(event.frame.message).layout.message.encode():
                self.kept_alive.append(event.raw)
                continue
            self.heard.append(event)
            said += [(0.01, answer) for answer in self.to_say]
            self.to_say.clear()
        return said

    def raw(self) -> bytes:
        return b"".join(event.raw for event in self.heard)


def perform(side: Side, protocol: str, entry: Any, *answers: bytes, wait: float = 0.0) -> Any:
    """Open the unit of an entry, make its call, and return what it gives and who was at the other end."""
    package = load_protocol(protocol).package
    far = Recorder(protocol)
    options = dict(entry.get("open", {}))
    if "stage" in options:
        options["stage"] = getattr(import_module(f"{package}.stages"), options["stage"])
    names = tables_of(protocol)

    async def scenario(bench: Any) -> Any:
        if protocol == "thorlabs_apt":
            options["identify"] = False
        async with bench.open(entry["unit"], package, on_close="leave", **options) as device:
            if ".axis(" in entry["call"]:
                await settled(device.switch_to_low_level())
            far.heard.clear()
            far.to_say += answers
            call = compile(entry["call"].strip(), entry["call"], "eval")
            value = await settled(eval(call, {**names, entry["unit"].lower(): device}))
            if entry.get("unasked"):
                far.say(answers[0])
                far.to_say.clear()
                value = await settled(value.get(1.0))
            if wait:
                await bench.sleep(wait)
            return value, far, list(far.heard)

    return side.run(far, scenario)


def expected(protocol: str, name: str, entry: Any) -> bytes:
    sends = entry.get("sends", name)
    return correct(protocol, sends) if sends in examples(protocol) else bytes.fromhex(sends)


def replies(protocol: str, name: str, entry: Any) -> list[bytes]:
    if "answer" in entry:
        return [made(protocol, entry["answer"], entry.get("source"), name)]
    if "ends" in entry:
        dest = (
            correct(protocol, entry.get("sends", name))[4] & 0x7F if "counts" not in entry else 0x22
        )
        return [frame_of(entry["ends"], dest, chan_ident=1)]
    return []


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(
    ("protocol", "name", "entry"), all_entries(counts=False, keep_alive=False, unasked=False)
)
def test_the_call_puts_the_bytes_of_the_example_on_the_wire(
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
def test_the_answer_gives_the_values_that_the_example_states(
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
    """Half the digit that the document rounds to; half a count where it does not say."""
    if "rounded_to" in entry:
        return Fraction(str(entry["rounded_to"])) / 2
    field = vars(type(values))[attribute].field
    counts = getattr(values.message, field)
    return abs(values.exact(attribute) / counts) / 2 if counts else Fraction(0)


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(("protocol", "name", "entry"), all_entries(keep_alive=True))
def test_an_open_device_keeps_its_session_alive_with_the_bytes_of_the_example(
    side: Side, protocol: str, name: str, entry: Any
) -> None:
    _, far, _ = perform(side, protocol, entry, wait=0.99)
    assert correct(protocol, name) in far.kept_alive


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize(("protocol", "name", "entry"), all_entries(unasked=True))
def test_what_comes_unasked_goes_to_who_subscribed(
    side: Side, protocol: str, name: str, entry: Any
) -> None:
    event, _, _ = perform(side, protocol, entry, correct(protocol, name))
    assert event.raw == correct(protocol, name)


def read_back() -> list[Any]:
    """The entries that write what their unit can be asked for."""
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
def test_what_was_set_reads_back_as_it_was_written(
    side: Side, protocol: str, name: str, entry: Any
) -> None:
    """The packet of an example, said by the controller as its GET, gives what the call was given."""
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


# The table itself


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_every_example_has_its_call_or_a_reason_why_it_has_none(protocol: str) -> None:
    table = read(CALLS, protocol)
    others = [name for group in table["others"] for name in group["examples"]]
    assert all(group["reason"] for group in table["others"])
    assert len(others) == len(set(others))
    assert set(others) & set(table["calls"]) == set()
    assert set(others) | set(table["calls"]) == set(examples(protocol))


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_every_example_with_values_in_units_has_its_call(protocol: str) -> None:
    table = read(CALLS, protocol)["calls"]
    assert [
        name
        for name, entry in examples(protocol).items()
        if "stated" in entry and name not in table
    ] == []


def differences(entry: Any) -> dict[str, int]:
    """By how much the exact counts of an example differ from those that the document computes."""
    stated = entry.get("stated", {})
    found = (
        {}
        if isinstance(stated, list)
        else {field: item["exact"] - item["counts"] for field, item in stated.items()}
    )
    return {field: by for field, by in found.items() if by}


@pytest.mark.parametrize(("protocol", "name", "entry"), all_entries())
def test_where_the_document_used_a_rounded_factor_the_difference_is_stated(
    protocol: str, name: str, entry: Any
) -> None:
    assert entry.get("difference", {}) == differences(examples(protocol)[name])


def test_the_counts_of_a_difference_are_those_on_the_wire() -> None:
    """So that 99 mm/s are 13,287,555 counts here, and not the 13,287,582 of the rounded factor."""
    _, _, [event] = perform(
        SIDES[0], "thorlabs_apt", read(CALLS, "thorlabs_apt")["calls"]["velparams-set"]
    )
    assert event.frame.message.max_velocity == 13_287_582 - 27
