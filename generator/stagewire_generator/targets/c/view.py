"""The C package of a protocol and its tests: the views of the files, and rendering."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from stagewire_generator.framing import FRAMINGS
from stagewire_generator.model import Chapter, Protocol
from stagewire_generator.targets.c.framing import File, framing_of
from stagewire_generator.targets.c.named_view import (
    TableView,
    enumeration_view,
    flag_table_view,
    quantities_view,
)
from stagewire_generator.targets.c.source import (
    Names,
    comment_lines,
    names_of,
    plain,
    string,
)
from stagewire_generator.targets.c.testing.cases import cases_view
from stagewire_generator.targets.c.testing.examples import examples_view
from stagewire_generator.targets.c.testing.round_trip import layouts_view, round_trip_view
from stagewire_generator.targets.documentation import chapter_place
from stagewire_generator.targets.templates import Templates


class ChapterView(NamedTuple):
    """A header of messages; ``doc`` is the lines of its comment."""

    name: str
    doc: tuple[str, ...]
    messages: tuple[Any, ...]


class PackageView(NamedTuple):
    """A package; ``p`` and ``P`` are the prefixes of its names and its macros."""

    names: Names
    title: str
    doc: tuple[str, ...]  # lines of a comment that describes the protocol
    framing: Any  # as in the registry
    enumerations: tuple[TableView, ...]
    flags: tuple[TableView, ...]
    chapters: tuple[ChapterView, ...]
    has_sub_messages: bool  # whether several messages share an id
    longest_array: int  # length of the longest packet with an array; 0 if there is none
    without_flag: tuple[str, ...]  # heads of frames that have a packet even without the data flag

    @property
    def package(self) -> str:
        """Name of the directory."""
        return self.names.package

    @property
    def p(self) -> str:
        """Prefix of types and functions."""
        return self.names.prefix

    @property
    def P(self) -> str:
        """Prefix of macros."""
        return self.names.macro_prefix


def package_view(protocol: Protocol) -> PackageView:
    """Make the view of a whole package."""
    names, document = names_of(protocol), protocol.document
    made = {message.chapter for message in protocol.messages if message.id is not None}
    return PackageView(
        names=names,
        title=plain(protocol.python_title),
        doc=comment_lines(
            [
                f"{protocol.title}, issue {document['issue']} of {document['date']}.",
                protocol.summary,
            ]
        ),
        framing=protocol.framing,
        enumerations=tuple(
            enumeration_view(names, protocol, e)
            for e in sorted(protocol.enumerations, key=lambda e: e.name)
        ),
        flags=tuple(
            flag_table_view(names, protocol, t)
            for t in sorted(protocol.flags, key=lambda t: t.name)
        ),
        chapters=tuple(_chapter(protocol, c) for c in protocol.chapters if c.name in made),
        has_sub_messages=any(message.sub_message is not None for message in protocol.messages),
        longest_array=max(
            (
                layout.longest
                for message in protocol.messages
                for layout in message.layouts
                if message.id is not None and layout.array
            ),
            default=0,
        ),
        without_flag=tuple(
            f"UINT32_C(0x{head:08X})"
            for head in sorted(
                {
                    layout.length << 16 | (message.id or 0)
                    for message in protocol.messages
                    for layout in message.layouts
                    if message.without_flag and layout.form != "header"
                }
            )
        ),
    )


def _chapter(protocol: Protocol, chapter: Chapter) -> ChapterView:
    make = framing_of(protocol).message_view
    return ChapterView(
        name=chapter.name,
        doc=comment_lines(
            [f"{chapter.title} ({chapter_place(protocol, chapter)}).", chapter.summary]
        ),
        messages=tuple(
            make(protocol, message)
            for message in protocol.messages
            if message.chapter == chapter.name and message.id is not None
        ),
    )


class TesteeView(NamedTuple):
    """The testee of a protocol; names are literals.

    :param name: name of the protocol.
    :param nameless: messages that the document names without an id.
    :param axis: a valid axis; empty if messages have no axis.
    """

    name: str
    nameless: tuple[str, ...]
    axis: str


def testee_view(protocol: Protocol) -> TesteeView:
    """Make the view of the testee of a protocol."""
    axes = protocol.framing.get("axes")
    values = [value.value for e in protocol.enumerations if e.name == axes for value in e.values]
    return TesteeView(
        name=string(protocol.name),
        nameless=tuple(string(m.name) for m in protocol.messages if m.id is None),
        axis=f"0x{values[0]:02X}" if values else "",
    )


# Files of all framings
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
# Test files that all packages share, copied next to the directories of the packages
_STATIC = Path(__file__).parent / "static"


def render(protocol: Protocol, templates: Templates) -> dict[str, str]:
    """Return path -> text of the package; empty if its framing is not supported in C."""
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
    """Return path -> text of the tests of the package and of the tests that all packages share."""
    if not FRAMINGS[protocol.framing["kind"]].c:
        return {}
    package = _Package(protocol, templates)
    for file in (*_TESTS, File(_TESTEE, framing_of(protocol).testee, testee_view)):
        package.add(file.path, file.template, view=file.view(protocol))
    return package.files | _static()


class _Package:
    """The rendered files of a package."""

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
    """Return path -> text of the files that all packages share."""
    return {
        f"c/{path.relative_to(_STATIC).as_posix()}": path.read_text(encoding="utf-8")
        for path in sorted(_STATIC.rglob("*.[ch]"))
    }
