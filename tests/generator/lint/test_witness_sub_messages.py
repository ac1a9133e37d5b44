"""Sections, lists and contents of messages that share an id and a printed heading."""

from __future__ import annotations

from pathlib import Path

import pytest

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.lint.witness.reading import sub_message, two_bytes
from stagewire_generator.lint.witness.witness import compare_witness
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import Document, load

Found = dict[str, tuple[int, str, str]]  # place -> line, printed, encoded

SETPOINT = """chapter: laser
messages:
  LASER_SET_SETPOINT:
    heading: {page: 1, line: 1, id: "0x0800"}
    sub_message:
      {of: LASER_SET_PARAMS, page: 2, line: 9, title: Set/Request/Get Laser_Setpoint,
       id: "01", bytes: [12, "0100"],
       listed: [[5, Set/Request/Get Laser Setpoint, "01"]]}
    tables:
      - {page: 2, line: 10, part: SET, packet: 4, header: ["00", "08", "04", "00", "d|", "s"],
         columns: [SubMsgID, Setpoint]}
    rows: [[MsgID, word], [Setpoint, word]]
  LASER_REQ_SETPOINT:
    heading: {page: 1, line: 2, id: "0x0801"}
    sub_message: {of: LASER_REQ_PARAMS, page: 2, line: 9, title: Set/Request/Get Laser_Setpoint, id: "01"}
    tables: [{page: 2, line: 14, part: REQUEST, header: ["01", "08", "01", "00", "d", "s"]}]
  LASER_GET_SETPOINT:
    heading: {page: 1, line: 3, id: "0x0802"}
    sub_message: {of: LASER_GET_PARAMS, page: 2, line: 9, title: Set/Request/Get Laser_Setpoint, id: "01"}
    tables: []
"""

CONTENTS = """chapter: contents
titles: []
rows:
- {line: 1, name: MSG_LASER_SET_PARAMS, id: "0x0800", page: "1"}
- {line: 2, name: MSG_LASER_REQ_PARAMS, id: "0x0801", page: "1"}
- {line: 3, name: MSG_LASER_GET_PARAMS, id: "0x0802", page: "1"}
"""

LIST = """chapter: lists
lists:
  LS1:
    title: Messages of LS1 and LS2
    page: 8
    line: 1
    rows:
    - {line: 2, name: MSG_LASER_SET_PARAMS, id: "0x0800", page: "1"}
    - {line: 3, of: LASER_PARAM, name: SetRequest/Get Laser_Setpoint, id: "01"}
"""


def compare(protocol: Protocol, folder: Path, *texts: str) -> Comparison:
    documents: list[Document] = []
    for number, text in enumerate(texts):
        path = folder / f"{number}.yaml"
        path.write_text(text, encoding="utf-8")
        document = load(path, path.name, Diagnostics())
        assert document is not None
        documents.append(document)
    return compare_witness(protocol, documents)


def found(comparison: Comparison) -> Found:
    return {
        place: (difference.at.line, difference.printed, difference.encoded)
        for place, difference in comparison.differences.items()
    }


def test_a_section_is_compared_with_the_message_of_its_sub_message(
    layouts: Protocol, tmp_path: Path
) -> None:
    comparison = compare(layouts, tmp_path, SETPOINT)
    assert found(comparison) == {}
    names = {f"LASER_{verb}_SETPOINT" for verb in ("SET", "REQ", "GET")}
    assert comparison.headed == names
    assert comparison.unknown == []


def test_a_section_may_have_another_name(layouts: Protocol, tmp_path: Path) -> None:
    comparison = compare(layouts, tmp_path, SETPOINT.replace("_SETPOINT:", "_POWER_LEVEL:"))
    assert found(comparison) == {}
    assert comparison.unknown == []
    assert "LASER_REQ_SETPOINT" in comparison.headed


def test_a_section_with_an_unknown_name_and_sub_message_is_reported(
    layouts: Protocol, tmp_path: Path
) -> None:
    text = SETPOINT.replace("_SETPOINT:", "_SECRET:").replace('id: "01"', 'id: "09"')
    comparison = compare(layouts, tmp_path, text)
    names = [name for _, name in comparison.unknown]
    assert names == ["LASER_SET_SECRET", "LASER_REQ_SECRET", "LASER_GET_SECRET"]


@pytest.mark.parametrize(
    ("old", "new", "place", "sides"),
    [
        ('id: "01", bytes', 'id: "02", bytes', "sub_message/{}/id", ("2", "1")),
        ("0100", "0200", "sub_message/{}/bytes", ("2", "1")),
        ("0100", "01", "sub_message/{}/bytes", ("None", "1")),
        ('Setpoint, "01"]', 'Setpoint, "0B"]', "sub_message/{}/listed", ("11", "1")),
        ("PARAMS, page: 2", "PARAMS, page: 3", "heading/{}/page", ("3", "2")),
        ("0x0800", "0x0870", "heading/{}/id", ("0x0870", "0x0800")),
        ("[SubMsgID, S", "[SubMsgNo, S", "table/{}/columns/sub_message", ("SubMsgNo", "sub_message")),
    ],
)  # fmt: skip
def test_each_part_of_a_section_is_compared(
    layouts: Protocol, tmp_path: Path, old: str, new: str, place: str, sides: tuple[str, str]
) -> None:
    differences = found(compare(layouts, tmp_path, SETPOINT.replace(old, new, 1)))
    name = "LASER_SET_SETPOINT"
    assert {key: value[1:] for key, value in differences.items()} == {place.format(name): sides}


def test_the_request_is_compared_with_the_constant_of_its_header(
    layouts: Protocol, tmp_path: Path
) -> None:
    text = SETPOINT.replace('"01", "08", "01"', '"01", "08", "03"')
    assert found(compare(layouts, tmp_path, text)) == {
        "table/LASER_REQ_SETPOINT/param1": (16, "03", "01")
    }


def test_a_row_of_the_contents_stands_for_all_sub_messages(
    layouts: Protocol, tmp_path: Path
) -> None:
    assert found(compare(layouts, tmp_path, SETPOINT, CONTENTS)) == {}
    without = CONTENTS.rsplit("- ", 1)[0]
    assert set(found(compare(layouts, tmp_path, SETPOINT, without))) == {
        "contents/LASER_GET_SETPOINT/missing"
    }


@pytest.mark.parametrize(
    ("old", "new", "wanted"),
    [
        ('"0x0801", page: "1"', '"0x0803", page: "1"',
         {"contents/LASER_REQ_PARAMS/id": (5, "0x0803", "0x0801")}),
        ('"0x0801", page: "1"', '"0x0801", page: "2"',
         {"contents/LASER_REQ_PARAMS/page": (5, "2", "1")}),
        ("REQ_PARAMS", "ASK_PARAMS",
         {"contents/LASER_ASK_PARAMS/name": (5, "LASER_ASK_PARAMS", "no such heading")}),
    ],
)  # fmt: skip
def test_rows_of_the_contents_are_compared_with_the_shared_heading(
    layouts: Protocol, tmp_path: Path, old: str, new: str, wanted: Found
) -> None:
    assert found(compare(layouts, tmp_path, SETPOINT, CONTENTS.replace(old, new))) == wanted


def listed(layouts: Protocol, folder: Path, text: str) -> set[str]:
    """Return the differences about the parameters that share a heading."""
    differences = found(compare(layouts, folder, SETPOINT, text))
    parts = ("SETPOINT", "PARAMS", "FILTER", "LIMITS", "MODES")
    return {place for place in differences if any(part in place for part in parts)}


def test_a_list_has_the_sub_messages_of_its_rows(layouts: Protocol, tmp_path: Path) -> None:
    kept = {
        f"lists/LS1/LASER_{verb}_{name}/missing"
        for name in ("FILTER", "LIMITS", "MODES")
        for verb in ("SET", "REQ", "GET")
    } - {"lists/LS1/LASER_REQ_MODES/missing"}
    assert listed(layouts, tmp_path, LIST) == kept
    alone = LIST.replace("SetRequest/Get", "Request/Get")
    assert listed(layouts, tmp_path, alone) == {*kept, "lists/LS1/LASER_SET_SETPOINT/missing"}


def test_the_shared_row_alone_stands_for_all_sub_messages(
    layouts: Protocol, tmp_path: Path
) -> None:
    alone = LIST.rsplit("    - ", 1)[0]
    places = listed(layouts, tmp_path, alone)
    assert places
    assert not any("LASER_SET_" in place for place in places)
    wrong = alone.replace('page: "1"', 'page: "2"')
    assert listed(layouts, tmp_path, wrong) == {*places, "lists/LS1/LASER_SET_PARAMS/page"}


def test_a_row_with_an_unknown_sub_message_is_reported(layouts: Protocol, tmp_path: Path) -> None:
    wrong = LIST.replace('id: "01"', 'id: "7F"')
    comparison = compare(layouts, tmp_path, SETPOINT, wrong)
    assert "SetRequest/Get Laser_Setpoint" in [name for _, name in comparison.unknown]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("01", 1),
        ("3", 3),
        ("0B", 11),
        ("10", 16),
        ("10 [0A]", 10),
        ("17 (0x11", 17),
        ("13 [0D]", 13),
        ("", None),
        ("one", None),
        ("0X", None),
    ],
)
def test_numbers_of_sub_messages_are_read(text: str, wanted: int | None) -> None:
    assert sub_message(text) == wanted


@pytest.mark.parametrize(
    ("text", "wanted"), [("0B00", 11), ("0F,00", 15), ("2C 01", 300), ("0B", None), ("", None)]
)
def test_the_bytes_of_a_number_are_read(text: str, wanted: int | None) -> None:
    assert two_bytes(text) == wanted
