"""Hints that are more specific than the hint of their code, for typical mistakes of newcomers."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from stagewire_generator import check
from stagewire_generator.diagnostics import SpecError


@pytest.mark.parametrize(
    ("file", "old", "new", "hint"),
    [
        ("protocol.yaml", "page: 1\n", "pag: 1\n", "did you mean page?"),
        ("protocol.yaml", 'issue: "3"', "issue: 3", "put it in quotes"),
        ("messages/parts.yaml", "quantity: lift", "quantity: lifts", "did you mean lift?"),
        ("messages/parts.yaml", "enum: filter", "enum: colour", "correct the spelling, or define the name"),
        ("quantities.yaml", "um_per_count", "mm_per_count",
         "write counts_per_um or um_per_count, or correct the unit"),
        ("protocol.yaml", "  start: [0xAA, 0x55]\n", "",
         "if packets have no start bytes, as frames of a fixed size often have none, Stagewire cannot "
         "describe them yet: do not invent any; see `Supported packet structures` in "
         "docs/tutorials/your-own-protocol.md"),
        ("protocol.yaml", "  length: {format: u8, counts: [address, id, payload]}\n", "",
         "if packets have no length, as frames of a fixed size often have none, Stagewire cannot "
         "describe them yet: do not invent one; see `Supported packet structures` in "
         "docs/tutorials/your-own-protocol.md"),
        ("protocol.yaml", "witness: false\n", "",
         "transcribe the document; without a printed document, write `witness: false` in protocol.yaml"),
    ],
)  # fmt: skip
def test_hint(packets_spec: Path, file: str, old: str, new: str, hint: str) -> None:
    path = packets_spec / "carousel" / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(packets_spec)
    assert hint in [diagnostic.cure for diagnostic in caught.value.diagnostics]


def test_a_message_that_a_transcription_lacks_belongs_in_an_overlay(spec: Path) -> None:
    path = spec / "tiny" / "printed" / "extra.yaml"
    text = path.read_text(encoding="utf-8")
    entry = '  LAMP:\n    heading: {page: 7, line: 60, id: "0x0201"}\n'
    assert entry in text
    path.write_text(text.replace(entry, ""), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(spec)
    [cure] = {d.cure for d in caught.value.diagnostics if d.code == "SW043"}
    assert "in an overlay (docs/how-to/overlays.md)" in cure
    assert "witness: false" not in cure


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ("AUX_HEAT_STATE:", "SUN_HEAT_STATE:",
         "list SUN under `groups` in protocol.yaml or overlay.yaml, or add it to the spelling"),
        ("spelling: heat state", "spelling: heat stat",
         "make the words, when joined, equal the name without its group"),
        ("AUX_HEAT_STATE:", "SUN_HEATED_STATE:",
         "make the words, when joined, equal the name without its group"),
        ("id: 0x0304", "id: 0x0201",
         "to replace the message of the protocol, give the new one the same name and list it under "
         "`overrides` in overlay.yaml; otherwise one of the ids is wrong"),
        ("id: 0x0304", "id: 0x0303", "one of the ids is wrong: compare both with the document"),
    ],
    ids=["group", "letter", "both", "id of the protocol", "id of the overlay"],
)  # fmt: skip
def test_hint_in_an_overlay(
    overlaid_spec: Path, tmp_path: Path, old: str, new: str, hint: str
) -> None:
    spec = Path(shutil.copytree(overlaid_spec, tmp_path / "spec"))
    path = spec / "tiny" / "overlays" / "second" / "messages" / "heat.yaml"
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert hint in [d.cure for d in caught.value.diagnostics if d.code in ("SW024", "SW030")]


def test_hint_for_a_partly_described_chapter(spec: Path) -> None:
    path = spec / "tiny" / "messages" / "extra.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("page: 7\norder: 2\n", "order: 2\n", 1), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert [(str(d.place), d.message, d.cure) for d in caught.value.diagnostics] == [
        ("tiny/messages/extra.yaml:3:1", "messages: page is missing: title requires page and order",
         "add page, or remove title"),
        ("tiny/messages/extra.yaml:4:1", "messages: page is missing: order requires title and page",
         "add page, or remove order"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("overlays/second/units.yml", "overlays/second/units.yaml"),
        ("overlays/second/heat.yaml", "overlays/second/messages/"),
        ("overlays/second/captures/captures.yaml", "overlays/second/captures.yaml"),
        ("overlay/second/overlay.yaml", "overlays/NAME/overlay.yaml"),
        ("controllers.yaml", "stages.yaml"),
        ("captures/tiny.yaml", "captures.yaml"),
    ],
)
def test_hint_for_a_misplaced_file(
    overlaid_spec: Path, tmp_path: Path, wrong: str, right: str
) -> None:
    """Worked examples and captures begin like a protocol; their second key identifies them."""
    spec = Path(shutil.copytree(overlaid_spec, tmp_path / "spec"))
    first = {
        "units.yml": "families: {}\nunits: {}",
        "heat.yaml": "chapter: heat",
        "captures.yaml": "protocol: tiny\ncaptures: {}",
        "overlay.yaml": "overlay: second",
        "controllers.yaml": "controllers: {}\nstages: {}",
        "tiny.yaml": "protocol: tiny\ncaptures: {}",
    }
    path = spec / "tiny" / wrong
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(first[path.name] + "\n", encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert [(d.code, str(d.place), d.cure) for d in caught.value.diagnostics] == [
        ("SW008", f"tiny/{wrong}:1:1", f"move it to tiny/{right}, with a name that ends in .yaml")
    ]


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ("id: 0x0201", "id: 0X0201", "write 0x0201, or quote it if it is text"),
        ("id: 0x0201", "id: 1_000", "put it in quotes"),
        ("# yaml", "\ufeff# yaml", "save the file as UTF-8 without a byte order mark"),
        ("title: ", "title: \ufeff", "remove the character"),
    ],
    ids=["capital X", "no number", "byte order mark", "invisible"],
)
def test_hint_for_an_unreadable_value(spec: Path, old: str, new: str, hint: str) -> None:
    path = spec / "tiny" / "messages" / "extra.yaml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert [d.cure for d in caught.value.diagnostics if d.code in ("SW004", "SW007")] == [hint]


def test_a_stage_with_its_own_scales_and_those_of_another_is_refused_plainly(spec: Path) -> None:
    path = spec / "tiny" / "stages.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(
        text.replace("    limits:\n", "    like: Other\n    limits:\n"), encoding="utf-8"
    )
    with pytest.raises(SpecError) as caught:
        check(spec)
    [said] = [diagnostic.message for diagnostic in caught.value.diagnostics]
    assert said == "stages.Slide: a stage has either controllers or like"
    [cure] = [diagnostic.cure for diagnostic in caught.value.diagnostics]
    assert cure == "keep one of them; add controllers to the stage that it is like"


@pytest.mark.parametrize(
    ("file", "old", "new", "hint"),
    [
        ("units.yaml", "status: dc", "status: dcc", "did you mean dc?"),
        ("units.yaml", "status: dc", "status: warm", "write one of them"),
        ("units.yaml", "usb_prefix: 71", 'usb_prefix: "71"', "remove the quotes"),
        ("units.yaml", "    page: 3\n    usb_prefix", "    usb_prefix", "add page"),
        ("units.yaml", "channels: 1", "channels: 0",
         "see units.schema.json; `stagewire schemas DIR` writes it to DIR"),
        ("units.yaml", "stages: [Slide]", "stages: [Slyde]", "did you mean Slide?"),
        ("units.yaml", "family: listed", "family: lister", "did you mean listed?"),
        ("units.yaml", "like: TP1,", "like: TP5,", "did you mean TP1?"),
        ("units.yaml", "units: [TP1]", "units: [TP5]", "did you mean TP9 or TP2 or TP1?"),
        ("units.yaml", "[POS_MOVE, POS_MOVED, POS_ALIVE]\n", "[POS_MOVE, POS_MUVED, POS_ALIVE]\n",
         "did you mean POS_MOVED or POS_MOVE or POS_MODE?"),
        ("units.yaml", "usb_prefix: 72, address: rack, channels: 1, bays: 2, family: listed",
         "usb_prefix: 71, address: rack, channels: 1, bays: 2, family: plain",
         "look up the prefix, and the families: units with one prefix are of one family"),
        ("examples.yaml", "[tiny-lamp-test]", "[tiny-lamb-test]",
         "did you mean tiny-lamp-test or tiny-move-length?"),
    ],
)  # fmt: skip
def test_hint_for_a_mistake_about_units(
    spec: Path, file: str, old: str, new: str, hint: str
) -> None:
    path = spec / "tiny" / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert hint in [diagnostic.cure for diagnostic in caught.value.diagnostics]
