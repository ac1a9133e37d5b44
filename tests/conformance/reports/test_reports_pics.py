"""The PICS in a report: the lines of a certificate, and everything that the vendor declares."""

from __future__ import annotations

from stagewire_conformance.device.pics import Pics
from stagewire_conformance.device.pics_file import parse_pics
from stagewire_conformance.reports.pics_facts import certificate_facts, pics_facts

RACK = b"""schema_version = 1
unit = "BBD103"
line = "rs232"
motherboard = false
[unsupported]
MOT_SET_EEPROMPARAMS = "no EEPROM"
MOT_MOVE_HOME = "no switch"
MOT_MOVE_HOMED = "no switch"
[certificate]
vendor = "Example Optics"
tester = "Test laboratory"
[[bay]]
number = 1
[[bay]]
number = 3
[bay.unsupported]
MOT_MOVE_JOG = "an older card"
[[channel]]
bay = 3
stage = "MLS203"
travel = "0..110mm"
homes = false
[timing]
reply_p99_ms = 50
"""


def test_only_the_stated_lines_of_a_certificate_are_facts() -> None:
    found = {fact.key: fact.value for fact in certificate_facts(parse_pics(RACK))}
    assert found == {
        "certificate_vendor": "Example Optics",
        "certificate_tester": "Test laboratory",
    }


def test_everything_that_is_declared_is_shown() -> None:
    assert [(fact.label, fact.value) for fact in pics_facts(parse_pics(RACK))] == [
        ("Unit", "BBD103"),
        ("Protocol", "thorlabs_apt"),
        ("Line type", "rs232"),
        ("Motherboard", "none"),
        ("Bay 1", "card"),
        ("Bay 3", "card"),
        ("Unsupported in bay 3: an older card", "MOT_MOVE_JOG"),
        ("Bay 3, channel 1", "MLS203; travel 0..110mm; does not home; limit switches"),
        ("Replies", "99 of 100 within 50 ms"),
        ("Unsupported: no EEPROM", "MOT_SET_EEPROMPARAMS"),
        ("Unsupported: no switch", "MOT_MOVE_HOME, MOT_MOVE_HOMED"),
    ]


def test_without_a_file_nothing_is_declared() -> None:
    assert pics_facts(Pics(unit="TDC001")) == ()
