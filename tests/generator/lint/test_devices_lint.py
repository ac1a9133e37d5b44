"""Checks of the facts for device classes, and the positions that they report."""

from __future__ import annotations

from pathlib import Path

import pytest

from stagewire_generator import check
from stagewire_generator.diagnostics import SpecError

TINY = "tiny/messages/core.yaml"
TURTLE = "turtle/messages/walk.yaml"

# file, old text, new text, expected diagnostic
FRAMED = [
    (TINY, "{name: go}", "{name: pass}", "SW023 POS_MOVE: the method name pass is reserved"),
    (
        TINY,
        "{load: 7}",
        "{weight: 7}",
        "SW021 POS_ECHO: the default of weight: unknown field",
    ),
    (
        TINY,
        "{load: 7}",
        "{load: FULL}",
        "SW021 POS_ECHO: the default of load: unknown value FULL",
    ),
    (
        TINY,
        "{load: 7}",
        "{load: 70000}",
        "SW033 POS_ECHO: the default of load: 70000 is not between 0 and",
    ),
    (TINY, "halted_by: [POS_ALIVE]", "halted_by: [POS_HALT]", "SW021 POS_MOVE: halted_by: unknown"),
    (
        TINY,
        "halted_by: [POS_ALIVE]",
        "halted_by: [POS_MOVED]",
        "SW035 POS_MOVE: POS_MOVED cannot halt",
    ),
    (
        TINY,
        "halted_by: [POS_ALIVE]",
        "halted_by: [LAMP_TEST]",
        "SW035 POS_MOVE: LAMP_TEST cannot halt",
    ),
    (
        TINY,
        "halted_by: [POS_ALIVE]",
        "halted_by: [POS_ECHO]",
        "SW035 POS_MOVE: POS_ECHO halts it, but its",
    ),
    (
        TINY,
        "read: POS_REQ_VELPARAMS",
        "read: POS_REQ",
        "SW021 POS_MOVE: stored: unknown message POS_REQ",
    ),
    (
        TINY,
        "field: wait}",
        "field: rest}",
        "SW021 POS_MOVE: stored: the reply to POS_REQ_VELPARAMS has no field rest",
    ),
    (
        TINY,
        "read: POS_REQ_VELPARAMS",
        "read: POS_ALIVE",
        "SW021 POS_MOVE: stored: the reply to POS_ALIVE has no field wait",
    ),
    (
        TINY,
        "field: wait}",
        "field: wait, when: {field: wait, value: LONG}}",
        "SW021 POS_MOVE: stored: the reply to POS_REQ_VELPARAMS has no field wait with a value LONG",
    ),
    (
        TINY,
        "exchange: {keeps_alive: true}",
        "exchange: {keeps_alive: true, reports_fault: {code: 2}}",
        "SW035 POS_ALIVE has reports_fault, but no controller sends it",
    ),
    (
        TINY,
        "      halted_by",
        "      ends_when: {read: POS_REQ_VELPARAMS, field: chan_ident, value: CHANNEL_1}\n      halted_by",
        "SW038 POS_MOVE: ends_when is for commands",
    ),
    (
        TINY,
        "    exchange: {get: {unsolicited: true}}",
        "    tells: identity\n    exchange: {get: {unsolicited: true}}",
        "SW020 POS_VELPARAMS and POS_MODE both have `tells: identity`",
    ),
    (
        TINY,
        "ids: {set: 0x0101, req: 0x0102, get: 0x0103}",
        "ids: {set: 0x0101, get: 0x0103}",
        "SW035 POS_VELPARAMS has `tells: identity`, which requires a REQ and a GET",
    ),
    (
        "tiny/protocol.yaml",
        "channel: chan_ident",
        "channel: lane",
        "SW021 no message has the field lane",
    ),
    ("tiny/units.yaml", "TP9:", "AxesDevice:", "SW023 the unit name AxesDevice is reserved"),
    (
        "tiny/units.yaml",
        "TP9:",
        "TP1Channel:",
        "SW022 the unit TP1Channel has the same name as a class for TP1",
    ),
    (
        TINY,
        "{name: go}",
        "{name: go, attribute: {name: place, value: mm}}",
        "SW035 POS_MOVE: an attribute is a value with a unit or a name of a parameter set",
    ),
    (
        TINY,
        "    tells: identity\n",
        "    tells: identity\n    call: {attribute: {name: pass, value: mm_per_s}}\n",
        "SW023 POS_SET_VELPARAMS: pass is reserved",
    ),
    (
        TINY,
        "    tells: identity\n",
        "    tells: identity\n    call: {attribute: {name: speed, value: counts}}\n",
        "SW021 POS_SET_VELPARAMS: the attribute speed has the unknown value counts",
    ),
    (
        TINY,
        "    tells: identity\n",
        "    tells: identity\n    call: {reading: pass}\n",
        "SW023 POS_SET_VELPARAMS: the method name pass is reserved",
    ),
    (
        TINY,
        "{name: go}",
        "{name: go, also: {lambda: place}}",
        "SW023 POS_MOVE: lambda is reserved",
    ),
    (
        TINY,
        "{name: go}",
        "{name: go, also: {go_to: from}}",
        "SW023 POS_MOVE: from is reserved",
    ),
    (
        TINY,
        "{name: go}",
        "{name: go, presets: {rest: {summary: Rest., values: {spin: 0}}}}",
        "SW021 POS_MOVE: rest: unknown field spin",
    ),
    (
        TINY,
        "{name: go}",
        "{name: go, presets: {pass: {summary: Rest., values: {absolute_distance: 0}}}}",
        "SW023 POS_MOVE: the method name pass is reserved",
    ),
    (
        TINY,
        "{name: go}",
        "{name: go, presets: {rest: {summary: Rest., values: {absolute_distance: FAR}}}}",
        "SW021 POS_MOVE: rest: unknown value FAR",
    ),
    (
        TINY,
        "{name: go}",
        "{name: go, presets: {rest: {summary: Rest., values: {absolute_distance: 0}, confirmed: It moves}}}",
        "SW035 POS_MOVE: rest: only a parameter set can be read back",
    ),
    (
        TINY,
        "{load: 7}}",
        "{load: 7}, also: {say: text}}",
        "SW035 POS_ECHO: no form has only one value, which say would take",
    ),
]
# for the classes of a family: their entries, and the expected diagnostic
CLASSES = [
    (
        "{methods: {go_to: POS_GO}}",
        "SW021 families.plain.classes.methods.go_to: unknown message POS_GO",
    ),
    (
        "{methods: {class: POS_MOVE}}",
        "SW023 families.plain.classes.methods: the method name class is reserved",
    ),
    (
        "{channel: lambda}",
        "SW023 families.plain.classes.methods: the method name lambda is reserved",
    ),
    (
        "{without: {POS_GO: it is slow}}",
        "SW021 families.plain.classes.without.POS_GO: unknown message POS_GO",
    ),
    (
        "{enabling: {set: POS_SPEED, field: wait, source: a driver}}",
        "SW021 families.plain.classes.enabling.field: POS_SPEED has no field wait with an enumeration",
    ),
    (
        "{enabling: {set: POS_VELPARAMS, field: wait, source: a driver}}",
        "SW021 families.plain.classes.enabling.field: POS_VELPARAMS has no field wait with an enumeration",
    ),
    (
        "{enabling: {set: POS_VELPARAMS, field: chan_ident, channels: {BOTH: [1, 2]}, source: a driver}}",
        "SW021 families.plain.classes.enabling.channels.BOTH: chan_ident has no value BOTH",
    ),
]
# for a setting in us: the sets and fields that give its value, and the expected diagnostic
SETTINGS = [
    (
        "{POS_SPEED: {field: wait}}",
        "SW021 the setting pace: unknown parameter set POS_SPEED, or it has no content",
    ),
    ("{POS_VELPARAMS: {field: rest}}", "SW021 the setting pace: POS_VELPARAMS has no field rest"),
    (
        "{POS_VELPARAMS: {field: chan_ident, values: {THIRD: 1}}}",
        "SW021 the setting pace: chan_ident has no value THIRD",
    ),
    (
        "{POS_VELPARAMS: {field: chan_ident}}",
        "SW037 the setting pace is in us: give the numbers for the names of",
    ),
    (
        "{POS_VELPARAMS: {field: max_velocity}}",
        "SW037 the setting pace is in us, but max_velocity has no",
    ),
]
COMMANDS = [
    (TURTLE, "read: MOOD", "read: MOODS", "SW021 GO_TO: ends_when: unknown message MOODS"),
    (
        TURTLE,
        "field: mood,",
        "field: moods,",
        "SW021 GO_TO: ends_when: the reply to MOOD has no field moods",
    ),
    (
        TURTLE,
        "value: HAPPY",
        "value: GLAD",
        "SW021 GO_TO: ends_when: mood has no value GLAD",
    ),
    (
        TURTLE,
        "read: WHERE,",
        "read: HALT,",
        "SW021 GO_TO: stored: the reply to HALT has no field place",
    ),
]


def diagnostics(spec: Path, file: str, old: str, new: str) -> list[str]:
    path = spec / file
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(SpecError) as raised:
        check(spec)
    return [str(diagnostic) for diagnostic in raised.value.diagnostics]


@pytest.mark.parametrize(("file", "old", "new", "text"), FRAMED)
def test_wrong_facts_of_a_message_are_reported(
    spec: Path, file: str, old: str, new: str, text: str
) -> None:
    assert any(text in line and file in line for line in diagnostics(spec, file, old, new))


@pytest.mark.parametrize(("classes", "text"), CLASSES)
def test_wrong_facts_about_device_classes_of_a_family_are_reported(
    spec: Path, classes: str, text: str
) -> None:
    file, old = "tiny/units.yaml", "    note: a guess\n"
    [line] = diagnostics(spec, file, old, f"{old}    classes: {classes}\n")
    assert text in line
    assert line.startswith(f"{file}:8:")


def test_a_parameter_set_can_be_left_out_of_device_classes(spec: Path) -> None:
    path = spec / "tiny/units.yaml"
    text, note = path.read_text(encoding="utf-8"), "    note: a guess\n"
    classes = "    classes: {without: {POS_VELPARAMS: it is slow}, methods: {go_to: POS_MOVE}}\n"
    path.write_text(text.replace(note, note + classes), encoding="utf-8")
    check(spec)


@pytest.mark.parametrize(("file", "old", "new", "text"), COMMANDS)
def test_wrong_facts_of_a_command_are_reported(
    commands_spec: Path, file: str, old: str, new: str, text: str
) -> None:
    assert any(text in line and file in line for line in diagnostics(commands_spec, file, old, new))


@pytest.mark.parametrize(("told", "text"), SETTINGS)
def test_the_source_of_a_setting_must_exist_and_match_its_unit(
    spec: Path, told: str, text: str
) -> None:
    file, old = "tiny/quantities.yaml", "{POS_VELPARAMS: {field: wait}}"
    [line] = diagnostics(spec, file, old, told)
    assert text in line
    assert line.startswith(f"{file}:7:")


def test_a_setting_without_a_unit_requires_an_enumeration(spec: Path) -> None:
    [line] = diagnostics(
        spec,
        "tiny/quantities.yaml",
        "    unit: us\n    page: 2\n    summary: How long it",
        "    page: 2\n    summary: How long it",
    )
    assert "SW037 the setting pace has no unit, so wait requires an enumeration" in line
