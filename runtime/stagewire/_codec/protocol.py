"""One protocol: its messages by name, what its registry says, and which protocols are installed.

A generated package makes one :class:`Protocol` of its framing and names it under the entry point group
``stagewire.protocols``; whatever works for all protocols finds it there.
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

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints
    from typing import Any


_ENTRY_POINTS = "stagewire.protocols"


class Protocol:
    """Base of all protocols: what holds however its bytes are framed.

    :param name: name in the registry, such as ``thorlabs_apt``.
    :param title: for people.
    :param package: the generated package; it holds ``registry.json`` and ``vectors.json``.
    :param messages: every message class.
    :param nameless: messages that the document names without an id, and why they cannot be used.
    """

    def __init__(
        self,
        name: str,
        title: str,
        package: str,
        messages: Iterable[type[Message]],
        nameless: Mapping[str, str],
    ) -> None:
        self.name = name
        self.title = title
        self.package = package
        self.messages: tuple[type[Message], ...] = tuple(messages)
        self.nameless = dict(nameless)
        self._loaded: dict[str, dict[str, Any]] = {}  # files of the package that were asked for
        self._by_name: dict[str, dict[str, type[Message]]] = {}
        for cls in self.messages:
            self._by_name.setdefault(cls.layout.message, {})[cls.layout.form] = cls

    def __repr__(self) -> str:
        return f"<Protocol {self.name}: {len(self._by_name)} messages>"

    # By name

    def message_class(self, message: str, form: str | None = None) -> type[Message]:
        """Return the class of a message by its name in the registry and, if it has several, its form.

        Raises :class:`~stagewire.errors.UnknownMessageError`,
        :class:`~stagewire.errors.UnsupportedError` for a message without an id, and
        :class:`~stagewire.errors.BadLengthError` for a form that the message does not have.
        """
        forms = self._by_name.get(message)
        if forms is None:
            if message in self.nameless:
                raise UnsupportedError(f"{message} cannot be used: {self.nameless[message]}")
            raise UnknownMessageError(f"{self.title} has no message {message}{self._like(message)}")
        if form is None:
            certain = self._certain(forms)
            if len(certain) == 1:
                return forms[certain[0]]
            raise BadLengthError(f"{message} has several forms; give one of {', '.join(certain)}")
        if form not in forms:
            raise BadLengthError(f"{message} has no form {form} (it has {', '.join(forms)})")
        return forms[form]

    def _certain(self, forms: Iterable[str]) -> list[str]:
        """Return the forms that may be meant when none is named."""
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
        """Make a message from its name and a mapping of fields; all are checked.

        Raises what :meth:`message_class` raises, and an :class:`~stagewire.errors.EncodeError`:
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

    # What the registry says

    def registry(self) -> dict[str, Any]:
        """Return the resolved registry: messages, units, stages, errata (see the JSON Schema).

        It is read once and shared: not to be modified.
        """
        return self._json("registry.json")

    def vectors(self) -> dict[str, Any]:
        """Return the worked examples and captures of the registry, with their verdicts.

        They are read once and shared: not to be modified.
        """
        return self._json("vectors.json")

    def _json(self, name: str) -> dict[str, Any]:
        if name not in self._loaded:
            self._loaded[name] = _load_json(self.package, name)
        return self._loaded[name]


def check_fields(layout: Layout, fields: Iterable[str], allowed: Collection[str]) -> None:
    """Raise :class:`~stagewire.errors.UnknownFieldError` for a name that no field has."""
    for name in fields:
        if name not in allowed:
            known = ", ".join(layout.fields) or "no fields"
            raise UnknownFieldError(
                f"{layout.message} ({layout.form}) has no field {name}: {known}"
            )


def as_bytes(raw: object) -> bytes:
    """Return what is to be decoded as bytes; raise :class:`BadValueError` for what is none."""
    if isinstance(raw, (bytes, bytearray, memoryview)):
        return bytes(raw)
    hint = "; bytes.fromhex makes bytes of hex text" if isinstance(raw, str) else ""
    raise BadValueError(f"decode takes bytes, not {type(raw).__name__}{hint}")


def _load_json(package: str, name: str) -> dict[str, Any]:
    import json  # both are slow to import, and most users never ask
    from importlib import resources

    text = resources.files(package).joinpath(name).read_text(encoding="utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def available_protocols() -> list[str]:
    """Return the names of all protocols that are installed, ours and others'."""
    return sorted({entry.name for entry in _entry_points()})


def load_protocol(name: str) -> Protocol:
    """Return an installed protocol.

    Raises :class:`~stagewire.errors.UnknownProtocolError` when there is none of that name, and
    :class:`~stagewire.errors.UnusableProtocolError` when two packages bring it, or when the one that
    does cannot be imported or has no protocol in it.
    """
    entries = {entry.value: entry for entry in _entry_points() if entry.name == name}
    if not entries:
        raise UnknownProtocolError(
            f"no protocol {name} is installed (there are: {', '.join(available_protocols())})"
        )
    first, *others = (entries[value] for value in sorted(entries))
    if others:  # whichever was taken, somebody would decode by the wrong one
        raise UnusableProtocolError(
            f"the protocol {name} is brought by {' and by '.join(map(_brought, (first, *others)))}; "
            "uninstall all but one"
        )
    try:
        protocol = first.load()
    except Exception as error:  # it is somebody else's code, made for some version of this
        raise _unusable(name, first, f"cannot be imported: {error}") from error
    if not isinstance(protocol, Protocol):
        kind = type(protocol).__name__
        raise _unusable(
            name, first, f"has no protocol under {first.attr}, but a value of type {kind}"
        )
    return protocol


def usable_protocols() -> Iterator[Protocol]:
    """Yield the protocols that are installed and can be used."""
    for name in available_protocols():
        try:
            yield load_protocol(name)
        except UnusableProtocolError:  # somebody else's package; the others go on working
            continue


def _unusable(name: str, entry: EntryPoint, why: str) -> UnusableProtocolError:
    return UnusableProtocolError(
        f"the protocol {name} is brought by {_brought(entry)}, which {why}; "
        "make it again with the stagewire that is installed, or uninstall it"
    )


def _brought(entry: EntryPoint) -> str:
    """Return which package an entry point names, and which distribution it came with."""
    distribution = f" (installed as {entry.dist.name})" if entry.dist else ""
    return f"the package {entry.module}{distribution}"


def _entry_points() -> EntryPoints:
    from importlib import metadata  # slow to import, and most users never ask

    return metadata.entry_points(group=_ENTRY_POINTS)
