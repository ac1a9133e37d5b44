"""Framings of the generator: each has a directory and a row, and no other module depends on the kind."""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator
from pathlib import Path

import pytest

import stagewire_generator
from checkout import ROOT
from stagewire_generator.framing import FOLDER, FRAMINGS, Parts, Rules, part
from stagewire_generator.lint.witness.witness import Witness
from stagewire_generator.targets.c.framing import Framing as CFraming
from stagewire_generator.targets.python.devices.plan import DeviceFraming
from stagewire_generator.targets.python.framing import Framing as PythonFraming
from stagewire_generator.targets.vectors.framing import Framing as VectorFraming

GENERATOR = Path(stagewire_generator.__file__).parent
FRAMING_FOLDER = GENERATOR / "framings"
TYPES = {
    "rules": Rules,
    "witness": Witness,
    "python": PythonFraming,
    "devices": DeviceFraming,
    "c": CFraming,
}


def modules() -> list[Path]:
    """Return the modules outside the directories of the framings, without compiled templates."""
    return [
        path
        for path in sorted(GENERATOR.rglob("*.py"))
        if FRAMING_FOLDER not in path.parents and "compiled" not in path.parts
    ]


def decisions(source: str) -> Iterator[str]:
    """Yield comparisons of the kind of a framing, and look-ups of it in tables other than ``FRAMINGS``."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Compare):
            parts = [node.left, *node.comparators]
        elif isinstance(node, ast.Subscript) and ast.unparse(node.value) != "FRAMINGS":
            parts = [node.slice]
        else:
            continue
        if any(ast.unparse(one).endswith("framing['kind']") for one in parts):
            yield ast.unparse(node)


def test_every_kind_of_the_schema_has_a_row_and_a_directory() -> None:
    schema = json.loads((ROOT / "spec" / "schema" / "protocol.schema.json").read_bytes())
    kinds = schema["properties"]["framing"]["properties"]["kind"]["enum"]
    folders = {path.parent.name for path in FRAMING_FOLDER.glob("*/__init__.py")}
    assert set(kinds) == FRAMINGS.keys() == folders


@pytest.mark.parametrize("kind", FRAMINGS)
def test_every_framing_has_all_parts(kind: str) -> None:
    for name in Parts.__slots__:
        entry, found = getattr(FRAMINGS[kind], name), part(kind, name)
        if not entry:
            assert found is None
        elif name == "vectors":
            assert issubclass(found, VectorFraming)
        else:
            assert isinstance(found, TYPES[name]), name
        assert not entry or entry.startswith(f"{kind}.")


@pytest.mark.parametrize("path", modules(), ids=lambda path: path.relative_to(GENERATOR).as_posix())
def test_no_other_module_depends_on_the_kind(path: Path) -> None:
    source = path.read_text(encoding="utf-8")
    assert list(decisions(source)) == []
    assert f"from {FOLDER}" not in source, "framing.py finds the parts"


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("x = protocol.framing['kind'] == 'slots'", 1),
        ("x = head.framing['kind'] not in ('slots',)", 1),
        ("x = _TABLE[protocol.framing['kind']]", 1),
        ("x = FRAMINGS[protocol.framing['kind']].c", 0),
        ("x = part(protocol.framing['kind'], 'c')", 0),
    ],
)
def test_a_decision_is_found(source: str, found: int) -> None:
    assert len(list(decisions(source))) == found


@pytest.mark.parametrize("kind", FRAMINGS)
def test_checking_imports_no_target(kind: str) -> None:
    for entry in (FRAMINGS[kind].rules, FRAMINGS[kind].witness):
        module, _, _ = entry.partition(":")
        path = FRAMING_FOLDER / f"{module.replace('.', '/')}.py"
        assert "stagewire_generator.targets" not in path.read_text(encoding="utf-8")
