"""The registry of the MS-2000, compared with facts typed by hand from the document, mostly in decimal."""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Any

import pytest

from checkout import ROOT

Json = dict[str, Any]
REGISTRY: Json = json.loads(
    (ROOT / "generated/python/stagewire_ms2000/registry.json").read_text("utf-8")
)
MESSAGES: dict[str, Json] = {message["name"]: message for message in REGISTRY["messages"]}

# Number of the section, name, byte, key, data size, bytes of data sent, bytes of the reply.
COMMANDS = """
     4  READ_STATUS                      63  ?  none  0  1
     5  READ_MOTOR_POSITION              97  a     3  0  3
     6  READ_INCREMENT_VALUE            100  d     3  0  3
     7  READ_IDENTIFICATION             105  i     6  0  6
     8  READ_MOTOR_POSITION_AND_STATUS  108  l     4  0  4
     9  READ_CURRENT_SPEED              111  o     2  0  2
    10  READ_RAMP_TIME                  113  q     1  0  1
    11  READ_START_SPEED                114  r     2  0  2
    12  READ_MAXIMUM_SPEED              115  s     2  0  2
    13  READ_TARGET_POSITION            116  t     3  0  3
    14  READ_STATUS_BYTE                126  ~     1  0  1
    15  START_MOTOR                      71  G  none  0  0
    16  STOP_MOTOR                       66  B  none  0  0
    17  WRITE_MOTOR_POSITION             65  A     3  3  0
    18  WRITE_TARGET_POSITION            84  T     3  3  0
    19  INCREMENT_MOVE_UP                43  +     0  0  0
    20  INCREMENT_MOVE_DOWN              45  -     0  0  0
    21  WRITE_INCREMENT_VALUE            68  D     3  3  0
    22  WRITE_RAMPING_TIME               81  Q     1  1  0
    23  WRITE_START_SPEED                82  R     2  2  0
    24  WRITE_TOP_SPEED                  83  S     2  2  0
    25  WRITE_VECTOR_SPEED               94  ^     2  2  0
    26  JOYSTICK_ENABLE                  74  J     0  0  0
    27  JOYSTICK_DISABLE                 75  K     0  0  0
"""
ROWS = [line.split() for line in COMMANDS.split("\n") if line.strip()]

SETUP = {
    "SWITCH_TO_HIGH_LEVEL": (65, "A"),
    "SWITCH_TO_LOW_LEVEL": (66, "B"),
    "RESET_CONTROLLER": (82, "R"),
    "WHERE_IN_HUNDREDTHS": (72, "H"),
    "WHERE_IN_TENTHS": (84, "T"),
}

SWITCHES = {
    "SWITCH_TO_HIGH_LEVEL": "high_level",
    "SWITCH_TO_LOW_LEVEL": "low_level",
    "RESET_CONTROLLER": "power_on",
}

AXES = {
    "X": (24, "Ctrl<X>", False),
    "Y": (25, "Ctrl<Y>", False),
    "Z": (26, "Ctrl<Z>", False),
    "F": (27, "ESC", False),
    "AUTOFOCUS": (1, "Ctrl<A>", True),
    "CONTROLLER": (3, "Ctrl<C>", True),
    "SCAN": (19, "Ctrl<S>", True),  # printed 03, which is the controller
}

BITS = {
    "motor_signal": 0,
    "servo": 1,
    "pulses": 2,
    "joystick_enabled": 3,
    "ramping": 4,
    "ramping_down": 5,
    "upper_limit": 6,
    "lower_limit": 7,
}

S24 = (3, True, -(2**23), 2**23 - 1)
U16 = (2, False, 0, 65535)
BYTE = (1, False, 0, 255)
TENTHS = ("counts_per_um", 10)
SPEED = ("counts_per_um_per_s", 1)
TIME = ("counts_per_ms", 1)

# Size, sign and range; scale.
FIELDS = {
    "READ_STATUS.reply.status": (*BYTE, None, None),
    "READ_MOTOR_POSITION.reply.position": (*S24, *TENTHS),
    "READ_INCREMENT_VALUE.reply.increment": (*S24, *TENTHS),
    "READ_IDENTIFICATION.reply.identification": (6, False, None, None, None, None),
    "READ_MOTOR_POSITION_AND_STATUS.reply.position": (*S24, *TENTHS),
    "READ_MOTOR_POSITION_AND_STATUS.reply.status": (*BYTE, None, None),
    "READ_CURRENT_SPEED.reply.speed": (2, True, -32768, 32767, *SPEED),
    "READ_RAMP_TIME.reply.ramp_time": (1, False, 1, 255, *TIME),
    "READ_START_SPEED.reply.start_speed": (*U16, None, None),
    "READ_MAXIMUM_SPEED.reply.maximum_speed": (*U16, *SPEED),
    "READ_TARGET_POSITION.reply.target_position": (*S24, *TENTHS),
    "READ_STATUS_BYTE.reply.status": (*BYTE, None, None),
    "WRITE_MOTOR_POSITION.request.position": (*S24, *TENTHS),
    "WRITE_TARGET_POSITION.request.target_position": (*S24, *TENTHS),
    "WRITE_INCREMENT_VALUE.request.increment": (*S24, *TENTHS),
    "WRITE_RAMPING_TIME.request.ramp_time": (1, False, 1, 255, *TIME),
    "WRITE_START_SPEED.request.start_speed": (*U16, None, None),
    "WRITE_TOP_SPEED.request.top_speed": (*U16, *SPEED),
    "WRITE_VECTOR_SPEED.request.vector_speed": (2, False, 0, 32767, *SPEED),
}

# Contradictions in the document that affect bytes or their meaning.
WIRE = """
    colon-in-data identification-example-size identification-sixth-byte maximum-speed-example-command
    position-status-example-bytes position-status-example-size ramp-time-range reserved-scan-identifier
    start-stop-data-size status-byte-example-size stop-motor-example-command
"""
MEANING = """
    blanks data-of-reads data-size-statements dummy-data joystick-disable-example-command no-reply-unsaid
    position-status-example-command position-status-example-status ramp-from-start-speed
    ramp-time-example-advice reverse-conversion-remainder servo-always-on size-exceptions
    status-busy status-byte-example-limits status-byte-example-ramping twos-complement vector-speed-sign
"""


def by_form(message: Json) -> dict[str, Json]:
    return {layout["form"]: layout for layout in message["layouts"]}


def typed(key: str) -> int:
    """Return the byte that a key enters in ASCII."""
    if key == "ESC":
        return 27
    return ord(key[5]) - 64 if key.startswith("Ctrl<") else ord(key)


def scale(field: Json) -> tuple[str | None, Fraction | None]:
    """Return the key of the scale, whose name contains unit and direction, and the factor."""
    for key, factor in (field["scale"] or {}).items():
        if key.startswith("counts_per_"):
            assert key == f"counts_per_{field['unit'].replace('/', '_per_')}"
            return key, Fraction(factor["numerator"], factor["denominator"])
    return None, None


def test_the_registry_has_exactly_these_commands() -> None:
    kinds = {name: message["kind"] for name, message in MESSAGES.items()}
    assert kinds == dict.fromkeys(SETUP, "setup") | {row[1]: "command" for row in ROWS}
    assert (len(SETUP), len(ROWS)) == (5, 24)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[1])
def test_a_command_matches_the_document(row: list[str]) -> None:
    section, name, byte, key, size, data, reply = row
    message = MESSAGES[name]
    assert message["id"] == int(byte)
    assert message["keyboard"] == key
    assert message["pages"] == [int(section)]
    assert message["title"] == REGISTRY["document"]["sections"][int(section) - 1]
    assert message["size"] == (None if size == "none" else int(size))
    assert message["chapter"] == "low_level"
    assert message["direction"] == "to_controller"
    layouts = by_form(message)
    assert layouts["request"]["length"] == int(data)
    assert layouts["request"]["fields"] != [] or data == "0"
    assert set(layouts) == {"request", "reply"} if int(reply) else {"request"}
    if int(reply):
        assert layouts["reply"]["length"] == int(reply)


@pytest.mark.parametrize("name", SETUP)
def test_a_setup_command_matches_the_document(name: str) -> None:
    message = MESSAGES[name]
    assert (message["id"], message["keyboard"]) == SETUP[name]
    assert message["switches_to"] == SWITCHES.get(name)
    assert message["pages"] == [1]
    assert message["chapter"] == "setup"
    layouts = by_form(message)
    assert set(layouts) == {"request"}
    assert layouts["request"]["fields"] == []


def test_four_bytes_are_both_commands_and_setup_commands() -> None:
    bytes_of = {
        kind: {m["id"] for m in MESSAGES.values() if m["kind"] == kind}
        for kind in ("setup", "command")
    }
    assert bytes_of["setup"] & bytes_of["command"] == {65, 66, 82, 84}


def test_keys_enter_their_bytes() -> None:
    keys = {m["keyboard"]: m["id"] for m in MESSAGES.values()}
    keys |= {v["keyboard"]: v["value"] for v in REGISTRY["enumerations"]["axis"]["values"].values()}
    assert {key: typed(key) for key in keys} == keys
    assert len(keys) == len(ROWS) + 1 + len(AXES)  # only H is not also a command


def test_fields_match_the_document() -> None:
    found = {
        f"{name}.{layout['form']}.{field['name']}": (
            *(field[key] for key in ("size", "signed", "minimum", "maximum")),
            *scale(field),
        )
        for name, message in MESSAGES.items()
        for layout in message["layouts"]
        for field in layout["fields"]
    }
    assert found == FIELDS


def test_position_comes_before_the_status_byte() -> None:
    reply = by_form(MESSAGES["READ_MOTOR_POSITION_AND_STATUS"])["reply"]
    assert [(field["name"], field["offset"]) for field in reply["fields"]] == [
        ("position", 0),
        ("status", 3),
    ]


def test_identification_is_text() -> None:
    reply = by_form(MESSAGES["READ_IDENTIFICATION"])["reply"]
    assert [field["kind"] for field in reply["fields"]] == ["text"]


def test_two_commands_are_dummies() -> None:
    dummies = {name for name, message in MESSAGES.items() if message.get("dummy")}
    assert dummies == {"READ_START_SPEED", "WRITE_START_SPEED"}


def test_axes_match_the_document() -> None:
    values = REGISTRY["enumerations"][REGISTRY["framing"]["axes"]]["values"]
    assert {
        name: (value["value"], value["keyboard"], value.get("reserved", False))
        for name, value in values.items()
    } == AXES


def test_busy_is_a_letter() -> None:
    [status] = by_form(MESSAGES["READ_STATUS"])["reply"]["fields"]
    assert status["enum"] == {"BUSY": 66, "NOT_BUSY": 98}


@pytest.mark.parametrize("name", ["READ_STATUS_BYTE", "READ_MOTOR_POSITION_AND_STATUS"])
def test_status_bits_match_the_document(name: str) -> None:
    status = by_form(MESSAGES[name])["reply"]["fields"][-1]
    assert status["flags"] == {bit: 1 << number for bit, number in BITS.items()}


def test_the_framing_matches_the_document() -> None:
    framing = REGISTRY["framing"]
    assert (framing["kind"], framing["prefix"], framing["terminator"]) == ("slots", 255, 58)
    assert framing["maximum_length"] == 255


def test_firmware_notes_match_the_document() -> None:
    assert [(fact["version"], fact["page"]) for fact in REGISTRY["firmware"]] == [
        ("3.2", 2),
        ("3.3", 2),
        ("3.3", 16),
    ]
    told = {name: [f["version"] for f in m["firmware"]] for name, m in MESSAGES.items()}
    assert {name: versions for name, versions in told.items() if versions} == {
        "READ_STATUS": ["3.3"],
        "STOP_MOTOR": ["3.3"],
    }


def test_sections_and_issue_match_the_document() -> None:
    document = REGISTRY["document"]
    assert len(document["sections"]) == 27
    assert (document["issue"], document["date"]) == ("1742254661", "2025/03/17 19:37")


def test_both_units_have_all_messages() -> None:
    units = {unit["name"]: unit for unit in REGISTRY["units"]}
    assert set(units) == {"MS2000", "MFC2000"}
    for unit in units.values():
        assert unit["messages"] == sorted(MESSAGES)
        assert unit["stages"] == []
        assert "address" not in unit
    assert units["MS2000"]["baud_rates"]["values"] == [9600, 19200, 28800, 115200]


def test_the_errata_of_each_class_are_listed() -> None:
    found: dict[str, set[str]] = {}
    for erratum in REGISTRY["errata"]:
        found.setdefault(erratum["class"], set()).add(erratum["id"].removeprefix("ms2000-"))
    assert found["wire"] == set(WIRE.split())
    assert found["meaning"] == set(MEANING.split())
    assert found.keys() == {"wire", "meaning", "cosmetic"}
