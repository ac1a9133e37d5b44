"""Parts of a C package that depend on the framing: its messages, some of its files, its tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from stagewire_generator.framing import part
from stagewire_generator.model import Json, Message, Protocol
from stagewire_generator.targets.vectors.subject import Subject


class File(NamedTuple):
    """A file of a package.

    :param path: relative to the directory of the package.
    :param template: its template, rendered with the view of the package as ``package``.
    :param view: makes a second view from the protocol, passed to the template as ``view``.
    :param included: whether the umbrella header includes it.
    """

    path: str
    template: str
    view: Callable[[Protocol], Any] = lambda _: None
    included: bool = False


class Tests(NamedTuple):
    """Parts of the C tests that depend on the framing.

    :param calls: template of the adapters between a layout and its functions.
    :param cut: template of the function that cuts a stream into events.
    :param trip: template of the round trip of one layout.
    :param trip_needs: template of the macros that round trips share.
    :param data_at: returns the offset of the data in the bytes of a layout.
    :param meant: returns the adjacent layouts that the bytes may belong to; all layouts if unknown.
    :param form: returns the form of the layout that an object of the testee protocol refers to.
    :param envelope: returns the members of the envelope besides addresses and extra bytes.
    :param damaged: refusal code for damaged bytes; empty if the decoder cannot detect damage.
    :param round_trip: returns further arguments for the view of the round trips.
    """

    calls: str
    cut: str
    trip: str
    trip_needs: str
    data_at: Callable[[Protocol, Subject], int]
    meant: Callable[[Protocol, tuple[Subject, ...], bytes, Json], Sequence[Subject]]
    form: Callable[[Json], str] = lambda said: str(said.get("form", ""))
    envelope: Callable[[Subject, Json], list[str]] = lambda of, said: []
    damaged: str = ""
    round_trip: Callable[[Protocol], dict[str, Any]] = lambda _: {}


class Framing(NamedTuple):
    """Parts of packages that depend on the framing.

    :param message: template of a message in a chapter.
    :param message_view: makes its view.
    :param testee: template of the package's part of the testee.
    :param files: files besides enumerations, flags and chapters. ``{package}`` in a path is the name of
        the package.
    :param tests: the parts of the tests.
    """

    message: str
    message_view: Callable[[Protocol, Message], Any]
    testee: str
    files: tuple[File, ...]
    tests: Tests


def framing_of(protocol: Protocol) -> Framing:
    """Return the :class:`Framing` of a protocol."""
    framing: Framing = part(protocol.framing["kind"], "c")
    return framing
