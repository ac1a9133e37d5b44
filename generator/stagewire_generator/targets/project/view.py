"""What the files of a project say; every text of the spec is escaped here for TOML and Markdown."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import metadata

from stagewire_generator.framing import FRAMINGS, rules_of
from stagewire_generator.model import Field, Layout, Message, Protocol

_MARKUP = re.compile(r"([\\`*_\[\]<>&~$])")  # wherever it stands
_AT_THE_START = re.compile(r"^(?:[-+#=|:]|[0-9]+(?=[.)]))")  # of a list, a heading, a table


def toml(text: str) -> str:
    """Return a basic string of TOML, with its quotes; whatever cannot be seen is an escape."""
    escaped = []
    for char in text:
        if char in ('"', "\\"):
            escaped.append("\\" + char)
        elif char.isprintable():
            escaped.append(char)
        else:
            escaped.append(f"\\U{ord(char):08X}")
    return f'"{"".join(escaped)}"'


def markdown(text: str) -> str:
    """Return a line of Markdown that shows the text as it is."""
    escaped = _MARKUP.sub(r"\\\1", text)
    mark = _AT_THE_START.match(escaped)
    if mark is None:
        return escaped
    number = mark[0] if mark[0].isdigit() else ""
    return f"{number}\\{escaped.removeprefix(number)}"


_VERSION = re.compile(r"([0-9]+)\.([0-9]+)")


def requirement(version: str) -> str:
    """Return what a package made by this version of stagewire depends on.

    Classes call functions of the runtime that made them; before 1.0 another minor version may have
    others, from then on only another major one.
    """
    found = _VERSION.match(version)
    if found is None:
        raise ValueError(f"{version} is no version")
    major, minor = int(found[1]), int(found[2])
    following = f"{major + 1}" if major else f"0.{minor + 1}"
    return f"stagewire>={major}.{minor},<{following}"


@dataclass(frozen=True, slots=True)
class ProjectView:
    """The project of one package."""

    name: str  # of the distribution
    package: str
    protocol: str
    requirement: str
    version: str  # as a text of TOML
    description: str
    title: str  # as Markdown
    summary: str
    document: str
    show: str  # commands to try; empty where there is no message to try them with
    encode: str
    decode: str
    in_c: bool  # whether there is a C package, too


def project_view(protocol: Protocol) -> ProjectView:
    """Make the view of a project."""
    document = protocol.document
    tried = _tried(protocol)
    encode = _encode(protocol, *tried) if tried else ""
    ours = f"--protocol {protocol.name}"
    options = [ours, *filter(None, [rules_of(protocol.framing["kind"]).decode])]
    return ProjectView(
        name=protocol.package.replace("_", "-"),
        package=protocol.package,
        protocol=protocol.name,
        requirement=requirement(metadata.version("stagewire")),
        version=toml(protocol.version),
        description=toml(f"{_plain(protocol.title)}: messages, made by stagewire"),
        title=markdown(_plain(protocol.title)),
        summary=markdown(_plain(protocol.summary)),
        document=markdown(
            f"{_plain(document['title'])}, issue {document['issue']} of {document['date']}"
        ),
        show=f"stagewire show {tried[0].name} {ours}" if tried else "",
        encode=encode,
        decode=" ".join([encode, "| stagewire decode -", *options]),
        in_c=bool(FRAMINGS[protocol.framing["kind"]].c),
    )


def _plain(text: str) -> str:
    return " ".join(text.split())


def _tried(protocol: Protocol) -> tuple[Message, Layout] | None:
    """Return what is the simplest to send: a message to the controller with few fields, but some."""
    candidates = [
        (message, layout)
        for message in protocol.messages
        for layout in message.layouts
        if message.id is not None and message.kind != "setup" and layout.form != "reply"
        if message.direction != "to_host" and not message.dummy and not layout.when
    ]
    return min(candidates, key=lambda pair: len(_given(pair[1])) or 100, default=None)


def _given(layout: Layout) -> list[Field]:
    """Return the fields that have to be given."""
    return [field for field in layout.all_fields if field.role == "value"]


def _encode(protocol: Protocol, message: Message, layout: Layout) -> str:
    words = ["stagewire encode", message.name]
    if len(message.layouts) > 1:
        words.append(f"--form {layout.form}")
    for key, option in rules_of(protocol.framing["kind"]).encode:
        words += _option(protocol, key, option)
    words += [f"{field.name}={_value(field)}" for field in _given(layout)]
    return " ".join([*words, f"--protocol {protocol.name}"])


def _value(field: Field) -> str:
    """Return a value that the field takes, as the command reads it."""
    if field.format.kind == "bytes":
        return "00" * field.format.size
    if field.format.kind == "text":
        return "A"
    if field.enum and (names := _names(field)):
        return names[0]
    if field.default is not None:
        return str(field.default)
    return str(min(max(field.minimum, 1), field.maximum))


def _names(field: Field) -> list[str]:
    """Return the names of values that the field takes."""
    assert field.enum
    return [v.name for v in field.enum.values if field.minimum <= v.value <= field.maximum]


def _option(protocol: Protocol, key: str, option: str) -> list[str]:
    """Return an option of ``stagewire encode`` with the first name of what a key of the framing names."""
    if key not in protocol.framing:
        return []
    tables = (e for e in protocol.enumerations if e.name == protocol.framing[key])
    return [f"{option} {next((table.values[0].name for table in tables), 1)}"]
