"""Each kind of difference between witness and registry, with its place, its line and both values.

The small good spec is the registry. Each case has a few printed lines that differ from it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.lint.witness.witness import compare_witness, is_named
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import load

Found = dict[str, tuple[int, str, str]]  # place -> line, printed, encoded


def compare(protocol: Protocol, folder: Path, *texts: str) -> Comparison:
    documents = []
    for number, text in enumerate(texts):
        path = folder / f"{number}.yaml"
        path.write_text(text, encoding="utf-8")
        diagnostics = Diagnostics()
        document = load(path, path.name, diagnostics)
        assert not diagnostics.found
        assert document is not None
        documents.append(document)
    return compare_witness(protocol, documents)


def found(comparison: Comparison) -> Found:
    return {
        place: (difference.at.line, difference.printed, difference.encoded)
        for place, difference in comparison.differences.items()
    }


def chapter(message: str, section: str, heading: str = "") -> str:
    """Return a chapter with one message, with its heading in line 3 and its section from line 4."""
    ids = {"POS_MOVE": "4, 0x0120", "POS_MOVED": "5, 0x0121", "POS_ECHO": "6, 0x0122"}
    ids |= {"POS_ALIVE": "6, 0x0123", "POS_GET_MODE": "5, 0x0112", "LAMP_TEST": "7, 0x0202"}
    ids |= {"POS_SET_VELPARAMS": "4, 0x0101", "POS_REQ_VELPARAMS": "4, 0x0102"}
    ids |= {"LAMP_BROKEN": "7, none"}
    page, id = ids[message].split(", ")
    heading = heading or f'{{page: {page}, line: 1, id: "{id}"}}'
    return f"chapter: core\nmessages: {{{message}: {{\n  heading: {heading},\n{section}}}}}\n"


def table(message: str, *keys: str) -> str:
    """Return a chapter with one byte table, with one key per line from line 5."""
    return chapter(message, "  tables: [{\n" + "".join(f"    {key},\n" for key in keys) + "  }]\n")


HEADINGS: list[tuple[str, Found]] = [
    ('{page: 5, line: 1, id: "0x0121"}', {
        "heading/POS_MOVE/id": (3, "0x0121", "0x0120"),
        "heading/POS_MOVE/page": (3, "5", "4"),
    }),
    ("{page: 4, line: 1, id: none}", {"heading/POS_MOVE/id": (3, "none", "0x0120")}),
]  # fmt: skip


@pytest.mark.parametrize(("heading", "wanted"), HEADINGS)
def test_headings_are_compared(
    protocol: Protocol, tmp_path: Path, heading: str, wanted: Found
) -> None:
    assert found(compare(protocol, tmp_path, chapter("POS_MOVE", "", heading))) == wanted


def test_a_message_without_an_id_has_no_id_in_its_heading(
    protocol: Protocol, tmp_path: Path
) -> None:
    assert found(compare(protocol, tmp_path, chapter("LAMP_BROKEN", ""))) == {}
    heading = '{page: 7, line: 1, id: "0x0203"}'
    assert found(compare(protocol, tmp_path, chapter("LAMP_BROKEN", "", heading))) == {
        "heading/LAMP_BROKEN/id": (3, "0x0203", "none")
    }


def test_a_heading_of_an_unknown_message_is_reported(protocol: Protocol, tmp_path: Path) -> None:
    text = chapter("POS_MOVE", "").replace("POS_MOVE", "POS_MOVES")
    comparison = compare(protocol, tmp_path, text)
    assert found(comparison) == {}
    assert [(place.line, name) for place, name in comparison.unknown] == [(2, "POS_MOVES")]
    assert comparison.witnessed == set()


MOVE = 'header: ["20", "01", "06", "00", "d|", s]'
TABLES: dict[str, tuple[str, Found]] = {
    "as it is": (
        table("POS_MOVE", "structure: 12", "packet: 6", "last_offset: 11", MOVE,
              "columns: [Chan Ident, Absolute Distance]"),
        {},
    ),
    "sizes": (
        table("POS_MOVE", "structure: 13", "packet: 7", "last_offset: 12"),
        {
            "table/POS_MOVE/structure": (5, "13", "12"),
            "table/POS_MOVE/packet": (6, "7", "6"),
            "table/POS_MOVE/last_offset": (7, "12", "11"),
            "table/POS_MOVE/cells": (4, "0", "6"),
        },
    ),
    "data header": (
        table("POS_MOVE", "packet: 6", 'header: ["21", "02", "07", "01", d, x]'),
        {
            "table/POS_MOVE/id": (6, "21 02", "20 01"),
            "table/POS_MOVE/length": (6, "07 01", "06 00"),
            "headers/bar": (6, "d", "d|"),
            "table/POS_MOVE/source": (6, "x", "s"),
        },
    ),
    "destination": (
        table("POS_MOVE", "packet: 6", 'header: ["20", "01", "06", "00", "x|", S]'),
        {"headers/bar": (6, "x|", "d|"), "table/POS_MOVE/dest": (6, "x", "d")},
    ),
    "cells": (
        table("POS_MOVE", "packet: 6", 'header: ["20", "01", "06", "00", "d|"]'),
        {"table/POS_MOVE/cells": (6, "5", "6")},
    ),
    "one column": (
        table("POS_MOVE", MOVE, "columns: [Absolute Distance]"),
        {"table/POS_MOVE/columns/chan_ident": (6, "nothing", "chan_ident")},
    ),
    "another column": (
        table("POS_MOVE", MOVE, "columns: [Chan Ident, Way]"),
        {"table/POS_MOVE/columns/absolute_distance": (6, "Way", "absolute_distance")},
    ),
    "fillers": (
        table("POS_MOVED", 'header: ["21", "01", "0E", "00", "d|", s]',
              "columns: [Chan Ident, Position, Velocity, Not Used, Status Bits]"),
        {},
    ),
    "no filler": (
        table("POS_MOVED", 'header: ["21", "01", "0E", "00", "d|", s]',
              "columns: [Chan Ident, Position, Not Used, Other, Status Bits]"),
        {
            "table/POS_MOVED/columns/velocity": (6, "Not Used", "velocity"),
            "table/POS_MOVED/columns/reserved": (6, "Other", "reserved"),
        },
    ),
    "header of two": (  # a short one, so it is the header-only layout
        table("POS_MOVE", "structure: 6", "last_offset: 5",
              'header: ["20", "01", Chan Ident, "0", d, s]'),
        {},
    ),
    "data of two": (
        table("POS_MOVE", "structure: 7"),
        {
            "table/POS_MOVE/structure": (5, "7", "12"),
            "table/POS_MOVE/cells": (4, "0", "6"),
        },
    ),
    "data alone": (
        table("POS_ECHO", 'header: ["22", "01", "0F", "00", "d|", s]'),
        {"table/POS_ECHO/length": (5, "0F 00", "10 00")},
    ),
    "header alone": (
        table("POS_ALIVE", "structure: 7", 'header: ["23", "01", "00", Not Used, d, s]'),
        {"table/POS_ALIVE/structure": (5, "7", "6")},
    ),
    "parameter without a meaning": (
        table("POS_ALIVE", 'header: ["23", "01", "01", Other, d, s]'),
        {
            "table/POS_ALIVE/param1": (5, "01", "00"),
            "table/POS_ALIVE/param2": (5, "Other", "00"),
        },
    ),
    "named parameters": (
        table("POS_GET_MODE", 'header: ["12", "01", Channel, Mode, d, s]'),
        {
            "table/POS_GET_MODE/param1": (5, "Channel", "chan_ident"),
            "table/POS_GET_MODE/param2": (5, "Mode", "move_mode"),
        },
    ),
    "constant parameter": (
        table("POS_MOVED", 'header: ["21", "01", CHAN_IDENT, "08", d, s]'),
        {"table/POS_MOVED/param2": (5, "08", "07")},
    ),
    "no layout": (
        table("LAMP_TEST", "structure: 99", 'header: ["02", "03", "00", "00", d, s]'),
        {"table/LAMP_TEST/id": (6, "02 03", "02 02")},
    ),
    "no id": (
        table("LAMP_BROKEN", 'header: ["02", "03", "00", "00", d, s]'),
        {},
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", TABLES)
def test_byte_tables_are_compared(protocol: Protocol, tmp_path: Path, case: str) -> None:
    text, wanted = TABLES[case]
    assert found(compare(protocol, tmp_path, text)) == wanted


def test_further_byte_tables_have_numbered_places(protocol: Protocol, tmp_path: Path) -> None:
    header = 'header: ["20", "01", Chan Ident, "00", d, s]'
    tables = f"  tables: [\n    {{{header}}},\n    {{packet: 7}},\n    {{structure: 8}}]\n"
    comparison = compare(protocol, tmp_path, chapter("POS_MOVE", tables))
    assert found(comparison) == {
        "table2/POS_MOVE/packet": (6, "7", "6"),
        "table2/POS_MOVE/cells": (6, "0", "6"),
        "table3/POS_MOVE/structure": (7, "8", "12"),
        "table3/POS_MOVE/cells": (7, "0", "6"),
    }


SECTIONS: dict[str, tuple[str, str, Found]] = {
    # Field tables
    "fields": ("POS_MOVE", "rows: [[Chan Ident, word], [ABSOLUTE DISTANCE, Long]]", {}),
    "a field name": (
        "POS_MOVE",
        "rows: [[Channel, word], [Absolute Distance, long]]",
        {"rows/POS_MOVE/chan_ident/name": (4, "Channel", "chan_ident")},
    ),
    "field formats": (
        "POS_MOVE",
        "rows: [[Chan Ident, null], [Absolute Distance, dword]]",
        {
            "rows/POS_MOVE/chan_ident/format": (4, "", "word"),
            "rows/POS_MOVE/absolute_distance/format": (4, "dword", "long"),
        },
    ),
    "a field too few": (
        "POS_MOVE",
        "rows: [[Absolute Distance, word]]",
        {
            "rows/POS_MOVE/chan_ident/name": (4, "nothing", "chan_ident"),
            "rows/POS_MOVE/chan_ident/format": (4, "nothing", "word"),
            "rows/POS_MOVE/absolute_distance/format": (4, "word", "long"),
        },
    ),
    "a field too many": (
        "POS_MOVE",
        "rows: [[Chan Ident, word], [Way, long], [Absolute Distance, long]]",
        {
            "rows/POS_MOVE/way/name": (4, "Way", "nothing"),
            "rows/POS_MOVE/way/format": (4, "long", "nothing"),
        },
    ),
    "fields in another order": (
        "POS_MOVE",
        "rows: [[Absolute Distance, long], [Chan Ident, word], [Way, long]]",
        {
            "rows/POS_MOVE/chanident/name": (4, "Chan Ident", "nothing"),
            "rows/POS_MOVE/chanident/format": (4, "word", "nothing"),
            "rows/POS_MOVE/way/name": (4, "Way", "nothing"),
            "rows/POS_MOVE/way/format": (4, "long", "nothing"),
            "rows/POS_MOVE/chan_ident/name": (4, "nothing", "chan_ident"),
            "rows/POS_MOVE/chan_ident/format": (4, "nothing", "word"),
        },
    ),
    "fields of a header": ("POS_GET_MODE", "rows: [[Chan Ident, byte], [Move Mode, char]]", {}),
    "a format in a header": (
        "POS_GET_MODE",
        "rows: [[Chan Ident, byte], [Move Mode, word]]",
        {"rows/POS_GET_MODE/move_mode/format": (4, "word", "byte")},
    ),
    "fields of no layout": (
        "LAMP_TEST",
        "rows: [[Chan Ident, byte]]",
        {
            "rows/LAMP_TEST/chanident/name": (4, "Chan Ident", "nothing"),
            "rows/LAMP_TEST/chanident/format": (4, "byte", "nothing"),
        },
    ),
    # Lists of values
    "values": (
        "POS_REQ_VELPARAMS",
        'values: [{of: Chan Ident, rows: [["0x01", CHANNEL_1], ["2", Channel_2]]}]',
        {},
    ),
    "a value too few": (
        "POS_REQ_VELPARAMS",
        'values: [{of: Chan Ident, rows: [["0x01", CHANNEL_1]]}]',
        {"values/POS_REQ_VELPARAMS/chanident/0x2": (4, "nothing", "channel_2")},
    ),
    "values too many": (
        "POS_REQ_VELPARAMS",
        'values: [{of: Chan Ident, rows: [["0x01", x], ["0x02", x], ["0x1F", x], [all, x]]}]',
        {
            "values/POS_REQ_VELPARAMS/chanident/0x1f": (4, "x", "nothing"),
            "values/POS_REQ_VELPARAMS/chanident/all": (4, "all", "nothing"),
        },
    ),
    "a value that is not readable": (
        "POS_REQ_VELPARAMS",
        'values: [{of: Chan Ident, rows: [["0x01", x], ["0x02", x], [all, x]]}]',
        {"values/POS_REQ_VELPARAMS/chanident/all": (4, "all", "nothing")},
    ),
    "values for the future": (
        "POS_REQ_VELPARAMS",
        'values: [{of: Chan Ident, rows: [["0x04", For Future use], ["1", x], ["2", x]]}]',
        {},
    ),
    "a run of values": (
        "POS_REQ_VELPARAMS",
        'values: [{of: Chan Ident, rows: [["0x01", x], ["to 0x04", x]]}]',
        {
            "values/POS_REQ_VELPARAMS/chanident/0x3": (4, "0x3", "nothing"),
            "values/POS_REQ_VELPARAMS/chanident/0x4": (4, "x", "nothing"),
        },
    ),
    "a symbol": (
        "POS_REQ_VELPARAMS",
        'values: [{of: Chan Ident, rows: [["0x01", CHANNEL_ONE], ["0x02", CHANNEL_2]]}]',
        {"values/POS_REQ_VELPARAMS/chanident/0x1": (4, "channel_one", "channel_1")},
    ),
    "bits": (
        "POS_MOVED",
        "values: [{of: Status Bits, rows: [\n"
        '  ["0x00000001", "1", moving], ["0x00000002", "3", at rest], ["0x80000000", "32", x]]}]',
        {"values/POS_MOVED/statusbits/0x2/bit": (4, "0x4", "0x2")},
    ),
    "bits of another unit": (
        "POS_MOVED",
        "values: [{of: Status Bits, table: TP9 only, rows: [\n"
        '  ["0x00000010", "5", warm], ["0x00000020", "6", x]]}]',
        {"values/POS_MOVED/statusbits/tp9only/0x20": (4, "0x20", "nothing")},
    ),
    "values of no field": (
        "POS_MOVED",
        'values: [{of: Mood, rows: [["1", glad], ["2", sad]]}]',
        {
            "values/POS_MOVED/mood/1": (4, "glad", "no list of values"),
            "values/POS_MOVED/mood/2": (4, "sad", "no list of values"),
        },
    ),
    "parts of a byte string": ("POS_ECHO", 'values: [{of: Blob, rows: [["0x01", x]]}]', {}),
    # Ranges
    "a range": (
        "POS_SET_VELPARAMS",
        'ranges: [{of: Min Velocity, from: "0", to: "1,000", default: "0x0000"}]',
        {},
    ),
    "a wrong range": (
        "POS_SET_VELPARAMS",
        'ranges: [{of: Min Velocity, from: "-1", to: "0x1000", default: "7"}]',
        {
            "ranges/POS_SET_VELPARAMS/min_velocity/from": (4, "-1", "0"),
            "ranges/POS_SET_VELPARAMS/min_velocity/to": (4, "0x1000", "1000"),
            "ranges/POS_SET_VELPARAMS/min_velocity/default": (4, "7", "0"),
        },
    ),
    "a limit that is a field": (
        "POS_SET_VELPARAMS",
        'ranges: [{of: Min Velocity, from: "0", to: Velocity2}]',
        {},
    ),
    "a value that is always the same": (
        "POS_SET_VELPARAMS",
        'ranges: [{of: Marker, fixed: "0x4321"}, {of: Wait, fixed: "1"}, {of: Min Velocity, fixed: "2"}]',
        {
            "ranges/POS_SET_VELPARAMS/marker/fixed": (4, "0x4321", "4660"),
            "ranges/POS_SET_VELPARAMS/min_velocity/fixed": (4, "2", "0"),
        },
    ),
    "a range of another message of the set": (
        "POS_REQ_VELPARAMS",
        'ranges: [{of: Max Velocity, from: "1"}]',
        {"ranges/POS_REQ_VELPARAMS/max_velocity/from": (4, "1", "0")},
    ),
    "a range of no field": (
        "POS_MOVE",
        'ranges: [{of: Mood, from: "1"}]',
        {"ranges/POS_MOVE/mood": (4, "Mood", "no such field")},
    ),
    "a field by the name of its row": (
        "POS_MOVE",
        'rows: [[Channel, word], [Way, long]],\n  ranges: [{of: Way, to: "5"}],\n'
        '  values: [{of: Channel, rows: [["1", x], ["2", x]]}]',
        {
            "rows/POS_MOVE/chan_ident/name": (4, "Channel", "chan_ident"),
            "rows/POS_MOVE/absolute_distance/name": (4, "Way", "absolute_distance"),
            "ranges/POS_MOVE/absolute_distance/to": (5, "5", "2147483647"),
        },
    ),
}


@pytest.mark.parametrize(
    ("unit", "title", "named"),
    [
        ("BBD201", "BBD20x controllers", True),
        ("KLS1550", "KLD and KLS", True),
        ("TLD001", "TLD", True),
        ("TLS001", "TLD", False),
        ("KLD101", "KLS101 controller", False),
    ],
)
def test_titles_of_tables_name_units_and_their_series(unit: str, title: str, named: bool) -> None:
    assert is_named(unit, title) is named


@pytest.mark.parametrize("case", SECTIONS)
def test_fields_values_and_ranges_are_compared(
    protocol: Protocol, tmp_path: Path, case: str
) -> None:
    message, section, wanted = SECTIONS[case]
    assert found(compare(protocol, tmp_path, chapter(message, f"  {section}\n"))) == wanted


def listing(kind: str, *sections: str) -> str:
    """Return a chapter of lists, with one section per line from line 2."""
    return f"chapter: {kind}\n" + "".join(f"{section}\n" for section in sections)


def row(name: str, id: str, page: str = "") -> str:
    return f'{{name: "{name}", id: "{id}"' + (f', page: "{page}"}}' if page else "}")


GOOD = row("MSG_POS_MOVE", "0x0120", "4")
CONTENTS: dict[str, tuple[list[str], Found]] = {
    "as it is": ([GOOD], {}),
    "without pages": ([row("MSG_POS_MOVE", "0x0120")], {}),
    "id and page": (
        [row("MSG_POS_MOVE", "0x0121", "5")],
        {
            "contents/POS_MOVE/id": (3, "0x0121", "0x0120"),
            "contents/POS_MOVE/page": (3, "5", "4"),
        },
    ),
    "a name without prefix": ([row("POS_MOVE", "0x0120", "4")], {}),
    "a lost underscore": (
        [row("MSG_POS MOVE", "0x0120", "4")],
        {"names/blanks": (3, " ", "_")},
    ),
    "a tab": (
        [row("MSG_POS\\tMOVE", "0x0120", "4")],
        {"names/blanks": (3, " ", "_")},
    ),
    "a full stop": (
        [row("MSG_POS_MOVE.", "0x0120", "4")],
        {"names/punctuation": (3, ".", "")},
    ),
    "a name that only its id identifies": (
        [row("MSG_MOVE_NOW", "0x0120", "4")],
        {"contents/POS_MOVE/name": (3, "MOVE_NOW", "POS_MOVE")},
    ),
    "a name that is nearly right": (
        [GOOD, row("MSG_POS_SET_VELPARAM", "0x0909", "4")],
        {
            "contents/POS_SET_VELPARAMS/name": (4, "POS_SET_VELPARAM", "POS_SET_VELPARAMS"),
            "contents/POS_SET_VELPARAMS/id": (4, "0x0909", "0x0101"),
        },
    ),
    "id and page in one": (
        ['{name: MSG_POS_MOVE, id: "0x0120", page: "4", run_together: true}'],
        {"contents/run-together": (3, "id and page in one", "id, page")},
    ),
    "a missing row": (
        [row("MSG_POS_MOVED", "0x0121", "5")],
        {"contents/POS_MOVE/missing": (2, "nothing", "POS_MOVE")},
    ),
    "a damaged row": (
        ['{damaged: true, line: 9, text: "P O S", names: [[MSG_POS_MOVE, "0x0120"]]}'],
        {"contents/line-9": (3, "P O S", "one row per message")},
    ),
    "a damaged row with a damaged name": (
        ['{damaged: true, line: 9, text: "P O S", names: [["MSG_POS MOVE", "0x0120"]]}'],
        {
            "contents/line-9": (3, "P O S", "one row per message"),
            "names/blanks": (3, " ", "_"),
        },
    ),
    "an illegible damaged row": (
        ['{damaged: true, line: 9, text: "P O S"}', GOOD],
        {"contents/line-9": (3, "P O S", "one row per message")},
    ),
}


@pytest.mark.parametrize("case", CONTENTS)
def test_contents_are_compared(protocol: Protocol, tmp_path: Path, case: str) -> None:
    rows, wanted = CONTENTS[case]
    text = listing("contents", "rows: [", *(f"  {row}," for row in rows), "]")
    assert found(compare(protocol, tmp_path, text, chapter("POS_MOVE", ""))) == wanted


def test_names_of_unknown_messages_are_reported(protocol: Protocol, tmp_path: Path) -> None:
    rows = [f"  {row('MSG_NONSENSE', '0x0909', '4')},", f"  {GOOD},"]
    comparison = compare(protocol, tmp_path, listing("contents", "rows: [", *rows, "]"))
    assert found(comparison) == {}
    assert [(place.line, name) for place, name in comparison.unknown] == [(3, "MSG_NONSENSE")]
    assert comparison.witnessed == {"POS_MOVE"}


def test_the_overview_and_mentions_in_prose_are_compared(
    protocol: Protocol, tmp_path: Path
) -> None:
    text = listing(
        "summary",
        f"rows: [{row('MSG_POS_MOVE', '0x0121')},",
        f"  {row('MSG_POS_ECHO', '0x0122')}, {row('NONSENSE', '')}]",
        f"mentions: [{{name: MSG_POS_MOVED}}, {row('MSG_POS_MOVED', '0x0122')},",
        f"  {row('MSG_HALTED', '0x0123')}, {{name: MSG_OTHER}}]",
    )
    comparison = compare(protocol, tmp_path, text)
    assert found(comparison) == {
        "summary/POS_MOVE/id": (2, "0x0121", "0x0120"),
        "mention/POS_MOVED/id": (4, "0x0122", "0x0121"),
        "mention/POS_ALIVE/name": (5, "HALTED", "POS_ALIVE"),
    }
    assert [name for _, name in comparison.unknown] == ["NONSENSE", "MSG_OTHER"]
    assert comparison.witnessed == {"POS_MOVE", "POS_ECHO", "POS_MOVED", "POS_ALIVE"}


MOVED, ALIVE = row("MSG_POS_MOVED", "0x0121", "5"), row("MSG_POS_ALIVE", "0x0123", "6")
PREFIXES = "usb_prefixes: [[x, 71xxx, x, TP1], [x, 72xxx, x, TP2]]"
ECHO: Found = {"lists/TP1/POS_ECHO/missing": (3, "nothing", "POS_ECHO")}  # it completes the list
LISTS: dict[str, tuple[list[str], Found]] = {
    "as it is": ([GOOD, MOVED, ALIVE], {}),
    "id and page": (
        [row("MSG_POS_MOVE", "0x0909", "5"), MOVED, ALIVE],
        {
            "lists/TP1/POS_MOVE/id": (4, "0x0909", "0x0120"),
            "lists/TP1/POS_MOVE/page": (4, "5", "4"),
        },
    ),
    "neither id nor page": ([row("MSG_POS_MOVE", ""), MOVED, ALIVE], {}),
    "one too few": (
        [GOOD, ALIVE],
        {"lists/TP1/POS_MOVED/missing": (3, "nothing", "POS_MOVED")},
    ),
    "one too many": (
        [GOOD, MOVED, ALIVE, row("MSG_LAMP", "0x0201")],
        {"lists/TP1/LAMP/extra": (7, "LAMP", "not in the list")},
    ),
    "a name that only its id identifies": (
        [row("MSG_MOVE_NOW", "0x0120"), MOVED, ALIVE],
        {"lists/TP1/POS_MOVE/name": (4, "MOVE_NOW", "POS_MOVE")},
    ),
    "the id of another message": (
        [row("MSG_POS_MOVE", "0x0101"), MOVED, ALIVE],
        {"lists/TP1/POS_MOVE/id": (4, "0x0101", "0x0120")},
    ),
    "the name of another row": (
        [GOOD, row("MSG_POS_MOVE", "0x0121"), ALIVE],
        {"lists/TP1/POS_MOVED/name": (5, "POS_MOVE", "POS_MOVED")},
    ),
    "the name of a message of other units": (
        [GOOD, MOVED, row("MSG_LAMP", "0x0123")],
        {"lists/TP1/POS_ALIVE/name": (6, "LAMP", "POS_ALIVE")},
    ),
    "a damaged row": (
        [GOOD, '{damaged: true, line: 9, text: "P O", names: [[MSG_POS_MOVED, "0x0121"],'
         '["MSG_POS_ALIVE", "0x0133"]]}'],
        {
            "lists/TP1/line-9": (5, "P O", "one row per message"),
            "lists/TP1/POS_ALIVE/id": (5, "0x0133", "0x0123"),
        },
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", LISTS)
def test_lists_are_compared(protocol: Protocol, tmp_path: Path, case: str) -> None:
    rows, wanted = LISTS[case]
    head = "lists: {TP1: {title: Of the TP1, page: 9, rows: ["
    comparison = compare(
        protocol, tmp_path, listing("lists", PREFIXES, head, *(f"  {row}," for row in rows), "]}}")
    )
    assert found(comparison) == wanted | ECHO
    assert comparison.unknown == []
    assert {"POS_MOVE", "POS_ALIVE"} <= comparison.witnessed


def test_unknown_lists_and_other_pages_are_reported(protocol: Protocol, tmp_path: Path) -> None:
    text = listing(
        "lists",
        PREFIXES,
        f"lists: {{TP1: {{title: Of the TP1, page: 8, rows: [{GOOD}, {MOVED}, {ALIVE},",
        f"    {row('NONSENSE', '')}]}},",
        "  TP7: {title: Of the TP7, page: 9, rows: []}}",
    )
    comparison = compare(protocol, tmp_path, text)
    assert found(comparison) == ECHO | {
        "lists/TP1/page": (3, "8", "9"),
        "lists/TP7": (5, "Of the TP7", "no such list"),
    }
    assert [(place.line, name) for place, name in comparison.unknown] == [(4, "NONSENSE")]


@pytest.mark.parametrize(
    ("title", "units"),
    [
        ("Messages of TPx Series", "['TP1', 'TP2', 'TP9']"),  # a digit for x
        ("Messages of TP1 and TP2", "['TP1', 'TP2']"),
        ('"Messages of TP1, TP2, and TP9 (continued)"', "['TP1', 'TP2', 'TP9']"),
        ("Messages of TP10", "[]"),
    ],
)
def test_the_units_of_a_list_are_those_that_its_heading_names(
    protocol: Protocol, tmp_path: Path, title: str, units: str
) -> None:
    rows = f"rows: [{GOOD}, {MOVED}, {ALIVE}]"
    printed = "motor_controllers: [[x, TP2, x], [x, TP9, x]]"
    text = listing(
        "lists", PREFIXES, f"lists: {{TP1: {{title: {title}, page: 9, {rows}}}}}", printed
    )
    wanted = {"lists/TP1/units": (3, units, "['TP1']")}
    assert found(compare(protocol, tmp_path, text)) == ECHO | wanted


def test_a_list_without_additions_matches(protocol: Protocol, tmp_path: Path) -> None:
    lists = {"TP1": {"page": 9, "units": [], "messages": ["POS_MOVE"]}}
    bare = replace(protocol, units={"lists": lists, "units": {}})
    text = listing("lists", f"lists: {{TP1: {{title: x, page: 9, rows: [{GOOD}]}}}}")
    assert found(compare(bare, tmp_path, text)) == {}


def test_prefixes_are_compared_where_a_file_has_their_table(
    protocol: Protocol, tmp_path: Path
) -> None:
    head = f"lists: {{TP1: {{title: Of the TP1, page: 9, rows: [{GOOD}, {MOVED}, {ALIVE}]}}}}"
    texts = listing("lists", PREFIXES, head), listing("lists", "lists: {}")
    assert found(compare(protocol, tmp_path, *texts)) == ECHO


def test_a_recorded_misprint_that_is_not_printed_is_reported(
    protocol: Protocol, tmp_path: Path
) -> None:
    lists = {
        "TP1": {"page": 9, "units": [], "messages": ["POS_MOVE"], "misprinted": {"POS_MOVE": "x"}}
    }
    bare = replace(protocol, units={"lists": lists, "units": {}})
    text = listing("lists", "lists: {TP1: {title: x, page: 9, rows: [", f"  {GOOD}]}}}}")
    assert found(compare(bare, tmp_path, text)) == {
        "lists/TP1/POS_MOVE/misprinted": (2, "POS_MOVE", "as printed")
    }
    text = text.replace("MSG_POS_MOVE", "MSG_MOVE_NOW")
    assert found(compare(bare, tmp_path, text)) == {
        "lists/TP1/POS_MOVE/name": (3, "MOVE_NOW", "POS_MOVE")
    }


def test_lists_and_units_are_unknown_in_a_protocol_without_units(
    protocol: Protocol, tmp_path: Path
) -> None:
    bare = replace(protocol, units={})
    text = listing(
        "lists",
        "lists: {TP1: {title: Of the TP1, page: 9, rows: []}}",
        "motor_controllers: [[x, TP1, x]]",
        "usb_prefixes: [[x, 71xxx, x, TP1]]",
    )
    assert found(compare(bare, tmp_path, text)) == {
        "lists/TP1": (2, "Of the TP1", "no such list"),
        "units/TP1": (3, "TP1", "no such unit"),
        "prefixes/71/TP1": (4, "TP1", "nothing"),
    }


TABLES_OF_UNITS: dict[str, tuple[str, Found]] = {
    "units": (
        "motor_controllers: [[x, TP1, x], [x, TP9, x]]\npiezo_controllers: [[x, TP2, x]]",
        {},
    ),
    "channels": (
        "motor_controllers: [[x, TP1, 1 Channel Rail],\n[x, TP2, 3 Channel Rail]]",
        {"units/TP2/channels": (4, "3", "2")},
    ),
    "other units": (
        "motor_controllers: [[x, TP1, x],\n[x, TP5, x]]\npiezo_controllers: [[x, TP6, x]]",
        {
            "units/TP5": (4, "TP5", "no such unit"),
            "units/TP6": (5, "TP6", "no such unit"),
        },
    ),
    "prefixes": ("usb_prefixes: [[x, 71xxx, x, TP1], [x, 72xxx, x, TP2]]", {}),
    "a prefix of another unit": (
        "usb_prefixes: [[x, 71xxx, x, TP9],\n[x, 72xxx, x, TP2]]",
        {"prefixes/71/TP9": (3, "TP9", "nothing"), "prefixes/71/TP1": (3, "TP9", "TP1")},
    ),
    "other prefixes": (
        "usb_prefixes: [[x, 71xxx, x, TP1/TP2],\n[x, 79xxx, x, TP8]]",
        {
            "prefixes/71/TP2": (3, "TP2", "nothing"),
            "prefixes/79/TP8": (4, "TP8", "nothing"),
            "prefixes/72/missing": (3, "nothing", "72"),
        },
    ),
    "units with one prefix": (  # only the first has it in the registry
        "usb_prefixes: [[x, 71xxx, x, TP1/2/10],\n[x, 72xxx, x, TP2]]",
        {
            "prefixes/71/TP2": (3, "TP2", "nothing"),
            "prefixes/71/TP10": (3, "TP10", "nothing"),
        },
    ),
    "a series with one prefix": (
        "usb_prefixes: [[x, 71xxx, x, TP1],\n[x, 72xxx, x, TP2],\n[x, 74xxx, x, T3X/T4X]]",
        {"prefixes/74/T3X": (5, "T3X", "nothing"), "prefixes/74/T4X": (5, "T4X", "nothing")},
    ),
    "a name with a slash": (
        "usb_prefixes: [[x, 71xxx, x, TP1/2], [x, 72xxx, x, TP2],\n[x, 75xxx, x, TP3/IR]]",
        {
            "prefixes/71/TP2": (3, "TP2", "nothing"),
            "prefixes/75/TP3/IR": (4, "TP3/IR", "nothing"),
        },
    ),
    "a prefix from another source": (
        "usb_prefixes: [[x, 71xxx, x, TP1], [x, 72xxx, x, TP2], [x, 73xxx, x, TP3]]",
        {},
    ),
    "a prefix without a unit": (
        'usb_prefixes: [[x, 71xxx, x, TP1],\n[x, 72xxx, x, ""],\n[x, 75xxx, x, ""]]',
        {"prefixes/72/TP2": (4, "nothing", "TP2")},
    ),
    "a prefix that is not a number": (
        "usb_prefixes: [[7, none, x, TP1], [8, 71xxx, x, TP1],\n[9, 72xxx, x, TP2]]",
        {"prefixes/line-7": (3, "none", "two leading digits")},
    ),
    "addresses": (
        'addresses: [[x, "0x01", x], [x, "0x11", x], [x, "0x21", x], [x, "0x22", x], [x, "0x50", x]]',
        {},
    ),
    "addresses with an ellipsis": (
        'addresses: [[x, "0x01", x], [x, "0x11", x], [x, "0x20", x],\n[x, "…", x], [x, "0x50", x]]',
        {"addresses/0x20": (3, "False", "True")},
    ),
    "other addresses": (
        'addresses: [[x, "0x01", x],\n[x, "0x01", x],\n[x, "0x77", x]]',
        {
            "addresses/0x01/twice": (4, "0x01", "once"),
            "addresses/0x77": (5, "False", "True"),
            "addresses/0x11/missing": (3, "nothing", "0x11"),
            "addresses/0x21/missing": (3, "nothing", "0x21"),
            "addresses/0x22/missing": (3, "nothing", "0x22"),
            "addresses/0x50/missing": (3, "nothing", "0x50"),
        },
    ),
    "formats": ('formats: [[x, word, 2 bytes], [x, char, 1 byte], [x, "char[N]", N bytes]]', {}),
    "other formats": (
        "formats: [[x, word, 4 bytes],\n[x, quad, 8 bytes]]",
        {
            "formats/word": (3, "4 byte", "2 byte"),
            "formats/quad": (4, "8 byte", "no such format"),
        },
    ),
}


@pytest.mark.parametrize("case", TABLES_OF_UNITS)
def test_units_prefixes_addresses_and_formats_are_compared(
    protocol: Protocol, tmp_path: Path, case: str
) -> None:
    section, wanted = TABLES_OF_UNITS[case]
    if "usb_prefixes" not in section:  # each unit has its prefix, and its row
        section += f"\n{PREFIXES}"
    assert found(compare(protocol, tmp_path, listing("lists", "lists: {}", section))) == wanted


def test_units_and_prefixes_may_be_those_of_unsupported_units(
    protocol: Protocol, tmp_path: Path
) -> None:
    unsupported = {"TPx": {}, "TP81": {"prefixes": [75]}, "TP82": {"prefixes": [75]}}
    known = replace(protocol, units={**protocol.units, "unsupported": unsupported})
    text = listing(
        "lists",
        "lists: {}",
        "usb_prefixes: [[x, 71xxx, x, TP1], [x, 72xxx, x, TP2], [x, 75xxx, x, TP8X]]",
        "motor_controllers: [[x, TPx, 2 Channel Balloon]]",
    )
    assert found(compare(known, tmp_path, text)) == {}


def test_lists_are_compared_after_all_chapters(protocol: Protocol, tmp_path: Path) -> None:
    """The order of the files does not matter for rows that are missing from the contents."""
    contents = listing("contents", "rows: []")
    for texts in ((contents, chapter("POS_MOVE", "")), (chapter("POS_MOVE", ""), contents)):
        comparison = compare(protocol, tmp_path, *texts)
        assert found(comparison) == {"contents/POS_MOVE/missing": (2, "nothing", "POS_MOVE")}


def test_all_compared_places_are_counted(protocol: Protocol, tmp_path: Path) -> None:
    """Places count whether they differ or not; ``stagewire check`` prints the number."""
    for name, number in (("as it is", 12), ("sizes", 6), ("another column", 9)):
        assert compare(protocol, tmp_path, TABLES[name][0]).compared == number, name


@pytest.mark.parametrize("mask", ["0x00000001", "0x0000.0001", "0X00000001", "+1"])
def test_notations_of_the_same_number_are_equal(
    protocol: Protocol, tmp_path: Path, mask: str
) -> None:
    rows = f'[["{mask}", moving], ["0x2", at_rest], ["0x80000000", enabled]]'
    text = chapter("POS_MOVED", f"  values: [{{of: status_bits, rows: {rows}}}]\n")
    assert found(compare(protocol, tmp_path, text)) == {}


@pytest.mark.parametrize(
    ("title", "differs"), [("TP9 only", False), ("of the TP9x", True), ("TPx", False)]
)
def test_the_title_of_a_table_names_a_unit_or_its_series(
    protocol: Protocol, tmp_path: Path, title: str, differs: bool
) -> None:
    rows = '[["0x10", warm]]'
    text = chapter("POS_MOVED", f"  values: [{{of: status_bits, table: {title}, rows: {rows}}}]\n")
    assert bool(found(compare(protocol, tmp_path, text))) is differs


def test_a_letter_for_the_type_before_a_name_does_not_count(
    protocol: Protocol, tmp_path: Path
) -> None:
    fields = ["wChanIdent, word", "lAbsoluteDistance, long"]
    rows = ", ".join(f"[{field}]" for field in fields)
    assert found(compare(protocol, tmp_path, chapter("POS_MOVE", f"  rows: [{rows}]\n"))) == {}


def test_a_field_with_a_complete_enumeration_ranges_over_its_values(
    protocol: Protocol, tmp_path: Path
) -> None:
    text = chapter("POS_MOVE", '  ranges: [{of: chan_ident, from: "1", to: "3"}]\n')
    assert found(compare(protocol, tmp_path, text)) == {
        "ranges/POS_MOVE/chan_ident/to": (4, "3", "2")
    }
