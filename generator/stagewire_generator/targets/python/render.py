"""Render the Python package of a protocol."""

from __future__ import annotations

from functools import cache

import jinja2

from stagewire_generator.model import Protocol
from stagewire_generator.targets.python.view import package_view
from stagewire_generator.targets.registry import registry_text
from stagewire_generator.targets.vectors import vectors_text

__all__ = ["render"]

_MODULES = {
    "__init__.py": "package.py.j2",
    "enumerations.py": "enumerations.py.j2",
    "flags.py": "flags.py.j2",
    "quantities.py": "quantities.py.j2",
    "stages.py": "stages.py.j2",
    "messages/__init__.py": "messages.py.j2",
}


def render(protocol: Protocol) -> dict[str, str]:
    """Return path -> text of the package."""
    view = package_view(protocol)
    folder = f"python/{protocol.package}"
    files = {
        f"{folder}/{path}": _template(name).render(package=view) for path, name in _MODULES.items()
    }
    for chapter in view.chapters:
        text = _template("chapter.py.j2").render(package=view, chapter=chapter)
        files[f"{folder}/messages/{chapter.name}.py"] = text
    files[f"{folder}/registry.json"] = registry_text(protocol)
    files[f"{folder}/vectors.json"] = vectors_text(protocol)
    files[f"{folder}/py.typed"] = ""
    return files


@cache
def _environment() -> jinja2.Environment:
    return jinja2.Environment(
        loader=jinja2.PackageLoader("stagewire_generator.targets.python"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # Python source: the view has escaped every text
    )


def _template(name: str) -> jinja2.Template:
    return _environment().get_template(name)
