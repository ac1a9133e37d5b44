"""Framings: a row for each kind of ``framing.kind`` in ``protocol.yaml``, and the folder that it leads to.

A folder of ``framings/`` holds everything that the generator knows of one framing, and its templates. No
other module asks which kind a framing is: it asks the table for the part that it needs. The parts are named
by strings, and imported when they are first used, because a folder imports the steps that ask for its parts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any, Final

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import Document

FOLDER: Final = "stagewire_generator.framings"


@dataclass(frozen=True, slots=True)
class Parts:
    """Where the parts of a framing are: ``module:name`` below ``framings/``; empty where it has none.

    :param rules: its :class:`Rules`.
    :param witness: a ``Witness`` of ``lint/witness/``: how a document of such a protocol is compared.
    :param python: a ``Framing`` of ``targets/python/``: classes of messages, and the protocol object.
    :param vectors: a subclass of ``Framing`` of ``targets/vectors/``: frames, made without the runtime.
    :param devices: a ``DeviceFraming`` of ``targets/python/devices/``: without it, no device classes.
    :param c: a ``Framing`` of ``targets/c/``: without it, no C package.
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


@dataclass(frozen=True, slots=True)
class Rules:
    """What a framing demands of a spec, and what reading and checking one must know of it.

    :param check: checks the entry ``framing``, and what it asks of the messages; it is given the file of the
        protocol, for the places of what is wrong in it.
    :param kinds: the kinds of message that it carries: ``message``, ``command``, ``setup``.
    :param keys: paths below ``framing`` of plain values. With the three below they are all that it may hold.
    :param lists: paths of lists whose order is a fact.
    :param formats: keys of entries that name a format; the resolver adds its ``size``.
    :param enumerations: keys that name an enumeration.
    :param id_size: bytes of an id; 0 where ``id`` in ``formats`` says it.
    :param has_parameters: whether a message without a packet has two bytes for parameters.
    :param reports_faults: whether a message may report a fault at any time.
    :param polls: whether a host asks for the end of a motion, as no message tells it.
    :param same_length: the cure for layouts of equal length, where no context can decide.
    :param encode: key of the framing -> option of ``stagewire encode`` that an encoder needs for it.
    :param decode: options of ``stagewire decode`` for a frame that goes to a controller.
    """

    check: Callable[[Protocol, Document, Diagnostics], None]
    kinds: tuple[str, ...]
    keys: tuple[str, ...] = ()
    lists: tuple[str, ...] = ()
    formats: tuple[str, ...] = ()
    enumerations: tuple[str, ...] = ()
    id_size: int = 0
    has_parameters: bool = False
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
    """Return a part of a framing, named as in :class:`Parts`; None where it has none."""
    module, _, attribute = getattr(FRAMINGS[kind], name).partition(":")
    return getattr(import_module(f"{FOLDER}.{module}"), attribute) if module else None
