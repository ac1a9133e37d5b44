"""``python/pyproject.toml`` and ``python/README.md``, which make a package installable with pip."""

from __future__ import annotations

from stagewire_generator.model import Protocol
from stagewire_generator.targets.project.view import project_view
from stagewire_generator.targets.templates import Templates

__all__ = ["render"]


def render(protocol: Protocol, templates: Templates) -> dict[str, str]:
    """Return path -> text of the files next to the package."""
    view = project_view(protocol)
    return {
        "python/README.md": templates.render("readme.md.j2", project=view),
        "python/pyproject.toml": templates.render("pyproject.toml.j2", project=view),
    }
