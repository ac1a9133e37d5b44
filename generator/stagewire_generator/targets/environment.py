"""The Jinja environment of our templates, and our templates compiled to Python modules.

Compiling all templates takes longer than rendering a protocol, so the wheel contains them compiled. The
directory of the modules is named after a digest of the templates, the settings and the version of Jinja.
When one of these changes, the directory is not found and the templates are compiled from their texts.

The build runs this module alone (``hatch_build.py``), so it must not import our other modules.
"""

from __future__ import annotations

import hashlib
import shutil
from functools import cache
from pathlib import Path
from typing import Any

import jinja2

COMPILED = Path(__file__).parent / "compiled"
_ROOMS = ("framings", "targets")
_SETTINGS: dict[str, Any] = {
    "trim_blocks": True,
    "lstrip_blocks": True,
    "keep_trailing_newline": True,
    "autoescape": False,  # the output is source code: the views have escaped every text
}


def environment(loader: jinja2.BaseLoader) -> jinja2.Environment:
    """Return an environment with the settings of our templates."""
    return jinja2.Environment(loader=loader, undefined=jinja2.StrictUndefined, **_SETTINGS)


@cache
def our_templates() -> tuple[Path, ...]:
    """Return our templates of all targets and framings, sorted by directory and name."""
    ours = Path(__file__).parent.parent
    return tuple(sorted(p for room in _ROOMS for p in ours.glob(f"{room}/*/templates/*.j2")))


def compiled_templates(templates: tuple[Path, ...]) -> Path:
    """Return the directory of the compiled templates, which may not exist."""
    made_of = hashlib.sha256(f"{jinja2.__version__} {_SETTINGS}".encode())
    for path in templates:
        text = path.read_bytes()
        made_of.update(f"\n{path.name} {len(text)}\n".encode())
        made_of.update(text)
    return COMPILED / made_of.hexdigest()[:32]


def compile_templates(folder: Path) -> None:
    """Compile our templates into a directory and delete its previous contents."""
    templates = our_templates()
    loader = jinja2.FileSystemLoader(sorted({path.parent for path in templates}))
    unfinished = folder / "unfinished"
    shutil.rmtree(folder, ignore_errors=True)
    environment(loader).compile_templates(unfinished, zip=None)
    unfinished.rename(folder / compiled_templates(templates).name)
