"""What a C package looks like by the framing of its protocol: its messages, its own files, its tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from stagewire_generator.framing import part
from stagewire_generator.model import Json, Message, Protocol
from stagewire_generator.targets.vectors.subject import Subject


@dataclass(frozen=True, slots=True)
class File:
    """A file of a package.

    :param path: below the folder of the package.
    :param template: by which it is made; it is given the view of the package as ``package``.
    :param view: what else it is given, as ``view``: makes it from the protocol.
    :param included: whether the umbrella includes it.
    """

    path: str
    template: str
    view: Callable[[Protocol], Any] = lambda _: None
    included: bool = False


@dataclass(frozen=True, slots=True)
class Tests:
    """What the tests in C have to know of a framing.

    :param calls: the template with what stands between a layout and its functions.
    :param cut: the template with what cuts a stream into events.
    :param trip: the template of the round trip of one layout.
    :param trip_needs: the template of what these have in common.
    :param data_at: where in the bytes of a layout its data begins.
    :param meant: the layouts, side by side, that bytes could be meant for; all where nothing is.
    :param form: the form of the layout that an object of the testee protocol is about.
    :param envelope: members of the envelope beside addresses and extra bytes.
    :param damaged: the refusal of what was damaged on the way, where a decoder can tell.
    :param round_trip: what the round trips have to know of the protocol, as arguments of their view.
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


@dataclass(frozen=True, slots=True)
class Framing:
    """What differs between packages by their framing.

    :param message: the template of the part of a chapter that is a message; it is given ``message``.
    :param message_view: makes the view for it.
    :param testee: the template of the package's part of the testee.
    :param files: what there is beside enumerations, flags and chapters. ``{package}`` in a path is the
        name of the package.
    :param tests: what the tests have to know.
    """

    message: str
    message_view: Callable[[Protocol, Message], Any]
    testee: str
    files: tuple[File, ...]
    tests: Tests


def framing_of(protocol: Protocol) -> Framing:
    """Return what the framing of a protocol makes of its package."""
    framing: Framing = part(protocol.framing["kind"], "c")
    return framing
