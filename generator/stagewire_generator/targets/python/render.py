"""Render the Python package of a protocol."""

from __future__ import annotations

from stagewire_generator.model import Protocol
from stagewire_generator.targets.python.devices import DevicesView
from stagewire_generator.targets.python.view import PackageView, package_view
from stagewire_generator.targets.registry import registry_text
from stagewire_generator.targets.templates import Templates, TemplatesError
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


def render(protocol: Protocol, templates: Templates) -> dict[str, str]:
    """Return path -> text of the package.

    Raises :class:`TemplatesError` when templates of a user make of it what is no Python.
    """
    view = package_view(protocol)
    folder = f"python/{protocol.package}"
    files = {
        f"{folder}/{path}": templates.render(name, package=view) for path, name in _MODULES.items()
    }
    for chapter in view.chapters:
        text = templates.render("chapter.py.j2", package=view, chapter=chapter)
        files[f"{folder}/messages/{chapter.name}.py"] = text
    if view.devices:
        files |= _devices(templates, view, view.devices, folder)
    if templates.of_a_user:
        _check_syntax(files)
    files[f"{folder}/registry.json"] = registry_text(protocol)
    files[f"{folder}/vectors.json"] = vectors_text(protocol)
    files[f"{folder}/py.typed"] = ""
    return files


def _devices(
    templates: Templates, package: PackageView, devices: DevicesView, folder: str
) -> dict[str, str]:
    """Return path -> text of the device classes, those for threads and those for asyncio."""

    def rendered(name: str, **values: object) -> str:
        return templates.render(name, package=package, devices=devices, **values)

    files = {
        f"{folder}/devices/{name}.py": rendered(f"device_{name}.py.j2")
        for name in ("facts", "tables")
    }
    files[f"{folder}/devices/values/__init__.py"] = rendered("device_values.py.j2")
    for module in devices.values:
        text = rendered("device_values_chapter.py.j2", module=module)
        files[f"{folder}/devices/values/{module.name}.py"] = text
    for side in devices.sides:
        within = f"{folder}/{side.package}"
        files[f"{within}/__init__.py"] = rendered("device_package.py.j2", side=side)
        files[f"{within}/units.py"] = rendered("device_units.py.j2", side=side)
        files[f"{within}/parts/__init__.py"] = rendered("device_parts.py.j2", side=side)
        for module in side.parts:
            text = rendered("device_parts_chapter.py.j2", side=side, module=module)
            files[f"{within}/parts/{module.name}.py"] = text
    return files


def _check_syntax(modules: dict[str, str]) -> None:
    """Check that modules can be compiled; ours always can, so that it is done for a user's alone."""
    problems = []
    for path, text in modules.items():
        try:
            compile(text, path, "exec", dont_inherit=True)
        except (SyntaxError, ValueError) as error:
            line = getattr(error, "lineno", None) or 1
            problems.append(f"{path}:{line}: the templates make what is no Python: {error}")
    if problems:
        raise TemplatesError("\n".join(problems))
