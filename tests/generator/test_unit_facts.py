"""Facts of units of later issues: several lists, own addresses, built-in stages, unsupported units."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import plain_yaml
from files import write_files
from stagewire_generator import check, render
from stagewire_generator.diagnostics import SpecError
from stagewire_generator.model import Protocol

MORE = {"title": "More messages of the TP1", "page": 9, "units": ["TP1"], "messages": ["LAMP"]}


@pytest.fixture
def described(spec: Path) -> Protocol:
    """The small good spec with the facts of later issues."""
    path = spec / "tiny" / "units.yaml"
    data: dict[str, Any] = plain_yaml.load(path.read_text(encoding="utf-8"))
    data["lists"]["TP1_more"] = MORE
    data["units"]["TP1"] |= {
        "usb_prefix": 103,
        "serial_digits": 9,
        "built_in": "Slide",
        "also_at": {"addresses": [0x21], "source": "a driver"},
    }
    data["units"]["TP9"] |= {"stages": [], "fewer_stages": "no room"}
    data["known_prefixes"]["73"] |= {"shared_with": ["TP8"], "distinguished_by": "nothing"}
    data["unsupported"] = {
        "TP8": {
            "title": "Tiny tower",
            "reason": "Its messages are unknown.",
            "source": "a catalogue",
        }
    }
    path.write_text(json.dumps(data), encoding="utf-8")
    [protocol] = check(spec)
    return protocol


@pytest.fixture
def facts(described: Protocol, tmp_path: Path, imported: Callable[[Path], Any]) -> Any:
    """The facts of the generated device classes."""
    write_files(tmp_path, render([described]))
    return imported(tmp_path).devices.TP1.facts


def test_a_unit_supports_the_messages_of_all_its_lists(described: Protocol, facts: Any) -> None:
    registry = json.loads(render([described])["python/stagewire_tiny/registry.json"])
    [unit] = [entry for entry in registry["units"] if entry["name"] == "TP1"]
    assert (unit["list"], unit["more_lists"]) == ("TP1", ["TP1_more"])
    assert unit["messages"] == ["LAMP", "POS_ALIVE", "POS_ECHO", "POS_MOVE", "POS_MOVED"]
    assert facts.units["TP1"].messages == frozenset(unit["messages"])
    assert "the printed lists, page 9" in facts.units["TP1"].messages_from


def test_a_family_is_like_all_lists_of_its_unit(described: Protocol, facts: Any) -> None:
    assert facts.units["TP2"].messages == facts.units["TP1"].messages
    assert "the printed lists of TP1, page 9" in facts.units["TP2"].messages_from


def test_the_addresses_of_a_unit_replace_those_of_its_family(facts: Any) -> None:
    assert facts.units["TP1"].also_at == (0x21,)
    assert facts.units["TP2"].also_at == (0x11,)


def test_a_unit_has_its_built_in_stage(facts: Any) -> None:
    assert facts.units["TP1"].built_in == "Slide"
    assert facts.units["TP2"].built_in is None
    assert facts.units["TP9"].stages == ()


def test_an_unsupported_unit_has_its_reason_and_its_prefixes(facts: Any) -> None:
    [unit] = facts.unsupported.values()
    assert (unit.name, unit.title, unit.reason) == (
        "TP8",
        "Tiny tower",
        "Its messages are unknown.",
    )
    assert unit.prefixes == unit.alike == (73,)
    assert facts.aliases["TP3"].alike == (73,)
    assert "TP8" not in facts.aliases


def test_an_overlay_withdraws_an_unsupported_unit_that_it_describes(
    overlaid_spec: Path, tmp_path: Path
) -> None:
    spec = Path(shutil.copytree(overlaid_spec, tmp_path / "spec"))
    entry = "  TP10: {title: a tower, reason: Its messages are unknown., source: a catalogue}\n"
    with (spec / "tiny" / "units.yaml").open("a", encoding="utf-8") as file:
        file.write(f"unsupported:\n{entry}")
    with pytest.raises(SpecError) as caught:
        check(spec, overlays=["tiny/second"])
    [told] = caught.value.diagnostics
    assert "unsupported.TP10: TP10 is described as a unit or an alias" in str(told)
    overlay = spec / "tiny" / "overlays" / "second" / "overlay.yaml"
    data = plain_yaml.load(overlay.read_text(encoding="utf-8"))
    data.setdefault("withdraws", {})["unsupported"] = ["TP10"]
    overlay.write_text(json.dumps(data), encoding="utf-8")
    [tiny] = [one for one in check(spec, overlays=["tiny/second"]) if one.name == "tiny"]
    assert tiny.units["unsupported"].keys() == {"TP8"}


def test_a_prefix_may_have_three_digits(facts: Any) -> None:
    assert facts.units["TP1"].prefixes == (103,)


def test_a_package_without_unsupported_units_has_no_table_of_them(protocol: Protocol) -> None:
    files = render([protocol])
    assert "UNSUPPORTED" not in "".join(files.values())
    assert "unsupported" not in json.loads(files["python/stagewire_tiny/registry.json"])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("POS_ECHO", "SW021 units.TP1: unknown form data_long of POS_ECHO"),
        ("POS_NONE", "SW021 units.TP1: unknown message POS_NONE"),
    ],
)
def test_a_unit_sends_a_form_of_a_message_that_exists(spec: Path, name: str, said: str) -> None:
    path = spec / "tiny" / "units.yaml"
    data: dict[str, Any] = plain_yaml.load(path.read_text(encoding="utf-8"))
    data["units"]["TP1"]["sends"] = {name: {"form": "data_long", "source": "a driver"}}
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert said in "\n".join(map(str, caught.value.diagnostics))
