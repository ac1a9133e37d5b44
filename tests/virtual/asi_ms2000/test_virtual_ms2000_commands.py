"""Every command of the document, as exchanges of decimal bytes written by hand from its sections."""

import dataclasses

import pytest
from ms2000_host import Host

from stagewire.framing import CommandReceived
from stagewire_ms2000 import PROTOCOL
from stagewire_virtual.asi_ms2000.instrument import Ms2000Instrument
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.instrument import find_unit
from stagewire_virtual.options import Options

# Pairs of sent bytes and answers; a number advances the clock by that many milliseconds. A new controller has
# a top speed of 6000 µm/s and a ramp time of 100 ms, so 10 mm take 1.767 s; its servos settle for 20 ms.
TURNS = {
    "section 4, idle": [("24 63 58", "98")],
    "section 4, busy until settled": [
        ("24 84 3 160 134 1 58", ""),
        ("24 63 58", "66"),
        ("25 63 58", "98"),
        1766,
        ("24 63 58", "66"),
        20,
        ("24 63 58", "66"),
        1,
        ("24 63 58", "98"),
    ],
    "section 5": [
        ("24 97 3 58", "0 0 0"),
        ("24 65 3 160 134 1 58", ""),
        ("24 97 03 58", "160 134 1"),
        ("25 97 3 58", "0 0 0"),
        ("24 65 3 255 255 255 58", ""),
        ("24 97 3 58", "255 255 255"),
    ],
    "section 6 and 21": [
        ("24 100 3 58", "0 0 0"),
        ("24 68 03 160 134 01 58", ""),
        ("24 100 03 58", "160 134 1"),
        ("24 97 3 58", "0 0 0"),
        ("24 126 1 58", "10"),
    ],
    "section 7": [
        ("24 105 6 58", "69 77 79 84 32 58"),
        ("25 105 6 58", "69 77 79 84 32 58"),
        ("26 105 6 58", "69 77 79 84 32 58"),
    ],
    "section 7, without the size": [("24 105 58", "69 77 79 84 32 58")],
    "section 8": [("24 65 3 160 134 1 58", ""), ("24 108 4 58", "160 134 1 10")],
    "section 8, with the size of the example": [("24 108 3 58", "")],
    "section 9": [
        ("24 111 2 58", "0 0"),
        ("24 84 3 160 134 1 58", ""),
        50,
        ("24 111 2 58", "184 11"),  # half of the ramp: 3000 µm/s
        50,
        ("24 111 2 58", "112 23"),
        1900,
        ("24 84 3 0 0 0 58", ""),
        50,
        ("24 111 2 58", "72 244"),  # -3000
    ],
    "section 10 and 22": [
        ("24 113 1 58", "100"),
        ("24 81 01 45 58", ""),
        ("24 113 1 58", "45"),
        ("24 81 1 255 58", ""),
        ("24 81 1 0 58", ""),  # a ramp time of 0 is ignored
        ("24 113 1 58", "255"),
        ("25 113 1 58", "100"),
    ],
    "section 11 and 23": [
        ("24 114 2 58", "0 0"),
        ("24 82 2 78 2 58", ""),
        ("24 114 2 58", "0 0"),
        ("24 126 1 58", "10"),
    ],
    "section 12 and 24": [
        ("24 115 2 58", "112 23"),
        ("24 83 2 78 2 58", ""),
        ("24 115 2 58", "78 2"),
        ("24 83 2 255 255 58", ""),
        ("24 115 2 58", "255 255"),
        ("26 115 2 58", "112 23"),
    ],
    "section 13": [
        ("24 116 3 58", "0 0 0"),
        ("24 84 3 160 134 1 58", ""),
        ("24 116 03 58", "160 134 1"),
        5000,
        ("24 116 03 58", "160 134 1"),
        ("25 116 03 58", "0 0 0"),
    ],
    "section 14": [("24 126 1 58", "10")],
    "section 14, without the size": [("24 126 58", "10")],
    "section 15 and 16": [
        ("24 66 58", ""),
        ("24 84 3 16 39 0 58", ""),
        1000,
        ("24 97 3 58", "0 0 0"),
        ("24 63 58", "98"),
        ("24 71 58", ""),
        ("24 63 58", "66"),
        1000,
        ("24 97 3 58", "16 39 0"),
    ],
    "section 15 and 16, with a size": [
        ("24 84 3 160 134 1 58", ""),
        ("24 66 0 58", ""),
        ("24 63 0 58", "98"),
        ("24 71 0 58", ""),
        ("24 63 0 58", "66"),
    ],
    "section 17": [
        ("24 65 03 160 134 01 58", ""),
        ("24 63 58", "98"),
        ("24 116 3 58", "160 134 1"),
    ],
    "section 18": [
        ("24 84 03 160 134 01 58", ""),
        5000,
        ("24 97 3 58", "160 134 1"),
        ("24 84 3 96 121 254 58", ""),
        5000,
        ("24 97 3 58", "96 121 254"),
    ],
    "section 19": [
        ("24 68 3 16 39 0 58", ""),
        ("24 43 0 58", ""),
        ("24 116 3 58", "16 39 0"),
        1000,
        ("24 43 58", ""),
        1000,
        ("24 97 3 58", "32 78 0"),
    ],
    "section 20": [
        ("24 68 3 16 39 0 58", ""),
        ("24 45 0 58", ""),
        ("24 116 3 58", "240 216 255"),
        1000,
        ("24 45 58", ""),
        1000,
        ("24 97 3 58", "224 177 255"),
    ],
    "section 25": [
        ("24 94 2 112 23 58", ""),
        100,
        ("24 111 2 58", "112 23"),
        ("24 126 1 58", "11"),
        1000,
        ("24 111 2 58", "112 23"),
        ("24 97 3 58", "24 246 0"),  # 0.3 mm of ramp and 6 mm
        ("24 63 58", "66"),
        ("24 66 58", ""),
        ("24 111 2 58", "0 0"),
        ("24 63 58", "98"),
    ],
    "section 26 and 27": [
        ("24 126 1 58", "10"),
        ("24 75 58", ""),
        ("24 126 1 58", "2"),
        ("25 126 1 58", "10"),
        ("24 74 58", ""),
        ("24 126 1 58", "10"),
        ("24 75 0 58", ""),
        ("24 126 1 58", "2"),
        ("24 74 0 58", ""),
        ("24 126 1 58", "10"),
    ],
    "section 1, to the other format and back": [
        ("255 65", ""),
        ("24 63 58", ""),
        ("13", "58 78 45 49 13 10"),  # :N-1
        ("87 32 88 13", "58 65 32 48 13 10"),  # W X: :A 0
        ("255 66", ""),
        ("24 63 58", "98"),
    ],
    "section 1, reset": [
        ("24 68 3 16 39 0 58", ""),
        ("24 75 58", ""),
        ("255 82", ""),
        ("255 66", ""),
        ("24 100 3 58", "0 0 0"),
        ("24 126 1 58", "10"),
    ],
    "section 1, digits of WHERE": [
        ("255 72", ""),
        ("255 65", ""),
        ("87 32 88 13", "58 65 32 48 13 10"),
        ("255 84", ""),
        ("87 32 88 13", "58 65 32 48 13 10"),
    ],
    # Errors are ignored; the commands after them are not.
    "section 2, an unknown command": [("24 99 0 58", ""), ("24 63 58", "98")],
    "section 2, axes that are not fitted": [
        ("27 63 58", ""),
        ("1 63 58", ""),
        ("3 63 58", ""),
        ("19 63 58", ""),
        ("120 63 58", ""),
        ("24 63 58", "98"),
    ],
    "section 2, another size": [("24 97 2 58", ""), ("24 84 2 16 39 58", ""), ("24 63 58", "98")],
    "section 2, aborted before the size": [("24 58", ""), ("58", ""), ("24 63 58", "98")],
    "section 2, data without a size": [("24 84 58", ""), ("24 63 58", "98")],
    "section 2, bytes before the colon are ignored": [
        ("24 97 3 1 2 3 58", "0 0 0"),
        ("24 65 3 160 134 1 9 9 58", ""),
        ("24 97 3 58", "160 134 1"),
    ],
    "section 2, a lost byte makes data of the next command": [
        ("24 84 3 160 134 58 24 63 58", ""),
        ("24 116 3 58", "160 134 58"),
    ],
}


@pytest.mark.parametrize("unit", ["MS2000", "MFC2000"])
@pytest.mark.parametrize("name", TURNS)
def test_commands_are_answered_as_in_the_document(unit: str, name: str) -> None:
    host = Host(unit=unit)
    for turn in TURNS[name]:
        if isinstance(turn, int):
            host.clock.advance(turn / 1000)
        else:
            sent, answered = turn
            assert host.ask(sent) == answered, sent


def test_the_table_has_every_command_of_both_controllers() -> None:
    sent = [turn[0] for turns in TURNS.values() for turn in turns if not isinstance(turn, int)]
    names = {
        event.frame.message.layout.message
        for decimal in sent
        for event in PROTOCOL.framer().feed(bytes(map(int, decimal.split())))
        if isinstance(event, CommandReceived)
    }
    assert names >= find_unit("MS2000").messages == find_unit("MFC2000").messages


@pytest.mark.parametrize(
    ("sent", "why"),
    [
        ("24 99 0 58", "18 63 00 3a: byte 1: no command of"),
        ("24 97 2 58", "READ_MOTOR_POSITION: byte 2 is its size"),
        ("27 63 58", "READ_STATUS: no axis 0x1b is fitted"),
        ("24 81 1 0 58", "WRITE_RAMPING_TIME: the ramp time must not be 0"),
    ],
)
def test_the_reason_for_ignoring_a_command_is_reported(sent: str, why: str) -> None:
    host = Host()
    assert host.ask(sent) == ""
    assert len(host.refusals) == 1
    assert why in host.refusals[0]


def test_a_unit_ignores_commands_that_are_not_its_own() -> None:
    unit = find_unit("MS2000")
    fewer = sorted(unit.messages - {"READ_STATUS", "SWITCH_TO_HIGH_LEVEL"})
    host = Host()
    lesser = dataclasses.replace(unit, facts={**unit.facts, "messages": fewer})
    host.instrument = Ms2000Instrument(lesser, SteppedClock(), Options())
    host.instrument.on_send = lambda data: host.said.append((0, data))
    host.instrument.on_refusal = host.refusals.append
    assert host.ask("255 66 24 63 58 255 65 24 97 3 58") == "0 0 0"
    assert host.refusals == [
        "READ_STATUS is not a command of this controller",
        "SWITCH_TO_HIGH_LEVEL is not a command of this controller",
    ]


def test_each_answer_is_one_call() -> None:
    host = Host()
    host.send(bytes.fromhex("18613a 183f3a 18693a"))
    assert [data for _, data in host.said] == [b"\0\0\0", b"b", b"EMOT :"]
