"""The Python package of a protocol: the view of each module, its imports, and their rendering."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from stagewire_generator.model import Factor, Limit, Overlay, Protocol
from stagewire_generator.targets.documentation import sentence
from stagewire_generator.targets.python.class_view import ClassView
from stagewire_generator.targets.python.devices import DevicesView, devices_view
from stagewire_generator.targets.python.framing import framing_of
from stagewire_generator.targets.python.named_view import (
    NamedView,
    QuantityView,
    StageView,
    enumeration_view,
    flag_table_view,
    quantity_view,
    stage_view,
)
from stagewire_generator.targets.python.source import (
    SUPPORT,
    WIDTH,
    bracketed,
    docstring,
    exported,
    imported,
    paragraph,
    tuple_of,
    where,
    width,
)
from stagewire_generator.targets.registry import registry_text
from stagewire_generator.targets.templates import Templates, TemplatesError
from stagewire_generator.targets.vectors import vectors_text

# base of a class -> what else its template names
_BESIDE = {"FramedMessage": ("check_addresses",)}
_CALLED = ("check_bytes", "check_integer", "check_text")
"""Functions that a check may call."""
# kinds of classes
_WITH_STRUCT = {"plain", "undecided", "command", "payload"}
_WITH_SELF = {"plain", "command", "payload"}


def class_imports(package: str, views: Sequence[ClassView]) -> list[str]:
    """Return the statements by which a module imports what its classes stand on."""
    names = {"Direction", "Layout"}
    for view in views:
        names.update((view.base, *_BESIDE.get(view.base, ())))
    checks = [field.check for view in views for field in view.fields]
    names.update(name for name in _CALLED if any(f"{name}(" in check for check in checks))
    flags = {field.flags for view in views for field in view.fields if field.flags}
    return [imported(SUPPORT, list(names))] + (
        [imported(f"{package}.flags", list(flags))] if flags else []
    )


def uses_struct(views: Sequence[ClassView]) -> bool:
    """Whether a class of the module packs or reads named fields."""
    return any(view.kind in _WITH_STRUCT for view in views)


def uses_self(views: Sequence[ClassView]) -> bool:
    """Whether a class of the module is made from named fields."""
    return any(view.kind in _WITH_SELF for view in views)


_SELF = (
    "TYPE_CHECKING = False  # type checkers know the name; typing takes long to import",
    "if TYPE_CHECKING:",
    "    from typing import Self",
)

_EXPORTED = ("PROTOCOL", "decode", "enumerations", "flags", "messages", "quantities", "stages")


@dataclass(frozen=True, slots=True)
class ChapterView:
    """One module of messages."""

    name: str
    doc: str
    classes: tuple[ClassView, ...]
    standard: tuple[str, ...]  # statements that import from the standard library
    imports: tuple[str, ...]
    typing: tuple[str, ...]  # lines that only type checkers read
    all: str
    exported: str  # the statement by which the package imports the classes


@dataclass(frozen=True, slots=True)
class PackageView:
    """The package."""

    package: str
    title: str
    doc: str
    chapters: tuple[ChapterView, ...]
    enumerations: tuple[NamedView, ...]
    enumerations_all: str
    flags: tuple[NamedView, ...]
    flags_all: str
    stages: tuple[StageView, ...]
    stages_all: str
    stage_imports: str
    quantities: tuple[QuantityView, ...]
    quantities_all: str
    messages_all: str
    messages: str  # the statement that lists the classes
    devices: DevicesView | None  # of a protocol with units
    package_all: str
    protocol_imports: tuple[str, ...]
    protocol: str


def package_view(protocol: Protocol) -> PackageView:
    """Make the view of a whole package."""
    made = {message.chapter for message in protocol.messages if message.id is not None}
    chapters = tuple(_chapter(protocol, c.name) for c in protocol.chapters if c.name in made)
    document = protocol.document
    framing = framing_of(protocol)
    flags = tuple(
        flag_table_view(protocol, t) for t in sorted(protocol.flags, key=lambda t: t.name)
    )
    enumerations = tuple(
        enumeration_view(protocol, e) for e in sorted(protocol.enumerations, key=lambda e: e.name)
    )
    quantities = tuple(
        quantity_view(protocol, quantity, quantity.factor)
        for quantity in sorted(protocol.quantities, key=lambda q: q.name)
        if quantity.factor
    )
    stages = tuple(stage_view(protocol, s) for s in sorted(protocol.stages, key=lambda s: s.name))
    devices = devices_view(protocol)
    names = [view.name for chapter in chapters for view in chapter.classes]
    factors = [f for s in protocol.stages for scales in s.scales.values() for f in scales.values()]
    kinds = ["Stage"] if stages else []
    kinds += ["Scale"] if any(isinstance(f, Factor) for f in factors) else []
    limits = [limit for stage in protocol.stages for limit in stage.limits.values()]
    kinds += ["Limit"] if any(isinstance(limit, Limit) for limit in limits) else []
    kinds += ["UnknownLimit"] if any(isinstance(limit, str) for limit in limits) else []
    kinds += ["UnknownScale"] if any(isinstance(f, str) for f in factors) else []
    return PackageView(
        package=protocol.package,
        title=docstring(_plain(protocol.python_title)),
        doc=_head(
            f"{protocol.title}, issue {document['issue']} of {document['date']}.",
            protocol.summary,
            *(_overlay(overlay) for overlay in protocol.overlays),
        ),
        chapters=chapters,
        enumerations=enumerations,
        enumerations_all=exported([e.name for e in enumerations]),
        flags=flags,
        flags_all=exported([t.name for t in flags]),
        stages=stages,
        stages_all=exported([s.name for s in stages]),
        stage_imports=imported(SUPPORT, sorted(kinds)) if kinds else "",
        quantities=quantities,
        quantities_all=exported([q.name for q in quantities]),
        messages_all=exported([*names, "MESSAGES", "PROTOCOL", "decode"]),
        devices=devices,
        package_all=exported(
            [*_EXPORTED, *(("aio", "devices", *devices.names) if devices else ())]
        ),
        messages=_messages(framing.message_base, names),
        protocol_imports=framing.imports(protocol),
        protocol=framing.protocol(protocol),
    )


def _messages(base: str, names: list[str]) -> str:
    """Return the tuple of all classes, one a line; a formatter keeps a single one beside the brackets."""
    head = f"MESSAGES: tuple[type[{base}], ...] = "
    line = head + tuple_of(names)
    if len(names) < 2 and width(line) <= WIDTH:
        return line
    return bracketed(f"{head}(", names, ")", 0, 0)


def _plain(text: str) -> str:
    """Return a text with single blanks, and none at its ends."""
    return " ".join(text.split())


def _overlay(overlay: Overlay) -> str:
    """Return what the package says of a later issue that is laid over the document."""
    document = overlay.document
    issue = f"{document['title']}, issue {document['issue']} of {document['date']}"
    return f"With the overlay ``{overlay.name}``: {sentence(overlay.title)} Its document: {issue}."


def _head(title: str, *texts: str) -> str:
    """Return the beginning of a module's docstring."""
    paragraphs = (paragraph(text, 0) for text in texts)
    return docstring("\n\n".join(filter(None, (_plain(title), *paragraphs))))


def _chapter(protocol: Protocol, name: str) -> ChapterView:
    chapter = next(c for c in protocol.chapters if c.name == name)
    framing = framing_of(protocol)
    classes: list[ClassView] = []
    for message in protocol.messages:
        if message.chapter == name and message.id is not None:
            classes += framing.class_views(protocol, message)
    names = sorted(view.name for view in classes)
    return ChapterView(
        name=name,
        doc=_head(
            f"{chapter.title} (document {where(protocol, [chapter.page], chapter.overlay)}).",
            chapter.summary,
        ),
        classes=tuple(classes),
        standard=("from struct import Struct",) if uses_struct(classes) else (),
        imports=tuple(class_imports(protocol.package, classes)),
        typing=_SELF if uses_self(classes) else (),
        all=exported(names),
        exported=imported(f"{protocol.package}.messages.{name}", names),
    )


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
