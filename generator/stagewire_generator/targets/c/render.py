"""Render the C package of a protocol."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from stagewire_generator.model import Protocol
from stagewire_generator.targets.c.framing import File, framing_of
from stagewire_generator.targets.c.quantities_view import quantities_view
from stagewire_generator.targets.c.testing.cases import cases_view
from stagewire_generator.targets.c.testing.examples import examples_view
from stagewire_generator.targets.c.testing.layouts import layouts_view
from stagewire_generator.targets.c.testing.round_trip import round_trip_view
from stagewire_generator.targets.c.view import package_view
from stagewire_generator.targets.templates import Templates

__all__ = ["render"]

# What there is whatever the framing: one line a file.
_FILES = (
    File("enumerations.h", "enumerations.h.j2", included=True),
    File("flags.h", "flags.h.j2", included=True),
    File("quantities.h", "quantities.h.j2", quantities_view),
)
# What tests a package, wherever there are messages to test.
_TESTS = (
    File("testing/layouts.h", "testing_layouts.h.j2", layouts_view),
    File("testing/layouts.c", "testing_layouts.c.j2", layouts_view),
    File("testing/vectors.h", "testing_package_vectors.h.j2"),
    File("testing/examples.c", "testing_examples.c.j2", examples_view),
    File("testing/cases.c", "testing_cases.c.j2", cases_view),
    File("testing/run_vectors.c", "testing_run_vectors.c.j2"),
    File("testing/round_trip.c", "testing_round_trip.c.j2", round_trip_view),
)
_UMBRELLA = "{package}.h"
# What is the same for every package: plain files, copied next to the folders of the packages.
_STATIC = Path(__file__).parent / "static"


def render(protocol: Protocol, templates: Templates) -> dict[str, str]:
    """Return path -> text of the package."""
    package, framing = package_view(protocol), framing_of(protocol)
    files: dict[str, str] = {}

    def add(path: str, template: str, **values: object) -> None:
        path = path.format(package=package.package)
        guard = package.names.guard(path)
        text = templates.render(template, package=package, path=path, guard=guard, **values)
        files[f"c/{package.package}/{path}"] = text

    listed = (*framing.files, *_FILES, *_TESTS)
    for file in listed:
        add(file.path, file.template, view=file.view(protocol))
    for chapter in package.chapters:
        add(f"messages/{chapter.name}.h", "chapter.h.j2", chapter=chapter, message=framing.message)
    add(_UMBRELLA, "package.h.j2", included=[file.path for file in listed if file.included])
    return files | _static()


@cache
def _static() -> dict[str, str]:
    """Return path -> text of what is the same for every package."""
    return {
        f"c/{path.relative_to(_STATIC).as_posix()}": path.read_text(encoding="utf-8")
        for path in sorted(_STATIC.rglob("*.[ch]"))
    }
