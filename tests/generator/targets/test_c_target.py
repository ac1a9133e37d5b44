"""The C target: names, comments, ranges, initialisers, and specs that cannot be written in C."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

import pytest

from checkout import ROOT
from stagewire_generator import TARGETS, check, render
from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.lint import c_names
from stagewire_generator.model import Protocol
from stagewire_generator.model_fields import (
    Enumeration,
    EnumValue,
    Field,
    FlagBit,
    FlagTable,
    Format,
)
from stagewire_generator.naming import C_OURS, c_layouts, c_prefix, c_table, can_name_package
from stagewire_generator.targets.c.field_view import field_view
from stagewire_generator.targets.c.named_view import enumeration_view, flag_table_view
from stagewire_generator.targets.c.source import (
    call,
    comment,
    comment_lines,
    definition,
    integer,
    names_of,
    octets,
    plain,
    string,
    unsigned,
)

PLACE = Place("x.yaml")
COMMENT = re.compile(r"/\*.*?\*/|\"(?:\\.|[^\"\\])*\"", re.DOTALL)


@pytest.fixture(scope="session")
def core(files: dict[str, str]) -> str:
    """The header of a chapter of the small good spec."""
    return files["c/stagewire_tiny/messages/core.h"]


def part(text: str, beginning: str, end: str = "\n\n") -> str:
    """Return the only part of a text that begins with ``beginning``, up to ``end``, which is excluded."""
    assert text.count(beginning) == 1, beginning
    return text[text.index(beginning) :].partition(end)[0]


# Files


def test_files(files: dict[str, str], command_files: dict[str, str]) -> None:
    of_messages = {path for path in files if path.startswith("c/stagewire_tiny/")}
    folder = "c/stagewire_tiny"
    assert of_messages >= {
        f"{folder}/{name}.h"
        for name in ("stagewire_tiny", "wire", "enumerations", "flags", "messages/core")
    }
    of_commands = {path for path in command_files if path.startswith("c/stagewire_turtle/")}
    assert "c/stagewire_turtle/messages/walk.h" in of_commands


def test_the_umbrella_includes_all_headers_except_conversions(files: dict[str, str]) -> None:
    folder = "c/stagewire_tiny/"
    included = re.findall(r'#include "(.*)"', files[f"{folder}stagewire_tiny.h"])
    headers = {path.removeprefix(folder) for path in files if path.startswith(folder)}
    headers = {path for path in headers if path.endswith(".h")}
    assert sorted(included) == sorted(headers - {"quantities.h", "stagewire_tiny.h"})


def test_include_guards_are_unique(
    protocol: Protocol, commands: Protocol, packets: Protocol
) -> None:
    every = render([protocol, commands, packets], TARGETS)
    guards = []
    for text in (text for path, text in every.items() if path.endswith(".h")):
        [guard] = re.findall(r"^#ifndef (\w+_H)\n#define \1\n", text, re.MULTILINE)
        assert text.endswith("\n#endif\n")
        guards.append(guard)
    assert len(set(guards)) == len(guards) > 10


def test_another_package_has_other_names(protocol: Protocol) -> None:
    files = render([protocol], ["c"], package="dust_cover")
    text = files["c/dust_cover/messages/core.h"]
    assert "} dust_cover_pos_move_header;" in text
    assert "#define DUST_COVER_POS_MOVE_ID 0x0120U" in text
    assert "tiny_pos" not in text
    assert "#ifndef STAGEWIRE_DUST_COVER_MESSAGES_CORE_H" in text


def test_no_name_of_a_spec_can_be_an_include_guard(protocol: Protocol) -> None:
    """Macros of a package begin with its prefix; include guards never do."""
    files = render([replace(protocol, package="tiny")], ["c"])
    for path, text in files.items():
        if path.endswith(".h"):
            assert "#ifndef STAGEWIRE_" in text, path
    assert not can_name_package("stagewire_stagewire")
    assert not can_name_package("stagewire_stagewire_tiny")


def test_names_in_c_begin_with_a_letter() -> None:
    assert not can_name_package("stagewire_2d")
    assert can_name_package("stagewire_d2")


# Names


def test_types(core: str) -> None:
    assert re.findall(r"^\} (\w+);", core, re.MULTILINE) == [
        f"tiny_pos_{name}"
        for name in (
            "set_velparams", "req_velparams", "get_velparams", "req_mode", "get_mode", "move_header",
            "move", "moved_header", "moved_servo", "moved_coil", "echo", "alive",
        )
    ]  # fmt: skip


def test_macros(core: str) -> None:
    found = dict(re.findall(r"^#define (TINY_POS_MOVED\w+) (.+)$", core, re.MULTILINE))
    assert found == {
        "TINY_POS_MOVED_ID": "0x0121U",
        "TINY_POS_MOVED_HEADER_LENGTH": "0U",
        "TINY_POS_MOVED_HEADER_SIZE": "6U",
        "TINY_POS_MOVED_HEADER_INIT": "TINY_BRACED(0, 7U)",
        "TINY_POS_MOVED_SERVO_LENGTH": "14U",
        "TINY_POS_MOVED_SERVO_SIZE": "20U",
        "TINY_POS_MOVED_SERVO_INIT": "TINY_BRACED(0, 0, 0, 0, 0)",
        "TINY_POS_MOVED_COIL_LENGTH": "14U",
        "TINY_POS_MOVED_COIL_SIZE": "20U",
        "TINY_POS_MOVED_COIL_INIT": "TINY_BRACED(0, 0, 0, 0)",
    }


def test_a_message_without_a_layout_has_an_id(files: dict[str, str]) -> None:
    text = files["c/stagewire_tiny/messages/extra.h"]
    assert "#define TINY_LAMP_TEST_ID 0x0202U" in text
    assert "tiny_lamp_test" not in text
    assert "LAMP_BROKEN_ID" not in text  # it has no id either


def test_prefix() -> None:
    assert c_prefix("stagewire_apt") == "apt"
    assert c_prefix("carousel") == "carousel"


@pytest.mark.parametrize(("name", "taken"), [("STATUS", True), ("COPY", True), ("STATE", False)])
def test_a_name_that_every_package_uses_gets_a_suffix(
    protocol: Protocol, name: str, taken: bool
) -> None:
    [move] = [m for m in protocol.messages if m.name == "POS_MOVE"]
    plain = f"{name.lower()}_message" if taken else name.lower()
    assert c_layouts(replace(move, name=name)) == {
        "header": f"{name.lower()}_header",
        "data": plain,
    }
    table = Enumeration(name.lower(), 1, "", (), PLACE)
    assert c_table(table) == (f"{name.lower()}_values" if taken else name.lower())
    flags = FlagTable(name.lower(), 1, "", Format("word", 2, False, "integer"), (), PLACE)
    assert c_table(flags) == (f"{name.lower()}_bits" if taken else name.lower())


def code_of(files: dict[str, str], package: str) -> Iterator[str]:
    """Yield the files of a package without comments and strings."""
    for path, text in files.items():
        if path.startswith(f"c/{package}/"):
            yield COMMENT.sub("", text)


def test_all_names_that_do_not_come_from_a_spec_are_reserved(
    protocol: Protocol, layouts: Protocol, commands: Protocol, packets: Protocol
) -> None:
    """A spec cannot use the names that every package defines."""
    committed = check(ROOT / "spec")
    for one in (protocol, layouts, commands, packets, *committed):
        prefix = c_prefix(one.package)
        kept = {f"{prefix}_{name}" for name in C_OURS}
        kept |= {f"{prefix.upper()}_{name}" for name in c_names.OUR_MACROS}
        of_spec = {name for name, _, _ in c_names.defined(one)}
        text = "\n".join(code_of(render([one], ["c"]), one.package))
        found = set(re.findall(rf"\b(?:{prefix}|{prefix.upper()})_\w+", text))
        assert found - kept - of_spec == set(), one.name


# Comments


def test_comment_on_a_message(core: str) -> None:
    text = part(core, "/**\n * Reports the velocity parameters.", "typedef")
    assert text.splitlines() == [
        "/**",
        " * Reports the velocity parameters. Speed of the next move.",
        " *",
        " * POS_GET_VELPARAMS (0x0103), to the host, 14 bytes of data; pages 4, 5.",
        " */",
    ]
    words = " ".join(core.replace("\n * ", " ").split())
    assert "Completes with POS_MOVED. Muted by POS_ALIVE." in words
    assert "This layout is used if status is servo." in words


def test_comments_on_members(core: str) -> None:
    text = part(core, "typedef struct tiny_pos_set_velparams {", "}")
    assert text.splitlines()[1:] == [
        "    /** See enum tiny_channel; from 0 to 65535; default 1. */",
        "    uint16_t chan_ident;",
        "    /**",
        "     * Always zero at present; in counts; scale to mm/s depends on the stage; "
        "from 0 to 1000;",
        "     * default 0.",
        "     */",
        "    int32_t min_velocity;",
        "    /** In counts; scale to mm/s depends on the stage; from 0 to 4294967295. */",
        "    uint32_t max_velocity;",
        "    /** In counts of 512/5 us; from -32768 to 32767. */",
        "    int16_t wait;",
        "    /** Always 0x1234. */",
        "    uint16_t marker;",
    ]
    assert (
        "/** Bits TINY_STATE_BITS_...; from 0 to 4294967295. */\n    uint32_t status_bits;" in core
    )


def test_comments_name_errata(files: dict[str, str]) -> None:
    text = files["c/stagewire_tiny/messages/extra.h"]
    assert (
        " * Erratum tiny-lamp-test (MSG_LAMP_TEST and MSG_LAMP_BROKEN): printed the names; encoded "
        "messages\n * without a layout.\n"
    ) in text


def test_python_and_c_describe_a_field_in_the_same_words(files: dict[str, str], core: str) -> None:
    fact = "in counts of 512/5 us; from -32768 to 32767."
    assert f":param wait: {fact}" in files["python/stagewire_tiny/messages/core.py"]
    assert fact[1:] in core


def test_no_line_is_too_long() -> None:
    """Code and comments have at most 100 columns."""
    for protocol in check(ROOT / "spec"):
        for path, text in render([protocol], ["c"]).items():
            if path.endswith((".h", ".c")):
                assert [line for line in text.splitlines() if len(line) > 100] == [], path


# Fields


def test_fields_are_plain_members(core: str) -> None:
    text = part(core, "typedef struct tiny_pos_echo {", "}")
    members = [line.strip() for line in text.splitlines()[1:] if not line.strip().startswith("/")]
    assert members == ["char label[8];", "uint8_t blob[6];", "uint16_t load;"]


def test_fields_are_written_in_order(core: str) -> None:
    text = part(core, "void tiny_pos_set_velparams_write_fields(", "\n}\n")
    assert text.splitlines()[3:] == [
        "    uint8_t *at = tiny_put_16(out, message->chan_ident);",
        "    at = tiny_put_32(at, (uint32_t)message->min_velocity);",
        "    at = tiny_put_32(at, message->max_velocity);",
        "    at = tiny_put_16(at, (uint32_t)message->wait);",
        "    (void)tiny_put_16(at, message->marker);",
    ]


def test_fields_are_read_at_their_offsets(core: str) -> None:
    text = part(core, "tiny_pos_echo_decode(", "    return")
    assert [line.strip() for line in text.splitlines()[5:-1]] == [
        "tiny_copy(message->label, 8U, &frame[6]);",
        "tiny_copy(message->blob, 6U, &frame[14]);",
        "message->load = tiny_get_16(&frame[20]);",
    ]


def test_parameters_are_bytes(core: str) -> None:
    text = part(core, "void tiny_pos_get_mode_write_fields(", "\n}\n")
    assert text.splitlines()[2:] == [
        "    out[0] = message->chan_ident;",
        "    out[1] = message->move_mode;",
    ]


def test_ranges_are_checked_where_the_type_allows_more(core: str) -> None:
    text = part(core, "tiny_pos_set_velparams_encode(", "return")
    assert re.findall(r"\|\| (.*?)\)*(?: \{)?\n", text) == [
        "message->min_velocity < 0",
        "message->min_velocity > 1000",
    ]
    text = part(core, "tiny_pos_get_mode_encode(", "return")
    assert re.findall(r"\|\| (.*?)\)*(?: \{)?\n", text) == [
        "message->move_mode < 1U",
        "message->move_mode > 4U",
    ]
    text = part(core, "tiny_pos_move_encode(", "return")
    assert "message->" not in text


@pytest.mark.parametrize(
    ("format", "least", "greatest", "refused"),
    [
        (Format("byte", 1, False, "integer"), 0, 255, ()),
        (Format("byte", 1, False, "integer"), 1, 254, ("message->x < 1U", "message->x > 254U")),
        (Format("short", 2, True, "integer"), -32768, 32767, ()),
        (Format("short", 2, True, "integer"), -32767, 32766,
         ("message->x < -32767", "message->x > 32766")),
        (Format("u24", 3, False, "integer"), 0, 2**24 - 1, ("message->x > UINT32_C(16777215)",)),
        (Format("u64", 8, False, "integer"), 0, 2**64 - 1, ()),
    ],
)  # fmt: skip
def test_a_range_that_is_almost_the_range_of_its_type(
    protocol: Protocol, format: Format, least: int, greatest: int, refused: tuple[str, ...]
) -> None:
    field = Field("x", 0, format, "value", least, greatest, 1, PLACE)
    assert field_view(names_of(protocol), field, 0).refused == refused


def test_integers_of_24_bits_are_range_checked(command_files: dict[str, str]) -> None:
    """Their C type has more bits."""
    text = "".join(text for path, text in command_files.items() if path.endswith("walk.h"))
    assert "-INT32_C(8388608)" in text
    assert re.search(r"message->\w+ = turtle_signed_24\(turtle_get_24\(&\w+\[\d+\]\)\);", text)


def test_initialiser(core: str) -> None:
    defined = "#define TINY_POS_SET_VELPARAMS_INIT TINY_BRACED(1U, 0, 0, 0, 4660U)\n"
    assert defined in core
    assert "#define TINY_POS_ECHO_INIT TINY_BRACED({0}, {0}, 0)\n" in core


# Enumerations and flags


def enumeration(*values: int) -> Enumeration:
    made = tuple(EnumValue(f"V{n}", value, "") for n, value in enumerate(values))
    return Enumeration("speed", 4, "How fast.", made, PLACE)


def test_small_values_are_an_enum(protocol: Protocol, files: dict[str, str]) -> None:
    view = enumeration_view(names_of(protocol), protocol, enumeration(-32768, 0, 32767))
    assert view.is_enum
    assert [member.value for member in view.members] == ["-32768", "0", "32767"]
    text = part(files["c/stagewire_tiny/enumerations.h"], "enum tiny_channel {", "};")
    assert text.splitlines()[1:] == [
        "    /** The first. */",
        "    TINY_CHANNEL_CHANNEL_1 = 1,",
        "    TINY_CHANNEL_CHANNEL_2 = 2",
    ]


@pytest.mark.parametrize(
    ("values", "literals"),
    [
        ((1, 32768), ["UINT32_C(1)", "UINT32_C(32768)"]),
        ((0xFFFFFFFF,), ["UINT32_C(4294967295)"]),
        ((1 << 32,), ["UINT64_C(4294967296)"]),
        ((-1, 32768), ["-1", "INT32_C(32768)"]),
        ((-0x80000000,), ["(-INT32_C(2147483647) - 1)"]),
        ((-1, 0x80000000), ["-1", "INT64_C(2147483648)"]),
    ],
)
def test_large_values_are_macros(
    protocol: Protocol, values: tuple[int, ...], literals: list[str]
) -> None:
    view = enumeration_view(names_of(protocol), protocol, enumeration(*values))
    assert not view.is_enum
    assert [member.value for member in view.members] == literals
    assert all(member.doc for member in view.members)


@pytest.mark.parametrize(
    ("size", "mask"),
    [
        (1, "0x20U"),
        (2, "0x0020U"),
        (4, "UINT32_C(0x00000020)"),
        (8, "UINT64_C(0x0000000000000020)"),
    ],
)
def test_flags_are_masks(protocol: Protocol, size: int, mask: str) -> None:
    format = Format("x", size, False, "integer")
    table = FlagTable("lights", 4, "", format, (FlagBit("on", 5, "it is lit"),), PLACE)
    view = flag_table_view(names_of(protocol), protocol, table)
    [member] = view.members
    assert (member.name, member.value) == ("TINY_LIGHTS_ON", mask)
    assert member.doc == "/** Bit 5: it is lit. */"


# Pieces of C


@pytest.mark.parametrize(
    ("text", "escaped"),
    [
        ("*/", "* /"),
        ("/*/*", "/ * / *"),
        ("**//", "** //"),
        ("??/ ???/", "? ?/ ? ? ?/"),
        ("a\\b \\n", "a\\\\b \\\\n"),
        ("@file x@y", "\\@file x\\@y"),
        ("<b> &amp; #x 5 % x%y </a>", "\\<b> \\&amp; \\#x 5 % x\\%y \\</a>"),
        ("a < b & c", "a < b & c"),
        (" a\n  b ", "a b"),
    ],
)
def test_text_in_a_comment(text: str, escaped: str) -> None:
    assert plain(text) == escaped


def test_comment() -> None:
    assert comment(["It."]) == "/** It. */"
    assert comment(["It.", "", "More."], 4) == "/**\n     * It.\n     *\n     * More.\n     */"
    assert comment_lines(["It.", "More."]) == (" * It.", " *", " * More.")


@pytest.mark.parametrize("indent", [0, 4])
@pytest.mark.parametrize("length", range(85, 105))
def test_a_comment_on_one_line_fits(length: int, indent: int) -> None:
    made = comment(["x" * length], indent)
    assert ("\n" in made) is (indent + length + len("/**  */") > 100)


@pytest.mark.parametrize(
    ("text", "literal"),
    [
        ("plain", '"plain"'),
        ('"\\', '"\\"\\\\"'),
        ("a??/b", '"a\\?\\?/b"'),
        ("é1", '"\\303\\2511"'),
        ("\0\n\x7f", '"\\000\\012\\177"'),
    ],
)
def test_string(text: str, literal: str) -> None:
    assert string(text) == literal
    assert octets(text.encode("utf-8")) == literal


@pytest.mark.parametrize(
    ("value", "size", "signed", "literal"),
    [
        (5, 1, False, "5U"), (-5, 1, True, "-5"), (5, 4, False, "UINT32_C(5)"), (-5, 4, True, "-5"),
        (40000, 4, True, "INT32_C(40000)"), (-40000, 4, True, "-INT32_C(40000)"),
        (-32768, 2, True, "-INT32_C(32768)"), (-32768, 4, True, "-INT32_C(32768)"),
        (-0x80000000, 4, True, "(-INT32_C(2147483647) - 1)"),
        (-0x8000000000000000, 8, True, "(-INT64_C(9223372036854775807) - 1)"),
        (0xFFFFFFFFFFFFFFFF, 8, False, "UINT64_C(18446744073709551615)"),
    ],
)  # fmt: skip
def test_integer(value: int, size: int, signed: bool, literal: str) -> None:
    assert integer(value, size, signed) == literal


def test_mask() -> None:
    assert unsigned(0x20, 4, 8) == "UINT32_C(0x00000020)"


def test_call_breaks() -> None:
    assert call("f", ["a", "b"], ";") == "f(a, b);"
    assert call("f" * 60, ["a" * 30, "b" * 30], ";", 4) == (
        f"{'f' * 60}(\n        {'a' * 30}, {'b' * 30});"
    )
    assert call("f", ["a" * 60, "b" * 60]) == f"f(\n    {'a' * 60},\n    {'b' * 60})"


def test_definition_breaks() -> None:
    assert definition("X", "1") == "#define X 1"
    long = definition("X", ", ".join(["12345678"] * 20))
    assert all(line.endswith(" \\") for line in long.splitlines()[:-1])
    assert all(len(line) <= 100 for line in long.splitlines())


# Names that are refused


def faults(protocol: Protocol) -> list[str]:
    diagnostics = Diagnostics()
    c_names.check_c_names(protocol, diagnostics)
    return [f"{d.code} {d.message}" for d in diagnostics]


def named(protocol: Protocol, *names: str) -> Protocol:
    """Return the protocol with only messages of these names."""
    [alive] = [m for m in protocol.messages if m.name == "POS_ALIVE"]
    return replace(protocol, messages=tuple(replace(alive, name=name) for name in names))


def test_good_specs_have_no_faults(
    protocol: Protocol, commands: Protocol, packets: Protocol
) -> None:
    for one in (protocol, commands, packets):
        assert faults(one) == []


@pytest.mark.parametrize(
    ("names", "fault"),
    [
        (("A", "A_ENCODE"), "SW022 A_ENCODE and A would both be named tiny_a_encode in C"),
        (("A", "A_DECODE"), "SW022 A_DECODE and A would both be named tiny_a_decode in C"),
        (("A_SIZE", "A"), None),
        (("HEADER",), "SW023 HEADER: in C, TINY_HEADER_SIZE is reserved"),
        (("WRONG",), "SW023 WRONG: in C, TINY_WRONG_ID is reserved"),
        (("STATUS",), None),
        (("STATUS", "STATUS_MESSAGE"),
         "SW022 STATUS_MESSAGE and STATUS would both be named tiny_status_message in C"),
        (("PARSER_INIT",), None),
        (("LAYOUT_A", "A_ID"),
         "SW022 A_ID and LAYOUT_A would both be named TINY_LAYOUT_A_ID in C"),
    ],
)  # fmt: skip
def test_messages(protocol: Protocol, names: tuple[str, ...], fault: str | None) -> None:
    assert faults(named(protocol, *names)) == ([fault] if fault else [])


@pytest.mark.parametrize(
    ("package", "name", "reserved"),
    [
        ("static", "ASSERT", "static_assert"),
        ("int8", "T", "int8_t"),
        ("dynamic", "CAST", "dynamic_cast"),
        ("ptrdiff", "T", "ptrdiff_t"),
    ],
)
def test_a_prefix_and_a_name_can_form_a_reserved_word(
    protocol: Protocol, package: str, name: str, reserved: str
) -> None:
    protocol = replace(named(protocol, name), package=package, enumerations=(), flags=())
    assert f"SW023 {name}: in C, {reserved} is reserved" in faults(protocol)


def test_names_must_differ_in_their_first_63_characters(protocol: Protocol) -> None:
    long = "A" * 49  # tiny_AAA…_encode and tiny_AAA…_encode_unchecked differ in the 63rd
    assert faults(named(protocol, f"{long}X", f"{long}Y")) == []
    [fault] = faults(named(protocol, f"{long}XX"))
    name = f"tiny_{long.lower()}xx_encode"
    assert fault == (
        f"SW022 {long}XX: the first 63 characters of {name}_unchecked and {name} are the same in C"
    )
    [*_, fault] = faults(named(protocol, f"{long}AAAAAAAAAX", f"{long}AAAAAAAAAY"))
    assert f"{long}AAAAAAAAAY and {long}AAAAAAAAAX" in fault
