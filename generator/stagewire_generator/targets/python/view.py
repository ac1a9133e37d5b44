"""The package and its modules; what their classes look like stands beside this module."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Factor, Protocol
from stagewire_generator.targets.python.message_view import ClassView, class_views
from stagewire_generator.targets.python.named_view import (
    NamedView,
    StageView,
    enumeration_view,
    flag_table_view,
    stage_view,
)
from stagewire_generator.targets.python.source import (
    WIDTH,
    bracketed,
    call,
    docstring,
    imported,
    list_of,
    literal,
    natural,
    paragraph,
    width,
)

__all__ = ["ChapterView", "PackageView", "package_view"]


@dataclass(frozen=True, slots=True)
class ChapterView:
    """One module of messages."""

    name: str
    doc: str
    classes: tuple[ClassView, ...]
    imports: tuple[str, ...]
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
    messages_all: str
    protocol: str


def package_view(protocol: Protocol) -> PackageView:
    """Make the view of a whole package."""
    made = {message.chapter for message in protocol.messages if message.id is not None}
    chapters = tuple(_chapter(protocol, c.name) for c in protocol.chapters if c.name in made)
    document = protocol.document
    flags = tuple(flag_table_view(t) for t in sorted(protocol.flags, key=lambda t: t.name))
    enumerations = tuple(
        enumeration_view(e) for e in sorted(protocol.enumerations, key=lambda e: e.name)
    )
    stages = tuple(stage_view(protocol, s) for s in sorted(protocol.stages, key=lambda s: s.name))
    names = [view.name for chapter in chapters for view in chapter.classes]
    factors = [f for s in protocol.stages for scales in s.scales.values() for f in scales.values()]
    kinds = ["Stage"] if stages else []
    kinds += ["Scale"] if any(isinstance(f, Factor) for f in factors) else []
    kinds += ["UnknownScale"] if any(isinstance(f, str) for f in factors) else []
    return PackageView(
        package=protocol.package,
        title=docstring(_plain(protocol.python_title)),
        doc=_head(
            f"{protocol.title}, issue {document['issue']} of {document['date']}.", protocol.summary
        ),
        chapters=chapters,
        enumerations=enumerations,
        enumerations_all=_all([e.name for e in enumerations]),
        flags=flags,
        flags_all=_all([t.name for t in flags]),
        stages=stages,
        stages_all=_all([s.name for s in stages]),
        stage_imports=imported("stagewire.quantities", sorted(kinds)) if kinds else "",
        messages_all=_all([*names, "MESSAGES", "PROTOCOL", "decode"]),
        protocol=_protocol(protocol),
    )


def _plain(text: str) -> str:
    """Return a text with single blanks, and none at its ends."""
    return " ".join(text.split())


def _head(title: str, summary: str) -> str:
    """Return the beginning of a module's docstring."""
    return docstring("\n\n".join(filter(None, (_plain(title), paragraph(summary, 0)))))


def _all(names: list[str]) -> str:
    """Return the value of ``__all__``, sorted as the linter wants it: constants, classes, functions."""

    def key(name: str) -> tuple[int, list[str | int]]:
        return (0 if name.isupper() else 1 if name[:1].isupper() else 2, natural(name))

    return list_of([literal(name) for name in sorted(names, key=key)])


def _protocol(protocol: Protocol) -> str:
    framing = protocol.framing
    nameless = {m.name: "the document gives it no id" for m in protocol.messages if m.id is None}
    devices = [f"0x{d:02X}" for d in framing["devices"]]
    reasons = [f"{literal(n)}: {literal(w)}" for n, w in nameless.items()]
    lines = [
        literal(protocol.name),
        literal(protocol.title),
        literal(protocol.package),
        "MESSAGES",
        f"host=0x{framing['host']:02X}",
        _frozenset("devices", devices),
        bracketed("nameless={", reasons, "}", 4, WIDTH - 1),
    ]
    return call("PROTOCOL = Protocol", lines, "", 0, 0)


def _frozenset(name: str, items: list[str]) -> str:
    line = f"{name}=frozenset({{{', '.join(items)}}})"
    if 4 + width(line) + 1 <= WIDTH:
        return line
    return call(f"{name}=frozenset", [bracketed("{", items, "}", 8, 0)], "", 4, 0)


def _chapter(protocol: Protocol, name: str) -> ChapterView:
    chapter = next(c for c in protocol.chapters if c.name == name)
    classes: list[ClassView] = []
    for message in protocol.messages:
        if message.chapter == name and message.id is not None:
            classes += class_views(protocol, message)
    used = {field.flags for view in classes for field in view.fields if field.flags}
    source = "".join(field.check for view in classes for field in view.fields)
    kinds = {view.kind for view in classes}
    needed = ["Layout"]
    if "plain" in kinds:
        needed += ["Message", "check_addresses"]
    if "undecided" in kinds:
        needed.append("UndecidedMessage")
    if "undocumented" in kinds:
        needed.append("UndocumentedMessage")
    needed += [f"check_{k}" for k in ("bytes", "integer", "text") if f"check_{k}(" in source]
    imports = [
        imported("stagewire.direction", ["Direction"]),
        imported("stagewire.message", needed),
    ]
    if used:
        imports.append(imported(f"{protocol.package}.flags", list(used)))
    names = sorted(view.name for view in classes)
    return ChapterView(
        name=name,
        doc=_head(f"{chapter.title} (document page {chapter.page}).", chapter.summary),
        classes=tuple(classes),
        imports=tuple(imports),
        all=_all(names),
        exported=imported(f"{protocol.package}.messages.{name}", names),
    )
