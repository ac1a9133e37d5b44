"""Overlays that build on another overlay: they change its entries, and apply after it."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from files import write_files
from stagewire_generator import check, render
from stagewire_generator.change import Change, Spec, compare_specs
from stagewire_generator.diagnostics import Diagnostic, SpecError
from stagewire_generator.model import Message, Protocol
from stagewire_generator.model_scales import Factor
from stagewire_generator.pipeline import TARGETS
from stagewire_generator.targets.python.devices.plan import plan_of

Entries = dict[str, Any]

HEAD = {
    "title": "Another maker.",
    "summary": "Changes what the second edition describes.",
    "document": {"title": "Manual", "issue": "7", "date": "later", "pages": 12},
}
RAMP = {
    "title": "a ramp",
    "page": 5,
    "controllers": {"TP10": {"distance": {"counts_per_mm": 7, "page": 5}}},
}
BUZZ = {
    "id": 0x0305,
    "page": 6,
    "direction": "to_controller",
    "effect": "none",
    "summary": "Buzzes.",
    "header": {},
}
ADDITIONS = {
    "units": {
        "TP1": {"stages": ["Tower"]},
        "TP2": {"stages": ["Tower"]},
        "TP10": {"stages": ["Ramp"]},
    },
    "lists": {"TP1": {"messages": ["AUX_BUZZ"]}, "TP10": {"messages": ["LAMP", "AUX_BUZZ"]}},
    "stages": {
        "Tower": {"controllers": {"TPx": {"distance": {"counts_per_mm": 9, "page": 8}}}},
    },
}


class Upon:
    """The small good spec with its overlays, and one called ``upon`` that builds on the second edition."""

    def __init__(self, spec: Path) -> None:
        self.spec = spec

    def write(self, name: str = "upon", **files: Entries) -> None:
        """Write the files of an overlay; what ``overlay`` does not have is as in HEAD."""
        folder = self.spec / "tiny" / "overlays" / name
        head = {"overlay": name, **HEAD, **files.pop("overlay", {"builds_on": ["second"]})}
        for path, data in {"overlay": head, **files}.items():
            file = folder / f"{path}.yaml"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(yaml.safe_dump(data), encoding="utf-8")

    def head(self, name: str, old: str, new: str) -> None:
        path = self.spec / "tiny" / "overlays" / name / "overlay.yaml"
        text = path.read_text(encoding="utf-8")
        assert text.count(old) == 1
        path.write_text(text.replace(old, new), encoding="utf-8")

    def protocol(self, *names: str, base: bool = False) -> Protocol:
        """Return the protocol with overlays: the second one and ``upon``, or those that are given."""
        overlays = [f"tiny/{name}" for name in names or ("second", "upon")]
        return check(self.spec, overlays=overlays, base=base)[0]

    def errors(self, *names: str, base: bool = False) -> list[Diagnostic]:
        with pytest.raises(SpecError) as caught:
            self.protocol(*names, base=base)
        return caught.value.diagnostics

    def error(self, *names: str, base: bool = False) -> tuple[str, str, str]:
        """Return the overlay with the only error, its message and its hint."""
        [found] = self.errors(*names, base=base)
        return Path(found.place.file).parent.name, f"{found.code} {found.message}", found.cure


@pytest.fixture
def upon(overlaid_spec: Path, tmp_path: Path) -> Upon:
    return Upon(Path(shutil.copytree(overlaid_spec, tmp_path / "spec")))


def message(protocol: Protocol, name: str) -> Message:
    [found] = [message for message in protocol.messages if message.name == name]
    return found


def scale(protocol: Protocol, stage: str, controller: str) -> Factor:
    [found] = [s.scales[controller]["distance"] for s in protocol.stages if s.name == stage]
    assert isinstance(found, Factor)
    return found


def write_additions(upon: Upon) -> None:
    upon.write(
        additions=ADDITIONS,
        stages={"stages": {"Ramp": RAMP}},
        **{"messages/heat": {"chapter": "heat", "messages": {"AUX_BUZZ": BUZZ}}},
    )


# Changes of entries below


def test_an_overlay_adds_to_entries_of_the_overlay_below(upon: Upon) -> None:
    write_additions(upon)
    protocol = upon.protocol()
    assert [overlay.name for overlay in protocol.overlays] == ["second", "upon"]
    unit = protocol.units["units"]["TP10"]
    assert (unit["stages"], unit["overlay"]) == (["Tower", "Turret", "Ramp"], "second")
    assert protocol.units["lists"]["TP10"]["overlay"] == "second"
    assert {"AUX_BUZZ", "LAMP"} <= protocol.messages_of(unit)
    assert protocol.later_messages["TP1"] == ("AUX_BUZZ",)
    assert "TP10" not in protocol.later_messages  # none of its messages is in the first document
    assert (scale(protocol, "Tower", "TP10").value, scale(protocol, "Tower", "TP10").overlay) == (
        3,
        "second",
    )
    added = scale(protocol, "Tower", "TPx")
    assert (added.value, added.page, added.overlay) == (9, 8, "upon")
    assert scale(protocol, "Ramp", "TP10").overlay == "upon"
    assert message(protocol, "AUX_BUZZ").overlay == "upon"


def test_messages_of_a_new_group_do_not_change_the_names_of_others(upon: Upon) -> None:
    """The names that programs use stay; the new ones have the name of the group."""
    before = plan_of(upon.protocol("second"))
    alive = {**BUZZ, "summary": "Says that it lives."}
    speed = {
        "id": 0x0306,
        "page": 6,
        "direction": "to_host",
        "spelling": "get vel params",
        "summary": "Reports a speed.",
        "data": {"length": 4, "fields": {"speed": {"format": "long"}}},
        "exchange": {"unsolicited": True},
    }
    upon.write(
        overlay={"builds_on": ["second"], "groups": ["XTRA"]},
        **{
            "messages/more": {
                "chapter": "heat",
                "messages": {"XTRA_ALIVE": alive, "XTRA_GET_VELPARAMS": speed},
            }
        },
    )
    after = plan_of(upon.protocol())
    calls = {call.message.name: call.constant for call in after.calls}
    assert calls == {call.message.name: call.constant for call in before.calls} | {
        "XTRA_ALIVE": "XTRA_ALIVE"
    }
    values = {each.message.name: each.name for each in after.values}
    assert values == {each.message.name: each.name for each in before.values} | {
        "XTRA_GET_VELPARAMS": "XtraVelParams"
    }


def test_every_page_is_one_of_the_document_that_has_the_fact(upon: Upon) -> None:
    write_additions(upon)
    files = render([upon.protocol()])
    registry = json.loads(files["python/stagewire_tiny/registry.json"])
    documents = {entry["name"]: entry.get("document") for entry in registry["units"]}
    assert (documents["TP1"], documents["TP10"]) == ("Issue 1", "Issue 2")
    stages = {entry["name"]: entry for entry in registry["stages"]}
    assert (stages["Tower"]["document"], stages["Ramp"]["document"]) == ("Issue 2", "Issue 7")
    tower = stages["Tower"]["controllers"]
    assert "document" not in tower["TP10"]["distance"]
    assert tower["TPx"]["distance"]["document"] == "Issue 7"
    text = files["python/stagewire_tiny/stages.py"]
    assert "# Issue 2, page 2\nTower = Stage(" in text
    assert "# Issue 7, page 5\nRamp = Stage(" in text


def test_an_added_scale_needs_a_page_or_source_if_its_controller_is_of_another_document(
    upon: Upon,
) -> None:
    bare = {"Tower": {"controllers": {"TPx": {"distance": {"counts_per_mm": 9}}}}}
    upon.write(additions={"stages": bare})
    overlay, what, _ = upon.error()
    assert overlay == "upon"
    assert what == "SW037 Tower: the scale of distance on TPx has no source and no page"


def test_an_overlay_renames_messages_of_the_overlay_below(upon: Upon) -> None:
    to = {"to": "AUX_WARMTH", "spelling": "warmth"}
    renames = {
        "parameter_sets": {"AUX_HEAT": to},
        "messages": {"AUX_HEAT_STATE": {"to": "AUX_WARM_STATE", "spelling": "warm state"}},
    }
    upon.write(overlay={"builds_on": ["second"], "renames": renames})
    protocol = upon.protocol()
    assert message(protocol, "AUX_SET_WARMTH").aliases == {"AUX_SET_HEAT": ("aux", "set", "heat")}
    assert message(protocol, "AUX_WARM_STATE").overlay == "second"
    assert message(protocol, "AUX_REQ_WARMTH").errata == ("tiny-heat-id",)
    heat = protocol.captures["captures"]["heat"]
    assert (heat["message"], heat["overlay"]) == ("AUX_SET_WARMTH", "second")
    assert protocol.units["families"]["warm"]["messages"] == ["AUX_SET_WARMTH"]


def test_an_entry_can_be_renamed_twice(upon: Upon) -> None:
    first = {"parameter_sets": {"POS_VELPARAMS": {"to": "POS_SPEED"}}}
    upon.write("pace", overlay={"renames": first})
    again = {"parameter_sets": {"POS_SPEED": {"to": "POS_TEMPO"}}}
    upon.write(overlay={"builds_on": ["pace"], "renames": again})
    tempo = message(upon.protocol("pace", "upon"), "POS_SET_TEMPO")
    assert sorted(tempo.aliases) == ["POS_SET_SPEED", "POS_SET_VELPARAMS"]


def test_an_overlay_withdraws_entries_of_the_overlay_below(upon: Upon) -> None:
    withdraws = {"messages": ["POS_ECHO", "AUX_HEAT_STATE"], "stages": ["Tower"]}
    upon.write(
        overlay={"builds_on": ["second"], "withdraws": withdraws, "overrides": {"units": ["TP10"]}},
        units={"units": {"TP10": {
            "title": "Tiny mast", "page": 4, "address": "bay", "channels": 1, "family": "plain",
            "status": "dc", "stages": ["Turret"],
        }}},
    )  # fmt: skip
    protocol = upon.protocol()
    names = {message.name for message in protocol.messages}
    assert names.isdisjoint({"POS_ECHO", "AUX_HEAT_STATE"})
    assert "POS_ECHO" not in protocol.units["lists"]["TP1"]["messages"]
    assert {stage.name for stage in protocol.stages} == {"Slide", "Turret"}
    unit = protocol.units["units"]["TP10"]
    assert (unit["title"], unit["overlay"]) == ("Tiny mast", "upon")


def test_an_erratum_applies_to_a_message_of_the_overlay_below(upon: Upon) -> None:
    erratum = {
        "pages": [9], "subject": "MSG_AUX_HEAT_STATE", "messages": ["AUX_HEAT_STATE"], "printed": "heat",
        "encoded": "heating", "evidence": "The manual says so.", "class": "wire", "origin": "document",
    }  # fmt: skip
    example = {
        "page": 9, "line": 1, "kind": "statement", "says": "It heats.", "means": "Now.",
        "claim": {"prose": True}, "errata": ["tiny-heats"],
    }  # fmt: skip
    upon.write(
        examples={"protocol": "tiny", "examples": {"heats": example}},
        **{"errata/heat": {"errata": {"tiny-heats": erratum}}},
    )
    assert message(upon.protocol(), "AUX_HEAT_STATE").errata == ("tiny-heats",)
    assert message(upon.protocol("second"), "AUX_HEAT_STATE").errata == ()


def test_a_printed_document_is_compared_with_the_overlay_on_top(upon: Upon) -> None:
    write_additions(upon)
    folder = upon.spec / "tiny" / "overlays" / "upon" / "printed"
    folder.mkdir()
    heading = {"heading": {"page": 6, "line": 1, "id": "0x0306"}}
    printed = {"chapter": "all", "messages": {"AUX_BUZZ": heading}}
    (folder / "all.yaml").write_text(yaml.safe_dump(printed), encoding="utf-8")
    [found] = upon.errors()
    assert found.message == (
        "heading/AUX_BUZZ/id: the document has '0x0306', the registry '0x0305'"
    )


# Errors about entries below


def test_the_hint_names_the_overlay_to_build_on(upon: Upon) -> None:
    upon.write(overlay={}, additions={"units": {"TP10": {"note": "x"}}})
    assert upon.error() == (
        "upon",
        "SW061 the protocol does not define units.TP10",
        "the overlay second defines it: to change it, write `builds_on: [second]`",
    )


@pytest.mark.parametrize(
    ("files", "what", "hint"),
    [
        (
            {"additions": {"units": {"TP12": {"note": "x"}}}},
            "SW061 the protocol with second does not define units.TP12",
            "or TP10?",
        ),
        (
            {"overlay": {"builds_on": ["second"], "withdraws": {"messages": ["AUX_HEAT_STAT"]}}},
            "SW061 the protocol with second does not define messages.AUX_HEAT_STAT",
            "did you mean AUX_HEAT_STATE",
        ),
        (
            {
                "overlay": {
                    "builds_on": ["second"],
                    "renames": {"messages": {"AUX_SET_HEAT": {"to": "AUX_X"}}},
                }
            },
            "SW061 the protocol with second does not define messages.AUX_SET_HEAT",
            "AUX_SET_HEAT belongs to the set AUX_HEAT",
        ),
        (
            {"stages": {"stages": {"Tower": RAMP}}},
            "SW060 stages.Tower would replace the entry of the overlay second",
            "choose another name; to replace the entry, list it under `overrides`",
        ),
        (
            {"additions": {"lists": {"TP10": {"page": 5}}}},
            "SW063 lists.TP10.page: the overlay second has 4, the overlay upon 5",
            "remove it; to change a value",
        ),
        (
            {"additions": {"units": {"TP10": {"stages": ["Tower"]}}}},
            "SW063 units.TP10.stages.0: Tower is already in the list",
            "remove it",
        ),
        (
            {"additions": {"units": {"TP10": {"colour": "red"}}}},
            "SW010 units.TP10: unknown key colour",
            "",
        ),
        (
            {"messages/heat": {"chapter": "heat", "messages": {"AUX_BUZZ": BUZZ | {"id": 0x0304}}}},
            "SW030 AUX_HEAT_STATE and AUX_BUZZ both have the id 0x0304",
            "to replace the message of the overlay second",
        ),
        (
            {
                "overlay": {
                    "builds_on": ["second"],
                    "renames": {"messages": {"LAMP": {"to": "AUX_SET_HEAT", "spelling": "x"}}},
                }
            },
            "SW020 ",
            "",
        ),
    ],
)  # fmt: skip
def test_an_error_says_what_is_below(
    upon: Upon, files: dict[str, Entries], what: str, hint: str
) -> None:
    upon.write(**files)
    found = upon.errors()
    assert [f"{d.code} {d.message}" for d in found if what in f"{d.code} {d.message}"]
    assert hint in found[0].cure


def test_the_hint_has_the_new_name_of_a_renamed_entry(upon: Upon) -> None:
    upon.write("pace", overlay={"renames": {"messages": {"LAMP": {"to": "LANTERN"}}}})
    upon.write(overlay={"builds_on": ["pace"]}, additions={"messages": {"LAMP": {"note": "x"}}})
    what = "SW061 the overlay pace withdraws or renames messages.LAMP"
    assert upon.error() == ("upon", what, "write its new name, LANTERN")


def test_an_overlay_with_errors_does_not_repeat_them_in_those_above(upon: Upon) -> None:
    write_additions(upon)
    upon.head("second", "  stages: [Slide]", "  stages: [Slyde]")
    assert {Path(d.place.file).parent.name for d in upon.errors()} == {"second"}


def test_an_overlay_that_does_not_build_on_another_cannot_replace_its_entries(upon: Upon) -> None:
    lamp = {**BUZZ, "id": 0x0201, "page": 1}
    chapter = {"messages/extra": {"chapter": "extra", "messages": {"LAMP": lamp}}}
    upon.write(overlay={"overrides": {"messages": ["LAMP"]}}, **chapter)
    overlay, what, hint = upon.error("third", "upon")
    assert (overlay, what) == (
        "messages",
        "SW060 messages.LAMP would replace the entry of the overlay third",
    )
    assert "let one build on the other (`builds_on` in overlay.yaml)" in hint
    upon.head("upon", "overrides:", "builds_on: [third]\noverrides:")
    assert message(upon.protocol("third", "upon"), "LAMP").summary == "Buzzes."


@pytest.mark.parametrize("section", ["withdraws", "renames"])
def test_an_overlay_that_does_not_build_on_another_cannot_take_away_its_entries(
    upon: Upon, section: str
) -> None:
    names: Any = ["LAMP"] if section == "withdraws" else {"LAMP": {"to": "LANTERN"}}
    upon.write(overlay={section: {"messages": names}})
    _, what, _ = upon.error("third", "upon")
    verb = section.removesuffix("s")
    assert what == (
        f"SW060 messages.LAMP: the overlay third replaces the entry that this would {verb}"
    )
    check(upon.spec, overlays=["tiny/upon"])


# The order


def test_an_overlay_is_applied_after_the_default_ones_and_those_named_before(upon: Upon) -> None:
    write_additions(upon)
    upon.head("second", "document:", "default: true\ndocument:")
    assert [o.name for o in upon.protocol("third", "upon").overlays] == ["second", "third", "upon"]
    assert [o.name for o in upon.protocol("upon", "third").overlays] == ["second", "upon", "third"]
    assert [o.name for o in check(upon.spec)[0].overlays] == ["second"]
    assert check(upon.spec, base=True)[0].overlays == ()


def test_a_default_overlay_is_applied_after_the_default_one_that_it_builds_on(upon: Upon) -> None:
    upon.head("second", "document:", "default: true\ndocument:")
    upon.write("aaa", overlay={"builds_on": ["second"], "default": True})
    assert [overlay.name for overlay in check(upon.spec)[0].overlays] == ["second", "aaa"]


def test_each_overlay_is_checked_on_those_that_it_builds_on(upon: Upon) -> None:
    write_additions(upon)
    upon.write(
        "top", overlay={"builds_on": ["upon"]}, additions={"stages": {"Ramp": {"note": "x"}}}
    )
    checked = check(upon.spec).checked
    names = {
        title: [overlay.name for overlay in each.protocol.overlays]
        for title, each in checked.items()
        if title.startswith("tiny")
    }
    assert names == {
        "tiny": [],
        "tiny/second": ["second"],
        "tiny/third": ["third"],
        "tiny/top": ["second", "upon", "top"],
        "tiny/upon": ["second", "upon"],
    }
    assert list(names) == sorted(names)


@pytest.mark.parametrize("names", [("upon",), ("upon", "second"), ("third", "upon")])
def test_an_overlay_cannot_be_applied_before_the_one_that_it_builds_on(
    upon: Upon, names: tuple[str, ...]
) -> None:
    write_additions(upon)
    what = "SW064 upon builds on second, which is not applied before it"
    hint = "apply it first: `--overlay tiny/second --overlay tiny/upon`"
    assert upon.error(*names) == ("upon", what, hint)


def test_the_default_overlays_cannot_be_left_out_below_one_that_builds_on_them(upon: Upon) -> None:
    write_additions(upon)
    upon.head("second", "document:", "default: true\ndocument:")
    upon.protocol("upon")
    _, what, hint = upon.error("upon", base=True)
    assert what == "SW064 upon builds on second, which is not applied before it"
    assert hint.endswith(", or leave out --base")
    upon.protocol("second", "upon", base=True)


@pytest.mark.parametrize(
    ("builds_on", "what", "hint"),
    [
        ("seconds", "SW064 upon builds on an unknown overlay, seconds", "did you mean second?"),
        ("upon", "SW064 upon builds on itself", "remove it"),
    ],
)
def test_an_overlay_builds_on_another_one(upon: Upon, builds_on: str, what: str, hint: str) -> None:
    upon.write(overlay={"builds_on": [builds_on]})
    assert upon.error() == ("upon", what, hint)


def test_two_overlays_cannot_build_on_each_other(upon: Upon) -> None:
    upon.write(overlay={"builds_on": ["other"]})
    upon.write("other", overlay={"builds_on": ["upon"]})
    assert [d.message for d in upon.errors()] == [
        "other builds on upon, which builds on other",
        "upon builds on other, which builds on upon",
    ]


# Differences between revisions


def differences(old: Spec, upon: Upon) -> list[tuple[str, str]]:
    def told(change: Change) -> tuple[str, str]:
        return change.title, change.kind

    return [told(change) for change in compare_specs(old, Spec.of(check(upon.spec).checked))]


def test_a_change_of_the_overlay_below_is_reported_once(upon: Upon) -> None:
    write_additions(upon)
    old = Spec.of(check(upon.spec).checked)
    heat = upon.spec / "tiny" / "overlays" / "second" / "messages" / "heat.yaml"
    text = heat.read_text(encoding="utf-8")
    heat.write_text(text.replace("Reports whether it is heating.", "Says so."), encoding="utf-8")
    assert differences(old, upon) == [("tiny/second", "text")]


def test_building_on_another_overlay_is_one_change(upon: Upon) -> None:
    upon.write(overlay={})
    old = Spec.of(check(upon.spec).checked)
    upon.write(additions={"messages": {"POS_ALIVE": {"note": "Often."}}})
    found = differences(old, upon)
    assert {title for title, _ in found} == {"tiny/upon"}
    assert sorted(kind for _, kind in found) == ["document", "text"]


# Generated code


def test_every_target_of_the_result_works(upon: Upon, tmp_path: Path) -> None:
    write_additions(upon)
    upon.head(
        "upon", "builds_on:", "renames: {parameter_sets: {AUX_HEAT: {to: AUX_WARMTH}}}\nbuilds_on:"
    )
    files = render([upon.protocol()], [*TARGETS])
    out = tmp_path / "out"
    write_files(out, files)
    program = (
        "from stagewire_tiny import devices, messages, stages\n"
        "print(messages.AuxSetHeat is messages.AuxSetWarmth)\n"
        "print(devices.TP10.buzz.__name__, stages.Ramp.name)"
    )
    printed = subprocess.run(
        [sys.executable, "-c", program],
        cwd=out / "python",
        capture_output=True,
        text=True,
        check=True,
    )
    assert printed.stdout.split() == ["True", "buzz", "Ramp"]
    vectors = json.loads((out / "python" / "stagewire_tiny" / "vectors.json").read_text("utf-8"))
    cases = {case["request"].get("message") for case in vectors["cases"]}
    assert {"AUX_BUZZ", "AUX_SET_WARMTH"} <= cases
    assert next(e for e in vectors["captures"] if e["id"] == "heat")["message"] == "AUX_SET_WARMTH"
    headers = sorted(path.relative_to(out / "c") for path in (out / "c").rglob("*.h"))
    whole = tmp_path / "all.c"
    whole.write_text("".join(f'#include "{path.as_posix()}"\n' for path in headers) + "int one;\n")
    compiler = [
        "gcc",
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-fsyntax-only",
        "-I",
        str(out / "c"),
    ]
    subprocess.run([*compiler, str(whole)], check=True)
