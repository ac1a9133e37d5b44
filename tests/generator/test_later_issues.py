"""The overlay of Thorlabs APT for later issues: registry, packages and commands with and without it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from checkout import ROOT
from stagewire_cli.main import main
from stagewire_generator import check
from stagewire_generator.change import compare
from stagewire_generator.model import Protocol

SPEC = ROOT / "spec"
NAME = "thorlabs_apt/later_issues"
OVERLAYS = f"thorlabs_apt/issue_37, {NAME}, thorlabs_apt/vendor_software"
RUN = "from stagewire_cli.main import run; run()"

STATUS_BYTES = "01 00 01 00 00 00 02 00 00 00 07 00 00 00"
LONG_STATUS = f"81 04 1C 00 81 22 {STATUS_BYTES} 01 00 {bytes(12).hex(' ')}"
SHORT_STATUS = f"81 04 0E 00 81 22 {STATUS_BYTES}"
TEXT = b"Motor is not connected".ljust(64, b"\0")
RICH_RESPONSE = f"81 00 44 00 81 50 53 04 05 00 {TEXT.hex(' ')}"
INFO = (
    "06 00 54 00 81 22 89 53 9A 05 49 4F 4E 30 30 31 20 00 2C 00 02 01 39 00"
    f" {b'Brushless'.ljust(60, bytes(1)).hex(' ')} 01 00 03 00 02 00"
)
FRAMES = {"long": LONG_STATUS, "short": SHORT_STATUS, "rich": RICH_RESPONSE, "info": INFO}


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The paths of the package without and with the overlay, both named ``stagewire_apt``."""
    found = {}
    for side, options in (("without", []), ("with", ["--overlay", NAME])):
        out = tmp_path_factory.mktemp(side)
        assert (
            main(
                [
                    "generate",
                    "--base",
                    "--spec",
                    str(SPEC / "thorlabs_apt"),
                    "--out",
                    str(out),
                    *options,
                ]
            )
            == 0
        )
        found[side] = out / "python"
    return found


def stagewire(package: Path, *arguments: str, input: str = "") -> str:
    """Run the command with a package that takes precedence over the installed one."""
    environment = {**os.environ, "PYTHONPATH": str(package)}
    command = [sys.executable, "-c", RUN, *arguments]
    done = subprocess.run(
        command, input=input, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def answers(packages: dict[str, Path]) -> dict[str, dict[str, Any]]:
    """The answers of the testee for every frame; also check that encoding them gives the same bytes."""
    found = {}
    for side, package in packages.items():
        requests = [
            {"id": name, "op": "decode", "protocol": "thorlabs_apt", "hex": hex.replace(" ", "")}
            for name, hex in FRAMES.items()
        ]
        decoded = _testee(package, requests)
        again = [
            {
                **{k: v for k, v in decoded[name].items() if k != "ok"},
                "op": "encode",
                "protocol": "thorlabs_apt",
            }
            for name in FRAMES
        ]
        encoded = _testee(package, again)
        for name, hex in FRAMES.items():
            assert bytes.fromhex(encoded[name]["hex"]) == bytes.fromhex(hex), (side, name)
        found[side] = decoded
    return found


def _testee(package: Path, requests: list[dict[str, Any]]) -> dict[str, Any]:
    lines = "".join(json.dumps(request) + "\n" for request in requests)
    made = [json.loads(line) for line in stagewire(package, "testee", input=lines).splitlines()]
    assert all(answer["ok"] for answer in made), made
    return {answer["id"]: answer for answer in made}


STATUS = {"chan_ident": 1, "position": 1, "enc_count": 2, "status_bits": 7}


def test_without_the_overlay_undocumented_bytes_are_kept(
    answers: dict[str, dict[str, Any]],
) -> None:
    """Issue 3 has no layout for these bytes."""
    found = answers["without"]
    assert (found["rich"]["form"], found["rich"]["message"]) == ("undocumented", "HW_RICHRESPONSE")
    assert bytes.fromhex(found["rich"]["data"])[4:] == TEXT
    assert (found["long"]["form"], found["long"]["fields"]) == ("data", STATUS)
    assert bytes.fromhex(found["long"]["extra"]) == bytes([1, *bytes(13)])
    assert (found["short"]["form"], found["short"]["fields"]) == ("data", STATUS)
    assert found["info"]["fields"]["notes"] == "Brushless".ljust(60, "\0") + "\1\0\3"
    assert found["info"]["fields"]["nchs"] == 2


def test_with_the_overlay_all_fields_are_decoded(answers: dict[str, dict[str, Any]]) -> None:
    found = answers["with"]
    assert found["rich"]["form"] == "data"
    assert found["rich"]["fields"] == {
        "msg_ident": 0x0453,
        "code": 5,
        "notes": "Motor is not connected",
    }
    assert found["long"]["form"] == "data:long"
    assert "extra" not in found["long"]
    zeros = bytes(12).hex()
    assert found["long"]["fields"] == {**STATUS, "chan_ident_2": 1, "reserved": zeros}
    assert (found["short"]["form"], found["short"]["fields"]) == ("data", STATUS)
    assert found["info"]["fields"] == {
        "serial_number": 94000009,
        "model_number": "ION001 ",
        "type": 44,
        "software_version": "02013900",
        "notes": "Brushless",
        "reserved": zeros,
        "hw_version": 1,
        "mod_state": 3,
        "nchs": 2,
    }


def test_a_program_can_use_the_classes_of_the_overlay(packages: dict[str, Path]) -> None:
    program = f"""\
from stagewire._framings.header.frame import Frame
from stagewire_apt import messages as m
frame = m.decode(bytes.fromhex({LONG_STATUS!r}))
assert type(frame.message) is m.MotGetStatusUpdateLong, frame
assert type(m.decode(bytes.fromhex({SHORT_STATUS!r})).message) is m.MotGetStatusUpdate
rich = m.HwRichResponse(msg_ident=0x0453, code=5, notes="Motor is not connected")
assert m.decode(bytes.fromhex({RICH_RESPONSE!r})).message == rich
assert Frame(rich, 0x01, 0x50).encode() == bytes.fromhex({RICH_RESPONSE!r})
"""
    environment = {**os.environ, "PYTHONPATH": str(packages["with"])}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True)


def test_the_commands_decode_and_show_use_the_overlay(packages: dict[str, Path]) -> None:
    decoded = stagewire(packages["with"], "decode", RICH_RESPONSE)
    assert (
        "Field notes on later issues of the APT communications protocol, section Rich response"
        in decoded
    )
    assert "Motor is not connected" in decoded
    shown = stagewire(packages["with"], "show", "HW_GET_INFO")
    assert "protocol, section Hardware information" in shown
    assert "hw_version" in shown
    plain = stagewire(packages["without"], "show", "HW_GET_INFO")
    assert "page 21" in plain
    assert "hw_version" not in plain


@pytest.mark.parametrize("side", ["without", "with"])
def test_every_example_and_capture_passes(packages: dict[str, Path], side: str) -> None:
    """This includes those of Issue 3, except for three whose meaning changed in later issues."""
    said = stagewire(packages[side], "conformance", "examples", "--protocol", "thorlabs_apt")
    assert " 0 failed" in said
    assert ("pnpq-status-update-long" in said) == (side == "with")


@pytest.fixture(scope="module")
def later() -> list[Protocol]:
    return check(SPEC / "thorlabs_apt", overlays=[NAME], base=True)


def test_the_overlay_makes_the_expected_changes(later: list[Protocol]) -> None:
    base = check(SPEC / "thorlabs_apt", base=True)
    info = {"message": "HW_GET_INFO", "form": "data"}
    assert [
        (change.level.name, change.kind, change.where)
        for change in compare(base, later)
        if change.level.name != "DOC"
    ] == [
        ("WIRE", "field-added", {**info, "field": "reserved"}),
        ("WIRE", "field-added", {**info, "field": "hw_version"}),
        ("WIRE", "field-added", {**info, "field": "mod_state"}),
        ("WIRE", "field-format", {**info, "field": "notes"}),
        ("WIRE", "layout-added", {"message": "HW_RICHRESPONSE", "form": "data"}),
        ("WIRE", "layout-added", {"message": "MOT_GET_STATUSUPDATE", "form": "data:long"}),
    ]


def test_fields_have_the_offsets_in_the_notes(later: list[Protocol]) -> None:
    [protocol] = [p for p in later if p.name == "thorlabs_apt"]
    layouts = {(m.name, x.form): x for m in protocol.messages for x in m.layouts}
    info, rich, long = (
        {field.name: field.offset for field in layouts[key].fields}
        for key in (
            ("HW_GET_INFO", "data"),
            ("HW_RICHRESPONSE", "data"),
            ("MOT_GET_STATUSUPDATE", "data:long"),
        )
    )
    assert (info["hw_version"], info["mod_state"], info["nchs"]) == (78, 80, 82)
    assert (info["reserved"] - info["notes"], info["hw_version"] - info["reserved"]) == (48, 12)
    assert rich == {"msg_ident": 0, "code": 2, "notes": 4}
    assert layouts["HW_RICHRESPONSE", "data"].length == 68
    assert layouts["MOT_GET_STATUSUPDATE", "data:long"].length == 28
    short = layouts["MOT_GET_STATUSUPDATE", "data"].fields
    assert [long[field.name] for field in short] == [field.offset for field in short]


# The command


def test_generated_files_are_checked_with_the_overlay(
    overlaid_spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["generate", "--spec", str(overlaid_spec / "tiny"), "--out", str(tmp_path)]
    assert main([*arguments, "--overlay", "tiny/third"]) == 0
    assert main([*arguments, "--overlay", "tiny/third", "--check"]) == 0
    assert main([*arguments, "--check"]) == 1
    assert "stagewire_tiny/messages/extra.py" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["generate", "check"])
@pytest.mark.parametrize(
    ("overlays", "wanted"),
    [
        (
            ["thorlabs_apt/earlier"],
            f"unknown overlay thorlabs_apt/earlier (choose from {OVERLAYS})",
        ),
        (["later_issues"], f"unknown overlay later_issues (choose from {OVERLAYS})"),
        ([NAME, NAME], f"--overlay {NAME} is given twice"),
    ],
)
def test_a_wrong_overlay_option_is_an_error(
    command: str,
    overlays: list[str],
    wanted: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    given = [part for name in overlays for part in ("--overlay", name)]
    out = ["--out", str(tmp_path / "out")] if command == "generate" else []
    spec = ["--spec", str(SPEC)] if command == "generate" else [str(SPEC)]
    assert main([command, *spec, *out, *given]) == 2
    assert wanted in " ".join(capsys.readouterr().err.split())
    assert not list(tmp_path.iterdir())


def test_an_overlay_option_for_a_spec_without_overlays_is_an_error(
    good_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(good_spec), "--overlay", "tiny/second"]) == 2
    assert "unknown overlay tiny/second (the spec has no overlays)" in capsys.readouterr().err


def test_several_overlays_can_be_checked_together(
    overlaid_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["check", str(overlaid_spec), "--overlay", "tiny/second", "--overlay", "tiny/third"]
    assert main(arguments) == 0
    assert "tiny/third: ok" in capsys.readouterr().out
    assert main([*arguments, "--against", str(overlaid_spec)]) == 2
    assert "each overlay on its own" in capsys.readouterr().err
