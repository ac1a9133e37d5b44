"""The base of protocols: messages by name, the registry, and the installed protocols.

A generated package makes one :class:`Protocol` object of its framing and registers it under the entry point
group ``stagewire.protocols``. Tools that work with all protocols find it there.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping

from stagewire._codec.message import Layout, Message
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    MissingFieldError,
    UnknownFieldError,
    UnknownMessageError,
    UnknownProtocolError,
    UnsupportedError,
    UnusableProtocolError,
)

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints
    from typing import Any


_NO_ALIASES: Mapping[str, str] = {}
_ENTRY_POINTS = "stagewire.protocols"


class Protocol:
    """Base of all protocols, independent of the framing.

    :param name: name in the registry, such as ``thorlabs_apt``.
    :param title: name for people.
    :param package: the generated package; it holds ``registry.json`` and ``vectors.json``.
    :param messages: all message classes.
    :param nameless: messages that the document names without an id -> why they cannot be used.
    :param aliases: other names of messages -> their names.
    """

    def __init__(
        self,
        name: str,
        title: str,
        package: str,
        messages: Iterable[type[Message]],
        nameless: Mapping[str, str],
        aliases: Mapping[str, str] = _NO_ALIASES,
    ) -> None:
        self.name = name
        self.title = title
        self.package = package
        self.messages: tuple[type[Message], ...] = tuple(messages)
        self.nameless = dict(nameless)
        self.aliases = aliases
        self._loaded: dict[str, dict[str, Any]] = {}  # files of the package that were read
        self._by_name: dict[str, dict[str, type[Message]]] = {}
        self._described: dict[tuple[str, str, str], tuple[str, str]] = {}
        for cls in self.messages:
            cls.layout.describe = self.described
            self._by_name.setdefault(cls.layout.message, {})[cls.layout.form] = cls

    def __repr__(self) -> str:
        return f"<Protocol {self.name}: {len(self._by_name)} messages>"

    # By name

    def message_class(self, message: str, form: str | None = None) -> type[Message]:
        """Return the class of a message by its registry name or alias and, if it has several forms, its form.

        Raises :class:`~stagewire.errors.UnknownMessageError`,
        :class:`~stagewire.errors.UnsupportedError` for a message without an id, and
        :class:`~stagewire.errors.BadLengthError` for an unknown form.
        """
        forms = self._by_name.get(self.aliases.get(message, message))
        if forms is None:
            if message in self.nameless:
                raise UnsupportedError(f"{message} cannot be used: {self.nameless[message]}")
            raise UnknownMessageError(f"{self.title} has no message {message}{self._like(message)}")
        if form is None:
            certain = self._certain(forms)
            if len(certain) == 1:
                return forms[certain[0]]
            raise BadLengthError(f"{message} has several forms; choose one of {', '.join(certain)}")
        if form not in forms:
            raise BadLengthError(f"{message} has no form {form} (it has {', '.join(forms)})")
        return forms[form]

    def _certain(self, forms: Iterable[str]) -> list[str]:
        """Return the forms to choose from if the caller names none."""
        return list(forms)

    def _like(self, message: str) -> str:
        import difflib

        close = difflib.get_close_matches(message.upper()[:80], self._by_name, n=3)
        return f"; did you mean {' or '.join(close)}?" if close else ""

    def build(
        self,
        message: str,
        fields: Mapping[str, Any],
        form: str | None = None,
    ) -> Message:
        """Return a message by its name, with these fields. All fields are checked.

        Raises the errors of :meth:`message_class`, and an :class:`~stagewire.errors.EncodeError`:
        :class:`~stagewire.errors.UnknownFieldError`, :class:`~stagewire.errors.MissingFieldError`,
        :class:`~stagewire.errors.OutOfRangeError` or :class:`~stagewire.errors.BadValueError`.
        """
        cls = self.message_class(message, form)
        layout = cls.layout
        check_fields(layout, fields, layout.fields)
        missing = [f for f in layout.fields if f not in fields and f not in layout.optional]
        if missing:
            raise MissingFieldError(f"{message} ({layout.form}) lacks {', '.join(missing)}")
        made: Message = cls(**fields)
        return made

    # Registry

    def registry(self) -> dict[str, Any]:
        """Return the resolved registry: messages, units, stages, errata (see the JSON Schema).

        It is read once and shared. Do not modify it.
        """
        return self._json("registry.json")

    def vectors(self) -> dict[str, Any]:
        """Return the worked examples and captures of the registry, with their verdicts.

        They are read once and shared. Do not modify them.
        """
        return self._json("vectors.json")

    def described(self, layout: Layout, field: str) -> tuple[str, str]:
        """Return the unit of a field and the place that describes it; both are empty if unknown.

        The place is a page or a section, with the document if there are several: ``page 58 of Issue 37``. If
        a later document also describes the message, the place names both.
        """
        if not self._described:
            self._described = dict(self._describe())
        return self._described.get((layout.message, layout.form, field), ("", ""))

    def _describe(self) -> Iterator[tuple[tuple[str, str, str], tuple[str, str]]]:
        """Yield message, form and field -> its unit and its place."""
        try:
            registry = self.registry()
        except (ImportError, OSError, ValueError):
            return  # a protocol that is not a package has no registry
        sections = registry["document"].get("sections")
        overlays = registry["document"].get("overlays", ())
        documents = {overlay["name"]: overlay["document"]["name"] for overlay in overlays}
        for message in registry["messages"]:
            later = "".join(
                f" and page {page} of {documents[overlay]}"
                for overlay, page in message.get("later_pages", {}).items()
            )
            for layout in message["layouts"]:
                fields = [layout.get("param1"), layout.get("param2"), *layout["fields"]]
                for field in filter(None, fields):
                    place = f"page {field['page']}"
                    if sections and not field.get("overlay", message.get("overlay")):
                        place = f"section {sections[field['page'] - 1]}"
                    if "document" in field:
                        place += f" of {field['document']}"
                    if "overlay" not in field:
                        place += later
                    key = message["name"], layout["form"], field["name"]
                    yield key, (field.get("unit") or "", place)

    def _json(self, name: str) -> dict[str, Any]:
        if name not in self._loaded:
            self._loaded[name] = _load_json(self.package, name)
        return self._loaded[name]


def check_fields(layout: Layout, fields: Iterable[str], allowed: Collection[str]) -> None:
    """Raise :class:`~stagewire.errors.UnknownFieldError` for the first name that is not a field."""
    for name in fields:
        if name not in allowed:
            known = ", ".join(layout.fields) or "no fields"
            raise UnknownFieldError(
                f"{layout.message} ({layout.form}) has no field {name}: {known}"
            )


def as_bytes(raw: object) -> bytes:
    """Return the bytes to decode as ``bytes``; raise :class:`BadValueError` if ``raw`` is not bytes."""
    if isinstance(raw, (bytes, bytearray, memoryview)):
        return bytes(raw)
    hint = "; use bytes.fromhex to convert hex text" if isinstance(raw, str) else ""
    raise BadValueError(f"decode takes bytes, not {type(raw).__name__}{hint}")


def _load_json(package: str, name: str) -> dict[str, Any]:
    import json  # both are slow to import and rarely needed
    from importlib import resources

    text = resources.files(package).joinpath(name).read_text(encoding="utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def available_protocols() -> list[str]:
    """Return the names of all installed protocols, including third-party ones."""
    return sorted({entry.name for entry in _entry_points()})


def load_protocol(name: str) -> Protocol:
    """Return an installed protocol.

    Raises :class:`~stagewire.errors.UnknownProtocolError` if no protocol has this name, and
    :class:`~stagewire.errors.UnusableProtocolError` if several packages provide it, or if the package cannot
    be imported or does not define the protocol.
    """
    entries = {entry.value: entry for entry in _entry_points() if entry.name == name}
    if not entries:
        raise UnknownProtocolError(
            f"no protocol {name} is installed (installed: {', '.join(available_protocols())})"
        )
    first, *others = (entries[value] for value in sorted(entries))
    if others:  # either choice would decode wrongly for some user
        raise UnusableProtocolError(
            f"protocol {name} is provided by {' and by '.join(map(_brought, (first, *others)))}; "
            "uninstall all but one"
        )
    try:
        protocol = first.load()
    except Exception as error:  # third-party code, generated for some other version
        raise _unusable(name, first, f"cannot be imported: {error}") from error
    if not isinstance(protocol, Protocol):
        kind = type(protocol).__name__
        raise _unusable(
            name, first, f"defines {first.attr}, but not as a protocol (its type is {kind})"
        )
    return protocol


def usable_protocols() -> Iterator[Protocol]:
    """Yield the installed protocols that can be used."""
    for name in available_protocols():
        try:
            yield load_protocol(name)
        except UnusableProtocolError:  # a third-party package; the others still work
            continue


def _unusable(name: str, entry: EntryPoint, why: str) -> UnusableProtocolError:
    return UnusableProtocolError(
        f"protocol {name} is provided by {_brought(entry)}, which {why}; "
        "generate it again with the installed stagewire, or uninstall it"
    )


def _brought(entry: EntryPoint) -> str:
    """Return the package of an entry point and the distribution that installed it."""
    distribution = f" (installed as {entry.dist.name})" if entry.dist else ""
    return f"the package {entry.module}{distribution}"


def _entry_points() -> EntryPoints:
    from importlib import metadata  # slow to import and rarely needed

    return metadata.entry_points(group=_ENTRY_POINTS)
