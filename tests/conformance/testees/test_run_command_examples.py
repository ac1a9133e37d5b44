"""The runner on a command protocol: decimal bytes, keys and screens, replies, claims about commands."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest
import testee_calls

from stagewire.errors import UnsupportedError
from stagewire.protocols import Protocol, load_protocol
from stagewire_conformance import Verdict, coverage, run
from stagewire_conformance.examples import run_capture
from stagewire_conformance.framings import codec_of
from stagewire_conformance.keyboard import key_of, keys_of, shown_as
from stagewire_conformance.registry import registry_of

MS2000 = load_protocol("asi_ms2000")
SLUG = "ms2000-size-exceptions"
Json = dict[str, Any]

MOVE: Json = {
    "id": "move", "page": 18, "line": 420, "kind": "tx", "title": "A move",
    "printed": "24 84 03 160 134 01 58", "notation": "decimal",
    "message": "WRITE_TARGET_POSITION", "form": "request", "axis": 24,
    "fields": {"target_position": 100000}, "verdict": "reproduced",
}  # fmt: skip
REPLY: Json = {
    "id": "reply", "page": 5, "line": 140, "kind": "rx", "title": "A position",
    "printed": "A0 86 01", "message": "READ_MOTOR_POSITION", "form": "reply",
    "fields": {"position": 100000}, "verdict": "reproduced",
}  # fmt: skip
SETUP: Json = {
    "id": "setup", "page": 1, "line": 27, "kind": "tx", "title": "A switch",
    "printed": "#FF#41", "notation": "hash", "message": "SWITCH_TO_HIGH_LEVEL", "form": "request",
    "fields": {}, "verdict": "reproduced",
}  # fmt: skip
TYPED: Json = {
    "id": "typed", "page": 5, "line": 153, "kind": "keyboard", "title": "A question",
    "typed": "Ctrl<X>aCtrl<C>:", "message": "READ_MOTOR_POSITION", "form": "request", "axis": 24,
    "fields": {}, "verdict": "reproduced",
}  # fmt: skip
SHOWN: Json = {
    "id": "shown", "page": 4, "line": 121, "kind": "keyboard", "title": "An answer",
    "shown": "b", "message": "READ_STATUS", "form": "reply", "fields": {"status": 0x62},
    "verdict": "reproduced",
}  # fmt: skip
AXIS: Json = {
    "id": "axis", "page": 2, "line": 79, "kind": "keyboard", "title": "A key",
    "typed": "Ctrl<X>", "printed": "24", "notation": "decimal", "axis": 24, "verdict": "reproduced",
}  # fmt: skip


def erratum(entry: Json, **changes: Any) -> Json:
    return {**entry, "verdict": "erratum", "errata": [SLUG], **changes}


failure = partial(testee_calls.failure, MS2000)
passes = partial(testee_calls.passes, MS2000)


@pytest.mark.parametrize("verdict", run(MS2000), ids=lambda verdict: verdict.id)
def test_every_example(verdict: Verdict) -> None:
    prose = verdict.kind == "statement" and verdict.detail.startswith("prose")
    assert verdict.outcome == ("noted" if prose else "passed"), verdict.detail


def test_every_command_has_an_example_or_is_a_dummy() -> None:
    bare = {row.message for row in coverage(MS2000) if not row.examples}
    assert bare == {"READ_START_SPEED", "WRITE_START_SPEED"}


def test_a_protocol_with_an_unknown_framing_is_unsupported() -> None:
    odd = Protocol("odd", "Odd", "odd", messages=(), nameless={})
    with pytest.raises(UnsupportedError, match="no codec supports"):
        codec_of(odd)


# Frames


@pytest.mark.parametrize("entry", [MOVE, REPLY, SETUP], ids=lambda entry: entry["id"])
def test_a_correct_example_passes(entry: Json) -> None:
    passes(entry)


@pytest.mark.parametrize(
    ("entry", "changes", "said"),
    [
        (MOVE, {"printed": "24 84 03 161 134 01 58"}, "the stated values give"),
        (MOVE, {"notation": "decimal", "printed": "24 84 03 160 134 01"}, "do not decode"),
        (MOVE, {"axis": 25}, "have axis 24, expected 25"),
        (MOVE, {"axis": None}, "lacks axis"),
        (MOVE, {"axis": 58}, "do not encode"),
        (MOVE, {"extra": "00"}, "have extra bytes (none)"),
        (MOVE, {"fields": {"target_position": 100001}}, "expected 100001"),
        (MOVE, {"fields": {"target_position": 2**23}}, "do not encode"),
        (MOVE, {"message": "WRITE_MOTOR_POSITION", "fields": {"position": 100000}}, "have message"),
        (MOVE, {"form": "request:without_size"}, "do not encode"),
        (MOVE, {"form": "reply", "axis": None}, "do not encode"),
        (MOVE, {"errata": ["no-such"]}, "unknown erratum no-such"),
        (REPLY, {"printed": "A0 86 02"}, "the stated values give"),
        (REPLY, {"printed": "A0 86"}, "the printed bytes do not decode"),
        (REPLY, {"fields": {}}, "lacks position"),
        (REPLY, {"message": "START_MOTOR", "fields": {}}, "do not encode"),
        (SETUP, {"printed": "#FF#42"}, "have message SWITCH_TO_LOW_LEVEL"),
        (SETUP, {"message": "WRITE_MOTOR_POSITION"}, "do not encode"),
        (SETUP, {"axis": 24}, "do not encode"),
    ],
)  # fmt: skip
def test_a_wrong_example_of_a_command_fails(entry: Json, changes: Json, said: str) -> None:
    assert said in failure({**entry, **changes})


def test_errata_of_both_kinds() -> None:
    short = erratum(
        MOVE, message="READ_IDENTIFICATION", fields={}, printed="24 105 58", encoded="24 105 06 58",
        printed_is={"decodes": {"form": "request:without_size", "axis": 24, "fields": {}}},
    )  # fmt: skip
    passes(short)
    wrong = {"decodes": {"form": "request", "axis": 24, "fields": {}}}
    assert "have form request:without_size" in failure({**short, "printed_is": wrong})
    assert "unexpected pass" in failure({**short, "printed": short["encoded"]})
    refused = {**short, "printed": "24 105 03 58", "printed_is": {"rejected": "bad_length"}}
    assert "READ_IDENTIFICATION" in passes(refused)
    assert "unexpected pass: decodes as READ_IDENTIFICATION" in failure(
        {**short, "printed_is": {"rejected": "bad_length"}}
    )


def test_a_rejected_reply_is_decoded_as_a_reply() -> None:
    """``A0 86 01 3A`` is not a command, but it must be decoded as a reply."""
    printed = f"{REPLY['printed']} 3A"
    wrong = erratum(REPLY, printed=printed, encoded=REPLY["printed"])
    capture = {**REPLY, "page": None, "printed": printed, "verdict": "rejected"}
    assert "READ_MOTOR_POSITION" in passes({**wrong, "printed_is": {"rejected": "trailing"}})
    assert "should be A0 86 01" in passes({**capture, "rejected": "trailing"}, run_capture)
    as_a_command = "refused as trailing, not as unknown_message"
    assert as_a_command in failure({**wrong, "printed_is": {"rejected": "unknown_message"}})
    assert as_a_command in failure({**capture, "rejected": "unknown_message"}, run_capture)


def test_stated_values_in_compound_units() -> None:
    stated = {
        "value": "0.59", "unit": "mm/s", "quantity": "speed", "counts": 590, "factor": "exact",
        "exact": 590,
    }  # fmt: skip
    entry = {
        "id": "s", "page": 9, "line": 247, "kind": "scaling", "title": "s", "verdict": "reproduced",
        "stated": [stated],
    }  # fmt: skip
    passes(entry)
    assert "590 counts, not 591" in failure({**entry, "stated": [{**stated, "counts": 591}]})
    for unit in ("mm", "mm/ms", "mm/s^2", "ms", "V/s"):
        assert f"{unit} cannot be converted" in failure(
            {**entry, "stated": [{**stated, "unit": unit}]}
        )


def test_numbers_in_decimal() -> None:
    entry = {
        "id": "n", "page": 8, "line": 220, "kind": "stream", "title": "n", "verdict": "reproduced",
        "printed": "160 134 1", "notation": "decimal", "format": "s24", "value": 100000,
    }  # fmt: skip
    passes(entry)
    passes({**entry, "printed": "255 255 255", "value": -1})
    assert "100000 is A0 86 01, not 0A 01 02" in failure({**entry, "printed": "10 1 2"})
    passes(erratum(entry, printed="10 1 2", encoded="160 134 1"))


def test_numbers_taken_apart() -> None:
    entry = {
        "id": "s", "page": 17, "line": 407, "kind": "scaling", "title": "s", "verdict": "reproduced",
        "arithmetic": "100000 // 256 % 256", "value": 134,
    }  # fmt: skip
    passes(entry)
    assert "= 134.625, not 134" in failure({**entry, "arithmetic": "100000 / 256 % 256"})
    passes({**entry, "arithmetic": "-7 // 2", "value": -4})
    assert "divides by zero" in failure({**entry, "arithmetic": "1 % 0"})
    assert "divides by zero" in failure({**entry, "arithmetic": "1 // 0"})


# Keys and screens


@pytest.mark.parametrize(
    ("text", "raw"),
    [
        ("Ctrl<X>?:", "183f3a"),
        ("Alt[255] 'A'", "ff41"),
        ("ESC", "1b"),
        ("Ctrl<[>", "1b"),
        ("'E' S C", "455343"),
        ("' '", "20"),
        ("<X>", "3c583e"),
        ("", ""),
    ],
)
def test_keys(text: str, raw: str) -> None:
    assert bytes(key.byte for key in keys_of(text)).hex() == raw


@pytest.mark.parametrize("text", ["Alt[256]", "Alt[9999]", "€"])
def test_keys_that_send_no_byte_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="does not send a byte"):
        keys_of(text)
    assert "does not send a byte" in failure({**TYPED, "typed": text})


def test_every_byte_has_a_key_with_one_spelling() -> None:
    spellings = [key_of(byte).spelling for byte in range(256)]
    assert len(set(spellings)) == 256
    for byte, spelling in enumerate(spellings):
        assert keys_of(spelling) == [key_of(byte)]
    assert keys_of(" ".join(spellings)) == [key_of(byte) for byte in range(256)]


def test_screens() -> None:
    assert shown_as(b"EMOT :", "ascii") == "EMOT :"
    assert shown_as(bytes((160, 134, 1)), "cp437") == "áå_"
    assert shown_as(bytes((65, 160, 27)), "ascii") == "A__"


@pytest.mark.parametrize("entry", [TYPED, SHOWN, AXIS], ids=lambda entry: entry["id"])
def test_a_correct_example_of_keys_or_screens_passes(entry: Json) -> None:
    passes(entry)


@pytest.mark.parametrize(
    ("entry", "changes", "said"),
    [
        (TYPED, {"typed": "Ctrl<X>bCtrl<C>:"}, "the typed bytes are 18 62 03 3A"),
        (TYPED, {"typed": "Ctrl<X>aCtrl<C>"}, "typed bytes do not decode"),
        (TYPED, {"typed": "<X>a<C>:"}, "those of the registry Ctrl<X> a Ctrl<C> :"),
        (TYPED, {"typed": "Alt[24]aCtrl<C>:", "axis": 25}, "the stated values give"),
        (TYPED, {"form": "request:without_size"}, "the stated values give"),
        (TYPED, {"axis": None}, "do not encode"),
        (SHOWN, {"shown": "B"}, "a terminal shows 'b', not 'B'"),
        (SHOWN, {"shown": " b"}, "a terminal shows 'b', not ' b'"),
        (SHOWN, {"shown": "_"}, "a terminal shows 'b', not '_'"),
        (SHOWN, {"fields": {"status": 0x42}}, "a terminal shows 'B', not 'b'"),
        (SHOWN, {"fields": {"status": 256}}, "do not encode"),
        (AXIS, {"typed": "Ctrl<Y>"}, "Ctrl<Y> sends 19, not 18"),
        (AXIS, {"printed": "25"}, "Ctrl<X> sends 18, not 19"),
        (AXIS, {"axis": 25}, "18 is not axis 25"),
        (AXIS, {"typed": "Ctrl<B>", "printed": "02", "axis": 2}, "the registry has no key for"),
        (AXIS, {"typed": "Ctrl<X>Ctrl<Y>"}, "sends 18 19, not 18"),
    ],
)  # fmt: skip
def test_a_wrong_example_of_keys_or_screens_fails(entry: Json, changes: Json, said: str) -> None:
    assert said in failure({**entry, **changes})


def test_errata_of_keys_and_screens() -> None:
    typed = erratum(TYPED, typed="<X>a<C>:", corrected=TYPED["typed"])
    passes(typed)
    assert "unexpected pass" in failure({**typed, "typed": TYPED["typed"]})
    assert "typed keys are" in failure({**typed, "corrected": "<X>a<C>:"})
    assert "the name of the erratum is missing" in failure({**typed, "errata": []})
    assert "`corrected` is missing" in failure(erratum(TYPED))
    shown = erratum(SHOWN, shown=" b", corrected="b")
    passes(shown)
    assert "unexpected pass" in failure({**shown, "shown": "b"})
    assert "a terminal shows" in failure({**shown, "corrected": "B"})
    key = erratum(AXIS, typed="Ctrl<S>", printed="03", axis=19, encoded="19")
    passes(key)
    assert "unexpected pass" in failure({**key, "printed": "19"})
    assert "sends 13, not 03" in failure({**key, "encoded": "03"})


def test_an_unreadable_screen_is_not_converted_back() -> None:
    """Unreadable characters are compared as displayed, but not converted back to bytes."""
    entry = {
        **SHOWN, "message": "READ_MOTOR_POSITION", "fields": {"position": 100000},
        "shown": "áå_", "code_page": "cp437",
    }  # fmt: skip
    passes(entry)
    assert "shows 'áå_', not 'áâ_'" in failure({**entry, "shown": "áâ_"})


@pytest.mark.parametrize(
    ("entry", "kind", "name", "said"),
    [
        (
            TYPED,
            "messages",
            "READ_MOTOR_POSITION",
            "those of the registry Ctrl<X> Ctrl<B> Ctrl<C> :",
        ),
        (TYPED, "axis", "X", "those of the registry Ctrl<B> a Ctrl<C> :"),
        (AXIS, "axis", "X", "those of the registry Ctrl<B>"),
    ],
)
def test_keys_are_those_of_the_registry(
    entry: Json, kind: str, name: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    registry = registry_of(MS2000)
    axes = registry.table("enumerations")["axis"]["values"]
    stated = registry.messages if kind == "messages" else axes
    monkeypatch.setitem(stated[name], "keyboard", "Ctrl<B>")
    assert said in failure(entry)


def test_a_readable_screen_is_converted_back(monkeypatch: pytest.MonkeyPatch) -> None:
    codec = codec_of(MS2000)
    read = codec.decode(b"B", codec.reading(SHOWN))
    monkeypatch.setattr(codec, "decode", lambda raw, request: read)
    assert "the shown bytes have status 66, expected 98" in failure(SHOWN)


# Claims


def statement(**claim: Any) -> Json:
    return {
        "id": "c", "page": 2, "line": 94, "kind": "statement", "says": "x", "means": "y",
        "verdict": "reproduced", "claim": claim,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("claim", "wrong", "said"),
    [
        ({"flag": "status_bits.upper_limit", "bit": 6}, {"bit": 7}, "is bit 6 counted from zero"),
        ({"flag": "status_bits.upper_limit", "bit_number": 7}, {"bit_number": 6}, "counted from one"),
        ({"flag": "status_bits.servo", "of": 20, "set": False}, {"set": True}, "is clear in 20"),
        ({"flag": "status_bits.servo", "of": 138, "set": True}, {"of": 20}, "is clear in 20"),
        ({"enum": "axis", "member": "SCAN", "value": 19}, {"value": 3}, "has 19 for SCAN"),
        ({"enum": "axis", "member": "SCAN", "value": 19}, {"member": "W"}, "axis has no W"),
        (
            {"format": "READ_CURRENT_SPEED.speed", "size": 2, "signed": True},
            {"signed": False},
            "has 2 bytes with a sign",
        ),
        (
            {"format": "READ_MAXIMUM_SPEED.maximum_speed", "size": 2, "signed": False},
            {"size": 3},
            "has 2 bytes without a sign",
        ),
        ({"sizes": {"minimum": 0, "maximum": 6}}, {"sizes": {"minimum": 1, "maximum": 6}}, "from 0"),
        (
            {"without_size": ["READ_STATUS", "START_MOTOR", "STOP_MOTOR"]},
            {"without_size": ["READ_STATUS"]},
            "are READ_STATUS, START_MOTOR, STOP_MOTOR",
        ),
        (
            {"dummies": ["READ_START_SPEED", "WRITE_START_SPEED"]},
            {"dummies": ["READ_START_SPEED"]},
            "are READ_START_SPEED, WRITE_START_SPEED",
        ),
        ({"unanswered": "START_MOTOR"}, {"unanswered": "READ_STATUS"}, "has a reply"),
        ({"unanswered": "START_MOTOR"}, {"unanswered": "READ_MINDS"}, "no message READ_MINDS"),
        (
            {"command": "SWITCH_TO_LOW_LEVEL", "switches_to": "low_level"},
            {"switches_to": "high_level"},
            "SWITCH_TO_LOW_LEVEL switches to low_level",
        ),
        (
            {"command": "RESET_CONTROLLER", "switches_to": "power_on"},
            {"command": "WHERE_IN_TENTHS"},
            "does not change the format",
        ),
        ({"firmware": "3.3", "message": "STOP_MOTOR"}, {"firmware": "3.2"}, "for firmware 3.3"),
        ({"firmware": "3.2"}, {"firmware": "9.9"}, "about the protocol"),
        (
            {"stream": "18 3F 3A 18 3A", "events": ["message", "garbage"]},
            {"events": ["message"]},
            "is message, garbage",
        ),
        ({"stream": "18 3F 3A", "events": ["message"]}, {"stream": "18 3F 3A 18"}, "incomplete bytes"),
        (
            {"stream": "18 3F 3A", "events": ["message"], "enum": "axis", "member": "X", "value": 24},
            {"value": 25},
            "has 24 for X",
        ),
        (
            {"enum": "busy", "member": "BUSY", "value": 66, "firmware": "3.2"},
            {"firmware": "9.9"},
            "has 66 for BUSY",
        ),
    ],
)  # fmt: skip
def test_claims(claim: Json, wrong: Json, said: str) -> None:
    passes(statement(**claim))
    assert said in failure(statement(**{**claim, **wrong}))


def test_claims_of_commands_where_there_are_none() -> None:
    apt = load_protocol("thorlabs_apt")
    for claim in ({"sizes": {}}, {"without_size": []}, {"dummies": []}):
        assert testee_calls.failure(apt, statement(**claim)) == "the registry has no commands"
