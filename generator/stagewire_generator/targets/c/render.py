"""Render the C package of a protocol, and its tests."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from stagewire_generator.framing import FRAMINGS
from stagewire_generator.model import Protocol
from stagewire_generator.targets.c.framing import File, framing_of
from stagewire_generator.targets.c.quantities_view import quantities_view
from stagewire_generator.targets.c.testee_view import testee_view
from stagewire_generator.targets.c.testing.cases import cases_view
from stagewire_generator.targets.c.testing.examples import examples_view
from stagewire_generator.targets.c.testing.layouts import layouts_view
from stagewire_generator.targets.c.testing.round_trip import round_trip_view
from stagewire_generator.targets.c.view import package_view
from stagewire_generator.targets.templates import Templates

# What there is whatever the framing: one line a file.
_FILES = (
    File("enumerations.h", "enumerations.h.j2", included=True),
    File("flags.h", "flags.h.j2", included=True),
    File("quantities.h", "quantities.h.j2", quantities_view),
    File("CMakeLists.txt", "cmakelists.txt.j2"),
)
_UMBRELLA = "{package}.h"
_TESTS = (
    File("testing/layouts.h", "testing_layouts.h.j2", layouts_view),
    File("testing/layouts.c", "testing_layouts.c.j2", layouts_view),
    File("testing/vectors.h", "testing_package_vectors.h.j2"),
    File("testing/examples.c", "testing_examples.c.j2", examples_view),
    File("testing/cases.c", "testing_cases.c.j2", cases_view),
    File("testing/run_vectors.c", "testing_run_vectors.c.j2"),
    File("testing/round_trip.c", "testing_round_trip.c.j2", round_trip_view),
)
_TESTEE = "testing/testee.c"
# The tests that are the same for every package: plain files, copied next to the folders of the packages.
_STATIC = Path(__file__).parent / "static"


def render(protocol: Protocol, templates: Templates) -> dict[str, str]:
    """Return path -> text of the package; nothing where its framing is not made in C."""
    if not FRAMINGS[protocol.framing["kind"]].c:
        return {}
    package = _Package(protocol, templates)
    framing = framing_of(protocol)
    listed = (*framing.files, *_FILES)
    for file in listed:
        package.add(file.path, file.template, view=file.view(protocol))
    for chapter in package.view.chapters:
        path = f"messages/{chapter.name}.h"
        package.add(path, "chapter.h.j2", chapter=chapter, message=framing.message)
    included = [file.path for file in listed if file.included]
    package.add(_UMBRELLA, "package.h.j2", included=included)
    return package.files


def render_tests(protocol: Protocol, templates: Templates) -> dict[str, str]:
    """Return path -> text of the tests: those of the package, and those that all packages share."""
    if not FRAMINGS[protocol.framing["kind"]].c:
        return {}
    package = _Package(protocol, templates)
    for file in (*_TESTS, File(_TESTEE, framing_of(protocol).testee, testee_view)):
        package.add(file.path, file.template, view=file.view(protocol))
    return package.files | _static()


class _Package:
    """The files of a package, as they are rendered."""

    def __init__(self, protocol: Protocol, templates: Templates) -> None:
        self.view = package_view(protocol)
        self.files: dict[str, str] = {}
        self._templates = templates

    def add(self, path: str, template: str, **values: object) -> None:
        """Render a file; ``{package}`` in its path is the name of the package."""
        path = path.format(package=self.view.package)
        given = {"package": self.view, "path": path, "guard": self.view.names.guard(path)}
        text = self._templates.render(template, **given, **values)
        self.files[f"c/{self.view.package}/{path}"] = text


@cache
def _static() -> dict[str, str]:
    """Return path -> text of what is the same for every package."""
    return {
        f"c/{path.relative_to(_STATIC).as_posix()}": path.read_text(encoding="utf-8")
        for path in sorted(_STATIC.rglob("*.[ch]"))
    }
