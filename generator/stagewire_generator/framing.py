"""The table of framings: one row for each value of ``framing.kind`` in ``protocol.yaml``.

Each directory in ``framings/`` holds all code and templates for one framing. No other module checks the kind
of a framing: it looks up the part that it needs in this table. The parts are named by strings and imported on
first use, because the directories import the modules that look up their parts.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any, Final, NamedTuple

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import Document

FOLDER: Final = "stagewire_generator.framings"


class Parts(NamedTuple):
    """The locations of the parts of a framing, as ``module:name`` below ``framings/``, or empty.

    :param rules: its :class:`Rules`.
    :param witness: a ``Witness`` from ``lint/witness/``, which compares a document of such a protocol.
    :param python: a ``Framing`` from ``targets/python/``, for the message classes and the protocol object.
    :param vectors: a subclass of ``Framing`` from ``targets/vectors/``, which builds frames without the
        runtime.
    :param devices: a ``DeviceFraming`` from ``targets/python/devices/``; if empty, there are no device
        classes.
    :param c: a ``Framing`` from ``targets/c/``; if empty, there is no C package.
    """

    rules: str
    witness: str
    python: str
    vectors: str
    devices: str = ""
    c: str = ""


FRAMINGS: Final[dict[str, Parts]] = {
    "header": Parts(
        rules="header.rules:RULES",
        witness="header.rules:WITNESS",
        python="header.python:FRAMING",
        vectors="header.vectors:HeaderFraming",
        devices="header.python:DEVICES",
        c="header.c:FRAMING",
    ),
    "slots": Parts(
        rules="slots.rules:RULES",
        witness="slots.witness:WITNESS",
        python="slots.python:FRAMING",
        vectors="slots.vectors:SlotsFraming",
        devices="slots.python:DEVICES",
        c="slots.c:FRAMING",
    ),
    "packet": Parts(
        rules="packet.rules:RULES",
        witness="packet.rules:WITNESS",
        python="packet.python:FRAMING",
        vectors="packet.vectors:PacketFraming",
        c="packet.c:FRAMING",
    ),
}


class Rules(NamedTuple):
    """The rules of a framing, for reading and checking a spec.

    :param check: checks the entry ``framing`` and its requirements for messages. It gets the file of the
        protocol, for the positions of errors.
    :param kinds: the supported kinds of messages: ``message``, ``command``, ``setup``.
    :param keys: paths of plain values below ``framing``. Only these and those of the next three parameters
        are allowed.
    :param lists: paths of lists whose order matters.
    :param formats: keys of entries that name a format; the resolver adds its ``size``.
    :param enumerations: keys that name an enumeration.
    :param id_size: number of bytes in an id; 0 if ``id`` in ``formats`` determines it.
    :param has_parameters: whether a message without a packet has two parameter bytes.
    :param has_sub_messages: whether several messages may share an id.
    :param has_arrays: whether a packet may end with an array whose length depends on its fields.
    :param reports_faults: whether a message may report a fault at any time.
    :param polls: whether a host has to poll for the end of a motion, because no message reports it.
    :param same_length: the hint for layouts of equal length if no context can distinguish them.
    :param encode: key of the framing -> option of ``stagewire encode`` that it requires.
    :param decode: options of ``stagewire decode`` for a frame to a controller.
    """

    check: Callable[[Protocol, Document, Diagnostics], None]
    kinds: tuple[str, ...]
    keys: tuple[str, ...] = ()
    lists: tuple[str, ...] = ()
    formats: tuple[str, ...] = ()
    enumerations: tuple[str, ...] = ()
    id_size: int = 0
    has_parameters: bool = False
    has_sub_messages: bool = False
    has_arrays: bool = False
    reports_faults: bool = False
    polls: bool = False
    same_length: str = ""
    encode: tuple[tuple[str, str], ...] = ()
    decode: str = ""


def rules_of(kind: str) -> Rules:
    """Return the rules of a kind of framing."""
    rules: Rules = part(kind, "rules")
    return rules


@cache
def part(kind: str, name: str) -> Any:
    """Return a part of a framing, named as in :class:`Parts`, or None if it does not have this part."""
    module, _, attribute = getattr(FRAMINGS[kind], name).partition(":")
    return getattr(import_module(f"{FOLDER}.{module}"), attribute) if module else None
