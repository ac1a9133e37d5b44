"""Data blocks of the documentation are read by the code that reads such files."""

from __future__ import annotations

import contextlib
import io
import json
import re
import shlex
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from shell import lines

import stagewire_virtual as virtual
from checkout import ROOT
from markdown_blocks import blocks
from stagewire import read_stages
from stagewire.capture import read_capture
from stagewire.protocols import load_protocol
from stagewire_cli.main import main
from stagewire_conformance.device.pics_file import parse_pics
from stagewire_conformance.testee import Testee
from stagewire_conformance.testees import read_expected
from stagewire_conformance.testees.runner import plan
from stagewire_generator.codes import CODES
from stagewire_virtual.bench import load_bench

LEFT_OUT = "…"
LESS = {"required", "anyOf", "oneOf", "minProperties"}
"""Schema rules that do not apply to a shortened file."""


def shortened(value: Any) -> Any:
    """Return the content of a shortened file without its ellipses."""
    if isinstance(value, dict):
        kept = {key: shortened(each) for key, each in value.items() if key != LEFT_OUT}
        return {key: each for key, each in kept.items() if each != LEFT_OUT}
    if isinstance(value, list):
        return [shortened(each) for each in value if each != LEFT_OUT]
    return value


def schema(kind: str) -> Callable[[str, Path], None]:
    """Return a function that validates the keys and types of a shortened file against a schema."""

    def read(text: str, folder: Path) -> None:
        found = json.loads((ROOT / "spec" / "schema" / f"{kind}.schema.json").read_bytes())
        validator = jsonschema.Draft202012Validator(found)
        errors = [
            f"{error.json_path}: {error.message}"
            for error in validator.iter_errors(shortened(yaml.safe_load(text)))
            if error.validator not in LESS
        ]
        assert errors == []

    return read


def first_line(text: str, folder: Path) -> None:
    """Check that the block is the first line of the message files, where editors find the schema."""
    written = (ROOT / "spec" / "thorlabs_apt" / "messages" / "motor.yaml").read_text("utf-8")
    assert written.startswith(text)


def settings(text: str, folder: Path) -> None:
    """Read a part of a settings file."""
    assert all(value is False for value in json.loads(f"{{{text}}}").values())


def bench(text: str, folder: Path) -> None:
    """Load a bench of virtual controllers."""
    (folder / "bench.toml").write_text(text, encoding="utf-8")
    loaded = load_bench(folder / "bench.toml")
    assert len(loaded.units) == text.count("[[unit]]") > 0


def stages(text: str, folder: Path) -> None:
    """Read stages of a user."""
    (folder / "stages.toml").write_text(text, encoding="utf-8")
    assert list(read_stages(folder / "stages.toml")) == ["slide"]


def faults(text: str, folder: Path) -> None:
    """Parse faults, one per line. None of them acts immediately."""
    texts = [line.partition("#")[0].strip() for line in text.splitlines()]
    with virtual.TDC001(faults=texts) as tdc:
        assert tdc.read() == b""


def capture(text: str, folder: Path) -> None:
    """Read a recorded session."""
    (folder / "session.txt").write_text(text, encoding="utf-8")
    assert len(read_capture(folder / "session.txt").recorded) == 2


def message(text: str, folder: Path) -> None:
    """Compare a diagnostic of ``stagewire check`` and its hint with the table of codes."""
    found = re.fullmatch(r"(\S+\.yaml):\d+:\d+: (SW\d+) .*\n    hint: (.*)\n", text)
    assert found
    assert (ROOT / found[1]).is_file()
    assert CODES[found[2]].hint == found[3]


def pics(text: str, folder: Path) -> None:
    """Parse a PICS file completely."""
    found = parse_pics(text.encode())
    assert found.unit == "TDC001"
    assert found.timing.reply_p99_ms == 50
    assert len(found.unsupported) == 2


def certificate(text: str, folder: Path) -> None:
    """Parse a PICS file with all lines of a certificate."""
    stated = parse_pics(text.encode()).certificate
    assert all(asdict(stated).values())


def talk(text: str, folder: Path) -> None:
    """Compare requests and answers, except for the wording of refusals."""
    said = [json.loads(line) for line in text.splitlines()]
    for request, answer in zip(said[::2], said[1::2], strict=True):
        came = Testee().answer(json.dumps(request).encode())
        assert not {"detail"} & (came.keys() ^ answer.keys())
        assert {**came, "detail": ""} == {**answer, "detail": ""}


def expected(text: str, folder: Path) -> None:
    """Read expected failures of a codec, each of which must match a case."""
    (folder / "expected.toml").write_text(text, encoding="utf-8")
    read = read_expected(folder / "expected.toml")
    assert len(read.failures) == text.count("[[expected]]") == 2
    read.reasons(plan([load_protocol("thorlabs_apt")], seed=1))


def failure(text: str, folder: Path) -> None:
    """Compare the block with the output of the command above it."""
    blocks_before = [
        b.text for b in blocks(ROOT / "docs/tutorials/conformance.md") if "flip frame" in b.text
    ]
    [(command, status)] = lines(blocks_before[0])
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(io.StringIO()):
        assert main(shlex.split(command)[1:]) == status == 1
    wanted = [line for line in text.splitlines() if line.strip() != LEFT_OUT]
    assert len(wanted) == 4
    assert [line for line in printed.getvalue().splitlines() if line in wanted] == wanted


READ_BY: dict[tuple[str, str], Callable[[str, Path], None]] = {
    (
        "docs/diagnostics.md",
        "spec/thorlabs_apt/messages/motor.yaml:9:3: SW031 MOT_VELPARAMS: "
        "the fields take 14 bytes, but the length is 12",
    ): message,
    (
        "docs/how-to/editors.md",
        "# yaml-language-server: $schema=../../schema/messages.schema.json",
    ): first_line,
    ("docs/how-to/devices.md", "[slide]"): stages,
    ("docs/reference/codec-conformance.md", '{"id":1,"op":"hello"}'): talk,
    ("docs/reference/codec-conformance.md", "schema_version = 1"): expected,
    ("docs/reference/conformance.md", "schema_version = 1"): pics,
    ("docs/how-to/conformance-reports.md", "schema_version = 1"): certificate,
    (
        "docs/tutorials/conformance.md",
        "FAIL answers/0x50/MOT_REQ_VELPARAMS/1: MOT_REQ_VELPARAMS for channel 1 to 0x50 is answered by one "
        "MOT_GET_VELPARAMS",
    ): failure,
    ("docs/how-to/editors.md", '"yaml.schemaStore.enable": false,'): settings,
    ("docs/how-to/overlays.md", "overlay: later_issues"): schema("overlay"),
    ("docs/how-to/overlays.md", "messages:"): schema("additions"),
    ("docs/reference/registry.md", "parameter_sets:"): schema("messages"),
    ("docs/reference/registry.md", "enumerations:"): schema("messages"),
    ("docs/reference/registry.md", "formats:"): schema("protocol"),
    ("docs/reference/registry.md", "contexts:"): schema("protocol"),
    ("docs/reference/registry.md", "messages:"): schema("messages"),
    ("docs/reference/registry.md", "units:"): schema("units"),
    ("docs/reference/registry.md", "families:"): schema("units"),
    ("docs/reference/registry.md", "setup_commands:"): schema("messages"),
    ("docs/reference/registry.md", "framing:"): schema("protocol"),
    ("docs/reference/registry.md", "controllers:"): schema("stages"),
    ("docs/reference/registry.md", "stages:"): schema("stages"),
    ("docs/reference/registry.md", "settings:"): schema("quantities"),
    ("docs/reference/registry.md", "quantities:"): schema("quantities"),
    ("docs/reference/registry.md", "errata:"): schema("errata"),
    ("docs/reference/registry.md", "rules:"): schema("rules"),
    ("docs/reference/registry.md", "chapter: statements"): schema("printed"),
    ("docs/reference/registry.md", "decisions:"): schema("decisions"),
    ("docs/reference/registry.md", "sources:"): schema("evidence"),
    ("docs/how-to/virtual.md", "[[unit]]"): bench,
    ("docs/how-to/virtual.md", "to_controller flip byte p=0.001 seed=3"): faults,
    ("docs/how-to/virtual.md", "# stagewire capture 1 protocol=thorlabs_apt unit=TDC001"): capture,
}
"""The function that reads a block, by document and first line."""


def blocks_of(document: str, first: str) -> list[str]:
    """Return the texts of the blocks that begin with a line; at least one."""
    found = [block.text for block in blocks(ROOT / document) if block.first == first]
    assert found
    return found


@pytest.mark.parametrize(("document", "first"), list(READ_BY))
def test_a_data_block_is_valid(document: str, first: str, tmp_path: Path) -> None:
    for text in blocks_of(document, first):
        READ_BY[document, first](text, tmp_path)
