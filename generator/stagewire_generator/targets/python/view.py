"""The Python package of a protocol: the views of its modules, their imports, and rendering."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from stagewire_generator.model import (
    Overlay,
    Protocol,
)
from stagewire_generator.model_scales import (
    Conflict,
    Factor,
    Limit,
)
from stagewire_generator.naming import class_aliases
from stagewire_generator.targets.documentation import chapter_place, sentence
from stagewire_generator.targets.python.brackets import FUNCTIONS, Import, Nested
from stagewire_generator.targets.python.class_view import ClassView
from stagewire_generator.targets.python.devices import DevicesView, devices_view
from stagewire_generator.targets.python.framing import framing_of
from stagewire_generator.targets.python.named_view import (
    NamedView,
    QuantityView,
    SharedView,
    StageView,
    enumeration_view,
    flag_table_view,
    quantity_view,
    stage_views,
)
from stagewire_generator.targets.python.source import (
    SUPPORT,
    docstring,
    paragraph,
)
from stagewire_generator.targets.registry import registry_text
from stagewire_generator.targets.templates import Templates, TemplatesError
from stagewire_generator.targets.vectors import vectors_text

# base of a class -> other names that its template uses
_BESIDE = {"FramedMessage": ("check_addresses",), "CountedMessage": ("Counted",)}
# kinds of classes
_WITH_STRUCT = {"plain", "counted", "undecided", "command", "payload"}
_WITH_SELF = {"plain", "counted", "command", "payload"}


def class_imports(package: str, views: Sequence[ClassView]) -> list[Import]:
    """Return the imports of a module of messages."""
    names = {"Direction", "Layout"}
    for view in views:
        names.update((view.base, *_BESIDE.get(view.base, ())))
    kinds = {field.kind for view in views for field in view.fields} - {"array"}
    names.update(f"check_{kind}" for kind in kinds)
    flags = {field.flags for view in views for field in view.fields if field.flags}
    return [Import(SUPPORT, tuple(names))] + (
        [Import(f"{package}.flags", tuple(flags))] if flags else []
    )


_EXPORTED = ("PROTOCOL", "decode", "enumerations", "flags", "messages", "quantities", "stages")


class ChapterView(NamedTuple):
    """One module of messages."""

    name: str
    doc: str
    classes: tuple[ClassView, ...]
    uses_struct: bool  # whether a class packs or unpacks named fields
    uses_self: bool  # whether a class has named fields
    uses_arrays: bool  # whether a class has an array
    imports: tuple[Import, ...]
    aliases: tuple[tuple[str, str], ...]  # other name of a class -> the class
    names: tuple[str, ...]


class PackageView(NamedTuple):
    """The package."""

    package: str
    title: str
    doc: str
    chapters: tuple[ChapterView, ...]
    enumerations: tuple[NamedView, ...]
    flags: tuple[NamedView, ...]
    shared: tuple[SharedView, ...]
    stages: tuple[StageView, ...]
    stage_imports: tuple[str, ...]
    quantities: tuple[QuantityView, ...]
    messages: tuple[str, ...]  # names of all message classes
    message_aliases: tuple[str, ...]  # other names of message classes
    message_base: str  # their common base class
    devices: DevicesView | None  # None for a protocol without units
    exports: tuple[str, ...]
    protocol_imports: tuple[str, ...]
    protocol: Nested  # the call that creates the protocol object


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
    shared, stages = stage_views(protocol)
    devices = devices_view(protocol)
    factors = [f for s in protocol.stages for scales in s.scales.values() for f in scales.values()]
    kinds = ["Stage"] if stages else []
    kinds += ["Scale"] if any(isinstance(f, Factor | Conflict) for f in factors) else []
    limits = [limit for stage in protocol.stages for limit in stage.limits.values()]
    kinds += ["Limit"] if any(isinstance(x, Limit) and x.value is not None for x in limits) else []
    kinds += ["UnknownLimit"] if any(isinstance(limit, str) for limit in limits) else []
    kinds += ["UnknownScale"] if any(isinstance(f, str) for f in factors) else []
    kinds += ["ScaleConflict"] if any(isinstance(f, Conflict) for f in factors) else []
    endless = [limit for limit in limits if isinstance(limit, Limit) and limit.value is None]
    kinds += ["EndlessTravel"] if endless else []
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
        flags=flags,
        shared=shared,
        stages=stages,
        stage_imports=tuple(kinds),
        quantities=quantities,
        messages=tuple(view.name for chapter in chapters for view in chapter.classes),
        message_aliases=tuple(alias for chapter in chapters for alias, _ in chapter.aliases),
        message_base=framing.message_base,
        devices=devices,
        exports=(*_EXPORTED, *(("aio", "devices", *devices.names) if devices else ())),
        protocol_imports=framing.imports(protocol),
        protocol=framing.protocol(protocol),
    )


def _plain(text: str) -> str:
    """Return a text with single spaces, and none at its ends."""
    return " ".join(text.split())


def _overlay(overlay: Overlay) -> str:
    """Return the description of an overlay: a later issue of the document."""
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
    aliases: list[tuple[str, str]] = []
    for message in protocol.messages:
        if message.chapter == name and message.id is not None:
            classes += framing.class_views(protocol, message)
            aliases += class_aliases(message)
    return ChapterView(
        name=name,
        doc=_head(
            f"{chapter.title} ({chapter_place(protocol, chapter)}).",
            chapter.summary,
        ),
        classes=tuple(classes),
        uses_struct=any(view.kind in _WITH_STRUCT for view in classes),
        uses_self=any(view.kind in _WITH_SELF for view in classes),
        uses_arrays=any(view.kind == "counted" for view in classes),
        imports=tuple(class_imports(protocol.package, classes)),
        aliases=tuple(aliases),
        names=tuple(sorted([*(view.name for view in classes), *(name for name, _ in aliases)])),
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

    :raises TemplatesError: if the user's templates produce invalid Python.
    """
    view = package_view(protocol)
    folder = f"python/{protocol.package}"

    def rendered(name: str, **values: object) -> str:
        return templates.render(name, package=view, **FUNCTIONS, **values)

    files = {f"{folder}/{path}": rendered(name) for path, name in _MODULES.items()}
    for chapter in view.chapters:
        text = rendered("chapter.py.j2", chapter=chapter)
        files[f"{folder}/messages/{chapter.name}.py"] = text
    if view.devices:
        files |= _devices(partial(rendered, devices=view.devices), view.devices, folder)
    if templates.of_a_user:
        _check_syntax(files)
    files[f"{folder}/registry.json"] = registry_text(protocol)
    files[f"{folder}/vectors.json"] = vectors_text(protocol)
    files[f"{folder}/py.typed"] = ""
    return files


def _devices(rendered: Callable[..., str], devices: DevicesView, folder: str) -> dict[str, str]:
    """Return path -> text of the device classes for threads and for asyncio."""
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
    """Check that the modules compile. Needed only for user templates: ours produce valid Python."""
    problems = []
    for path, text in modules.items():
        try:
            compile(text, path, "exec", dont_inherit=True)
        except (SyntaxError, ValueError) as error:
            line = getattr(error, "lineno", None) or 1
            problems.append(f"{path}:{line}: the templates produce invalid Python: {error}")
    if problems:
        raise TemplatesError("\n".join(problems))
