"""Hostile files and folders in a spec: names, links, pipes, devices and oversized files."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest
from outputs import faults
from payloads import CODE
from text_places import Files, write

from parts import every_nth
from stagewire_generator import TARGETS, check, render
from stagewire_generator.diagnostics import MOST_OF_A_FILE, SpecError


@pytest.fixture
def spec(files: Files, tmp_path: Path) -> Path:
    return write(files, tmp_path / "spec")


def refused(spec: Path) -> list[tuple[str, str]]:
    """Return the file and code of every diagnostic."""
    with pytest.raises(SpecError) as caught:
        check(spec)
    for diagnostic in caught.value.diagnostics:
        assert all(line.isprintable() for line in str(diagnostic).split("\n"))
    return sorted({(d.place.file, d.code) for d in caught.value.diagnostics})


# Names

NAMES = [
    "x y", "-rf", "'", '"', "#", "%s {0} {{ 7 }}", "\\", "x\ny", "\x1b[31m", "\u202etxt", "ß", "con", "~",
    "..x", CODE.replace("/", ""), "*", "[a-z]", "?", "$HOME", ".", "x" * 200,
]  # fmt: skip


@pytest.mark.parametrize("name", every_nth(NAMES, 3), ids=ascii)
def test_names_of_files_and_folders_do_not_affect_the_output(
    files: Files, rendered: dict[str, str], tmp_path: Path, name: str
) -> None:
    """Files and folders are found under any name, and the output does not contain their names."""
    folder = name if name != "." else ".x"
    renamed = {}
    for path, data in files.items():
        *parents, last = path.split("/")
        if parents[0] == "tiny":
            parents[0] = folder
        if last == "tiny.yaml":
            last = f"{folder}.yaml"
        elif parents[-1] in ("messages", "errata", "printed"):
            last = f"{name}{last}"
        renamed["/".join([*parents, last])] = data
    assert render(check(write(renamed, tmp_path / "spec")), TARGETS) == rendered


@pytest.mark.parametrize("name", every_nth(NAMES, 3), ids=ascii)
def test_names_of_files_cannot_control_a_terminal(spec: Path, name: str) -> None:
    (spec / "tiny" / "messages" / f"{name}.yaml").write_text("chapter: 010\n", encoding="utf-8")
    assert {code for _, code in refused(spec)} == {"SW004", "SW010"}


def test_diagnostics_can_name_a_file_whose_name_is_not_unicode(spec: Path) -> None:
    raw = os.fsencode(spec / "tiny" / "messages") + b"/\xff.yaml"
    try:
        Path(os.fsdecode(raw)).write_text("chapter: 010\n", encoding="utf-8")
    except OSError:
        return  # this file system allows only Unicode names
    assert {code for _, code in refused(spec)} == {"SW004", "SW010"}


# Links


@pytest.mark.parametrize(
    "file", ["tiny/units.yaml", "tiny/messages/core.yaml", "tiny/examples.yaml"]
)
def test_a_link_out_of_the_spec_is_not_followed(spec: Path, tmp_path: Path, file: str) -> None:
    outside = tmp_path / "outside.yaml"
    (spec / file).rename(outside)
    outside.write_text("the password is 1234\n")
    (spec / file).symlink_to(outside)
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert {(d.place.file, d.code) for d in caught.value.diagnostics} == {(file, "SW008")}
    assert "1234" not in "".join(map(str, caught.value.diagnostics))


@pytest.mark.parametrize("folder", ["tiny", "tiny/messages"])
def test_a_folder_that_links_out_of_the_spec_is_refused(
    spec: Path, tmp_path: Path, folder: str
) -> None:
    (spec / folder).rename(tmp_path / "outside")
    (spec / folder).symlink_to(tmp_path / "outside")
    found = refused(spec)
    assert {code for _, code in found} == {"SW008"}
    assert all(file.startswith(folder) for file, _ in found)


def test_links_within_the_spec_are_followed(
    spec: Path, rendered: dict[str, str], tmp_path: Path
) -> None:
    (spec / "tiny" / "units.yaml").rename(spec / "tiny" / "kept.txt")
    (spec / "tiny" / "units.yaml").symlink_to("kept.txt")
    (tmp_path / "link").symlink_to(spec)
    assert render(check(spec), TARGETS) == rendered
    assert render(check(tmp_path / "link"), TARGETS) == rendered  # the user's own link
    alone = render(check(tmp_path / "link" / "tiny"), TARGETS)
    assert alone.keys() < rendered.keys()
    assert all(rendered[path] == text for path, text in alone.items())


@pytest.mark.parametrize("target", ["nowhere.yaml", "units.yaml"])
def test_a_broken_link_is_refused(spec: Path, target: str) -> None:
    (spec / "tiny" / "units.yaml").unlink()
    (spec / "tiny" / "units.yaml").symlink_to(target)
    (spec / "tiny" / "messages" / "x.yaml").symlink_to(target)
    assert ("tiny/messages/x.yaml", "SW006") in refused(spec)


# Pipes, folders, devices and oversized files


@pytest.mark.parametrize("file", ["tiny/protocol.yaml", "tiny/errata/x.yaml", "tiny/captures.yaml"])
def test_a_pipe_is_refused_without_waiting(spec: Path, file: str) -> None:
    (spec / file).unlink(missing_ok=True)
    os.mkfifo(spec / file)
    assert refused(spec) == [(file, "SW008")]


def test_a_folder_in_place_of_a_file_is_refused(spec: Path) -> None:
    (spec / "tiny" / "errata" / "x.yaml").mkdir()
    assert refused(spec) == [("tiny/errata/x.yaml", "SW008")]


def test_a_device_is_refused(spec: Path) -> None:
    (spec / "tiny" / "errata" / "x.yaml").symlink_to("/dev/zero")
    assert refused(spec) == [("tiny/errata/x.yaml", "SW008")]


def most_memory() -> int:
    """Return the peak memory of this process in kilobytes."""
    resource = pytest.importorskip("resource")
    most: int = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most // 1024 if sys.platform == "darwin" else most


def test_a_file_of_a_hundred_megabytes_is_refused_unread(spec: Path) -> None:
    with (spec / "tiny" / "errata" / "x.yaml").open("wb") as file:
        file.truncate(100 * 1024 * 1024)
    before = most_memory()
    assert refused(spec) == [("tiny/errata/x.yaml", "SW008")]
    assert most_memory() - before < 20_000


def test_files_up_to_a_mebibyte_are_accepted(spec: Path) -> None:
    path = spec / "tiny" / "units.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text + "#" * (1024 * 1024 - len(text)), encoding="utf-8")
    check(spec)
    path.write_text(text + "#" * (1024 * 1024 - len(text) + 1), encoding="utf-8")
    assert refused(spec) == [("tiny/units.yaml", "SW008")]


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("\x01" * 200_000, {"SW007"}),
        ("".join(f"a{n}: 1\n" for n in range(20_000)), {"SW010"}),
        ("- 1\n" * 30_000, {"SW010"}),
        ("a: 1\n" * 20_000, {"SW002", "SW010"}),
        ("- 010\n" * 20_000, {"SW004", "SW010"}),
        ("- &a 1\n" * 20_000, {"SW003", "SW010"}),
        ("errata: {" + "".join(f"X{n}: 1, " for n in range(15_000)) + "}", {"SW010"}),
    ],
    ids=["control", "unknown-keys", "items", "one-key", "octal", "anchors", "names"],
)
def test_the_diagnostics_of_a_file_are_limited(spec: Path, text: str, codes: set[str]) -> None:
    """The check ends and reports the first problems."""
    (spec / "tiny" / "errata" / "x.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(spec)
    found = caught.value.diagnostics
    assert len(found) <= MOST_OF_A_FILE
    assert {d.code for d in found} <= codes
    assert max(len(str(d)) for d in found) < 1000


# Keys that look alike


@pytest.mark.parametrize(
    "keys", [("é", "e\u0301"), ("ﬁ", "fi"), ("K", "\u212a"), ("а", "a"), ("İ", "i\u0307")]
)
def test_keys_that_look_alike_are_refused(
    files: Files, tmp_path: Path, keys: tuple[str, str]
) -> None:
    other = json.loads(json.dumps(files))
    bits = other["tiny/messages/optics.yaml"]["flags"]["shutter_bits"]["bits"]
    bits |= {key: {"bit": number} for number, key in enumerate(keys, 1)}
    assert refused(write(other, tmp_path)) == [("tiny/messages/optics.yaml", "SW010")]


# Numbers in texts of the witness


@pytest.mark.parametrize("bit", ["²", "0", "-1", "99999999", "1" * 200, "٣"])
def test_an_invalid_bit_number_in_the_witness_does_not_fail_the_check(
    files: Files, tmp_path: Path, bit: str
) -> None:
    other = json.loads(json.dumps(files))
    rows = other["tiny/printed/optics.yaml"]["messages"]["SHUTTER"]["values"][0]["rows"]
    rows[0][1] = bit
    check(write(other, tmp_path))


@pytest.mark.parametrize(
    "value", ["to 0xFFFFFFFFFF", "to 99999999999", "0x" + "F" * 200, "-0x01", ",", "²"]
)
def test_an_invalid_value_in_the_witness_is_refused(
    files: Files, tmp_path: Path, value: str
) -> None:
    other = json.loads(json.dumps(files))
    rows = other["tiny/printed/core.yaml"]["messages"]["POS_REQ_VELPARAMS"]["values"][0]["rows"]
    rows.append([value, "x"])
    assert refused(write(other, tmp_path)) == [("tiny/printed/core.yaml", "SW040")]


@pytest.mark.parametrize("prefix", ["x", "", "²³", "7", "-1", "١٢"])
def test_an_invalid_prefix_in_the_witness_is_refused(
    files: Files, tmp_path: Path, prefix: str
) -> None:
    other = json.loads(json.dumps(files))
    other["tiny/printed/lists.yaml"]["usb_prefixes"][0][1] = prefix
    assert refused(write(other, tmp_path)) == [("tiny/printed/lists.yaml", "SW040")]


def test_the_complete_spec_renders_without_problems(rendered: dict[str, str]) -> None:
    assert list(faults(rendered, {})) == []
