"""Sizes of the generated C on a Cortex-M0, compared with fixed limits and with the committed table."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import callgraph
import pytest
import size_table
import sizes
from toolchain import CORTEX_M0, Package, compiles, need, of_each_package, packages, symbols

from checkout import ROOT
from stagewire.protocols import load_protocol
from stagewire_generator import check, reduced, render
from stagewire_generator.output import write

PARSER = 640
SEVERAL_LENGTHS = 32  # of the parser, if a message has packets of several lengths
SUB_MESSAGES = 360  # of the parser, if messages share an id
WITHOUT_FLAG = 68  # of the parser, if some packets are also received without the data flag
SUB_MESSAGES_STACK = 40
ARRAYS = 360  # of the parser, unless PREFIX_NO_ARRAYS is defined
ARRAYS_STACK = 32
HELPERS = 152
PAIR_OF_14_BYTES = 160
TABLE_OF_A_MESSAGE = 8
RECEIVE_BUFFER = 280
LONGEST_PLAIN = 255  # bytes of the longest packet without an array
STACK = 128

FAMILIES = {
    "KDC101", "KIM101", "PDXC2", "MPC320", "MFF101", "KSC101", "KPZ101", "KPC101", "BPC303", "PPC001",
    "KSG101", "KNA101", "KPA101", "KLD101", "KLS635", "TTC001",
}  # fmt: skip
"""A unit of each family; the page on C has the size of its reduced package."""

Measured = dict[str, tuple[Path, dict[str, int]]]


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Measured:
    """The objects and figures of each package, by prefix."""
    need(sizes.GCC)
    made: Measured = {}
    for package in packages():
        folder = tmp_path_factory.mktemp(package.prefix)
        made[package.prefix] = folder, dict(sizes.measure(package, folder))
    return made


def objects(folder: Path) -> Iterator[Path]:
    """Return the objects with the code for users."""
    yield from (path for path in folder.glob("*.o") if not path.stem.endswith("_types"))


@pytest.mark.matrix
@of_each_package
def test_objects_need_no_other_code(package: Package, measured: Measured) -> None:
    folder, _ = measured[package.prefix]
    for path in objects(folder):
        undefined = compiles("arm-none-eabi-nm", "-u", path)
        assert undefined == "", f"{path.name} calls {undefined}"


@pytest.mark.matrix
@of_each_package
def test_nothing_is_in_ram(package: Package, measured: Measured) -> None:
    folder, _ = measured[package.prefix]
    for path in objects(folder):
        writable = [row for row in symbols("arm-none-eabi-nm", path) if row[1] in "dDbBC"]
        assert writable == []
        sections = [row.split() for row in compiles("arm-none-eabi-size", "-A", path).splitlines()]
        sizes_by_name = {
            row[0]: int(row[1]) for row in sections if len(row) == 3 and row[1].isdigit()
        }
        assert (sizes_by_name[".data"], sizes_by_name[".bss"]) == (0, 0)
        assert not any(name.startswith((".data.", ".bss.")) for name in sizes_by_name)


@pytest.mark.matrix
def test_the_parser_is_small(measured: Measured) -> None:
    for prefix, (_, figures) in measured.items():
        limit = PARSER + (SEVERAL_LENGTHS + SUB_MESSAGES + WITHOUT_FLAG) * (prefix == "apt")
        assert figures[f"{prefix}/parser"] <= limit
        assert figures.get(f"{prefix}/arrays/parser", 0) <= limit + ARRAYS
        assert figures.get(f"{prefix}/replies", 0) <= PARSER


@pytest.mark.matrix
def test_the_parser_of_issue_3_is_small(tmp_path: Path) -> None:
    need(sizes.GCC)
    protocols = check(ROOT / "spec" / "thorlabs_apt", base=True)
    write(tmp_path, render(protocols, ["c"]))
    folder = tmp_path / "c"
    figures = sizes.of_parser(Package(folder / protocols[0].package), folder)
    assert 0 < figures["parser"] <= PARSER


def rows_of_the_page() -> list[tuple[str, str, str, str]]:
    """Return the rows of reduced packages on the page on C."""
    page = (ROOT / "docs" / "reference" / "c.md").read_text(encoding="utf-8")
    table = page.partition("| `--unit` | messages |")[2].partition("\n\n")[0]
    return re.findall(r"^\| (.+?) \| ([\d,]+) \| ([\d,]+) \| ([\d,]+) \|$", table, re.MULTILINE)


@pytest.mark.matrix
@pytest.mark.parametrize("row", rows_of_the_page(), ids=lambda row: row[0])
def test_the_page_has_the_sizes_of_reduced_packages(
    row: tuple[str, str, str, str], tmp_path: Path
) -> None:
    """They may differ by 5 %."""
    need(sizes.GCC)
    title, *stated = row
    [protocol] = check(ROOT / "spec" / "thorlabs_apt", base="--base" in title)
    unit = re.match(r"`(\w+)`", title)
    protocol = reduced(protocol, [unit[1]]) if unit else protocol
    write(tmp_path, render([protocol], ["c"]))
    package = Package(tmp_path / "c" / protocol.package)
    options = ["-DAPT_NO_ARRAYS"] if "APT_NO_ARRAYS" in title else []
    found = [len(protocol.messages)]
    options += [*CORTEX_M0, "-std=c99", f"-I{package.folder.parent}"]
    made = tmp_path / "parser.o"
    for names in (["-DAPT_NO_NAMES"], []):
        compiles(sizes.GCC, *options, *names, "-c", package.source, "-o", made)
        found.append(int(compiles("arm-none-eabi-size", made).splitlines()[1].split()[0]))
    messages, *figures = (int(figure.replace(",", "")) for figure in stated)
    assert found[0] == messages
    assert found[1:] == pytest.approx(figures, rel=0.05)


def test_every_family_has_a_reduced_package_on_the_page() -> None:
    found = {word for row in rows_of_the_page() for word in re.findall(r"`([A-Z0-9]+)`", row[0])}
    assert found >= FAMILIES


def messages(protocol: str) -> list[dict[str, Any]]:
    """Return the messages of a protocol in the registry."""
    return list(load_protocol(protocol).registry()["messages"])


def takes_all(field: dict[str, Any]) -> bool:
    """Whether a field accepts every value of its format, so that no check is needed."""
    values = int(field["maximum"]) - int(field["minimum"]) + 1
    return bool(values == 1 << 8 * field["size"])


def of_14_bytes() -> list[str]:
    """Return the messages with a packet of 14 bytes, of at most five integers without a narrower range."""
    found = []
    for message in messages("thorlabs_apt"):
        fields = [field for layout in message["layouts"] for field in layout["fields"]]
        lengths = {layout["length"] for layout in message["layouts"]}
        few = len(fields) <= 5 * len(message["layouts"])
        if lengths == {14} and few and all(f["kind"] == "integer" and takes_all(f) for f in fields):
            found.append(f"apt_{message['name'].lower()}")
    return found


@pytest.mark.matrix
def test_a_payload_of_14_bytes_needs_little_code(measured: Measured) -> None:
    _, figures = measured["apt"]
    names = [name.replace("_", "/", 1) for name in of_14_bytes()]
    assert len(names) >= 5
    pairs = {name: figures[f"{name}/encode"] + figures[f"{name}/decode"] for name in names}
    assert {name: size for name, size in pairs.items() if size > PAIR_OF_14_BYTES} == {}


@pytest.mark.matrix
def test_shared_code_is_small(measured: Measured) -> None:
    folder, _ = measured["apt"]
    made = folder / "apt_accessors.o"
    roots = {f"{name}_{function}" for name in of_14_bytes() for function in ("encode", "decode")}
    reached = callgraph.read([made.with_suffix(".ci")]).reached(roots)
    code = {name: size for name, _, size in symbols("arm-none-eabi-nm", made)}
    helpers = {name: code[name] for name in reached - roots}
    assert len(helpers) >= 2, "there is no shared code, so the other limit means something else"
    assert sum(helpers.values()) <= HELPERS, helpers


@pytest.mark.matrix
def test_the_table_is_small(measured: Measured) -> None:
    _, figures = measured["apt"]
    assert 0 < figures["apt/table"] <= TABLE_OF_A_MESSAGE * len(messages("thorlabs_apt"))
    _, figures = measured["ms2000"]
    assert 0 < figures["ms2000/table"] <= TABLE_OF_A_MESSAGE * len(messages("asi_ms2000"))


@pytest.mark.matrix
@of_each_package
def test_the_receive_buffer_is_small(package: Package, tmp_path: Path) -> None:
    """Without packets of arrays, which need the length of the longest one."""
    need(sizes.GCC)
    prefix = package.prefix.upper()
    for option in (f"-D{prefix}_NO_ARRAYS", f"-D{prefix}_LONGEST_PACKET={LONGEST_PLAIN}U"):
        owned = sizes.sizes_of_types(package, tmp_path, option)
        assert "sizeof_parser" in owned
        assert {name: size for name, size in owned.items() if size > RECEIVE_BUFFER} == {}


@pytest.mark.matrix
def test_the_buffer_for_arrays_has_room_for_the_longest_one(measured: Measured) -> None:
    _, figures = measured["apt"]
    layouts = [layout for message in messages("thorlabs_apt") for layout in message["layouts"]]
    longest = max(layout.get("longest", 0) for layout in layouts)
    assert longest > LONGEST_PLAIN
    room = figures["apt/arrays/sizeof_parser"] - longest
    assert 0 < room <= RECEIVE_BUFFER - LONGEST_PLAIN


@pytest.mark.matrix
def test_the_stack_is_small(measured: Measured) -> None:
    for folder, figures in measured.values():
        for path in objects(folder):
            graph = callgraph.read([path.with_suffix(".ci")])
            assert graph.calls
            assert graph.cycle() == []
            assert graph.indirect() == [], "calls through pointers are not counted"
            assert graph.unbounded == frozenset()
        stacks = {name: size for name, size in figures.items() if name.endswith("stack")}
        limit = STACK + SUB_MESSAGES_STACK
        assert stacks.pop("apt/arrays/parser_stack", 0) <= limit + ARRAYS_STACK
        assert stacks.pop("apt/parser_stack", 0) <= limit
        assert {name: size for name, size in stacks.items() if size > STACK} == {}


@pytest.mark.matrix
def test_nothing_grew(measured: Measured) -> None:
    now = {name: size for _, figures in measured.values() for name, size in figures.items()}
    made_by, table = size_table.read()
    note = f"\nthe table is of {made_by}, this is {sizes.compiler()}" * (
        made_by != sizes.compiler()
    )
    grown = "\n".join(size_table.grown(table, now))
    assert not grown, f'{grown}{note}\nrenew the table: make c-sizes REASON="why"'


# The comparison


def test_growth_is_reported_by_name() -> None:
    table = {"apt/parser": 600, "apt/x/encode": 40, "apt/gone": 3, "apt/same": 1}
    now = {"apt/parser": 631, "apt/x/encode": 42, "apt/new": 7, "apt/same": 0}
    assert size_table.grown(table, now) == [
        "apt/gone: only in the table",
        "apt/new: not in the table",
        "apt/parser: 600 -> 631 bytes",
    ]


@pytest.mark.matrix
def test_a_table_that_was_smaller_is_found(measured: Measured) -> None:
    _, table = size_table.read()
    _, figures = measured["apt"]
    doctored = {**table, "apt/parser": figures["apt/parser"] * 9 // 10}
    assert size_table.grown(doctored, {**table, **figures}) == [
        f"apt/parser: {doctored['apt/parser']} -> {figures['apt/parser']} bytes"
    ]


def test_the_table_keeps_figures_and_reasons(tmp_path: Path) -> None:
    path = tmp_path / "sizes.toml"
    figures = {"apt/parser": 600, "apt/x/encode": 40, "apt/x/decode": 4, "ms2000/parser": 1}
    size_table.write(figures, "a compiler", 'the "first"', path)
    size_table.write(figures, "a compiler", "a \\ second", path)
    assert size_table.read(path) == ("a compiler", figures)
    text = path.read_text(encoding="utf-8")
    assert text.index('"the \\"first\\""') < text.index('"a \\\\ second"')
