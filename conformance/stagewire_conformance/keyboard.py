"""Worked examples at a terminal: what is typed for a command, and what a reply looks like.

A key is written as the document does: ``Ctrl<X>`` with Ctrl held down, ``Alt[255]`` for a decimal number,
``ESC``, ``'A'`` or the character alone. Blanks between keys only divide.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stagewire.errors import CodecError
from stagewire.protocols import Protocol
from stagewire_conformance.frames import check_reproduced, wanted_of
from stagewire_conformance.framings import codec_of
from stagewire_conformance.notation import octets, spaced
from stagewire_conformance.registry import Registry, registry_of
from stagewire_conformance.verdict import Findings

_KEY = re.compile(r"(?P<blank>\s+)|Ctrl<(?P<ctrl>[@-_])>|Alt\[(?P<alt>\d{1,4})\]|(?P<esc>ESC)"
                  r"|'(?P<quoted>.)'|(?P<char>.)")  # fmt: skip
_ESCAPE = 0x1B
_UNREADABLE = "_"


@dataclass(frozen=True, slots=True)
class Key:
    """One key that is pressed: the byte that it sends, and its one spelling."""

    byte: int
    spelling: str


def key_of(byte: int) -> Key:
    """Return the key that sends a byte."""
    if byte == _ESCAPE:
        return Key(byte, "ESC")
    if byte < 0x20:
        return Key(byte, f"Ctrl<{chr(byte | 0x40)}>")
    # a blank only divides, so that its key is written as a number
    return Key(byte, chr(byte) if 0x20 < byte < 0x7F else f"Alt[{byte}]")


def keys_of(text: str) -> list[Key]:
    """Return the keys of a text, in any spelling.

    Raises :class:`ValueError` for a key that sends no byte.
    """
    return [key_of(_byte(match)) for match in _KEY.finditer(text) if not match["blank"]]


def _byte(match: re.Match[str]) -> int:
    if match["esc"]:
        return _ESCAPE
    if match["ctrl"]:
        return ord(match["ctrl"]) & 0x1F
    byte = int(match["alt"]) if match["alt"] else ord(match["quoted"] or match["char"])
    if byte > 0xFF:
        raise ValueError(f"{match[0]} is the key of no byte")
    return byte


def shown_as(raw: bytes, code_page: str) -> str:
    """Return what a terminal with this character set shows; ``_`` for what nobody can read."""
    text = raw.decode(code_page, errors="replace").replace("\N{REPLACEMENT CHARACTER}", "\0")
    return "".join(char if char.isprintable() else _UNREADABLE for char in text)


def check_keyboard(protocol: Protocol, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check what is typed or shown in both directions, as the verdict demands."""
    if "message" not in entry:
        _axis(protocol, entry, findings)
        return
    wanted = wanted_of(protocol, entry)
    try:
        raw = codec_of(protocol).encode(wanted)
    except CodecError as error:
        findings.problems.append(f"the stated values do not encode: {error}")
        return
    if "typed" in entry:
        _typed(protocol, entry, raw, findings)
    else:
        _shown(protocol, entry, raw, findings)


def _axis(protocol: Protocol, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check the key of an axis identifier: its byte, and what the registry has for it."""
    keys = _keys(entry["typed"], findings)
    raw = bytes(key.byte for key in keys)
    said = octets(entry, "encoded" if entry["verdict"] == "erratum" else "printed")
    findings.expect(raw == said, f"{entry['typed']} sends {spaced(raw)}, not {spaced(said)}")
    findings.expect(raw == bytes((entry["axis"],)), f"{spaced(raw)} is not axis {entry['axis']}")
    if entry["verdict"] == "erratum":
        findings.expect(octets(entry, "printed") != said, "unexpected pass: printed is right")
    known = _keyboard_of_axis(registry_of(protocol), entry["axis"])
    if findings.expect(known != "", f"the registry has no key for the axis {entry['axis']}"):
        _same(keys, _keys(known, findings), findings)


def _typed(protocol: Protocol, entry: Mapping[str, Any], raw: bytes, findings: Findings) -> None:
    """Check a typed command: its keys send the bytes, and are those that the registry gives."""
    text = _truth(entry, "typed", findings)
    keys = _keys(text, findings)
    check_reproduced(
        protocol, wanted_of(protocol, entry), bytes(key.byte for key in keys), "typed", findings
    )
    _same(keys, _known(registry_of(protocol), entry, raw, findings), findings)
    if "corrected" in entry:
        sent = bytes(key.byte for key in _keys(entry["typed"], findings))
        findings.expect(sent != raw, "unexpected pass: what is printed sends the command")


def _shown(protocol: Protocol, entry: Mapping[str, Any], raw: bytes, findings: Findings) -> None:
    """Check what a terminal shows of a reply; where all of it can be read, also back to bytes."""
    text = _truth(entry, "shown", findings)
    code_page = entry.get("code_page", "ascii")
    seen = shown_as(raw, code_page)
    findings.expect(seen == text, f"a terminal shows {seen!r}, not {text!r}")
    if "corrected" in entry:
        findings.expect(seen != entry["shown"], "unexpected pass: a terminal shows just that")
    if _UNREADABLE not in text:
        read = text.encode(code_page, errors="replace")
        check_reproduced(protocol, wanted_of(protocol, entry), read, "shown", findings)


def _truth(entry: Mapping[str, Any], key: str, findings: Findings) -> str:
    """Return the text that has to be right: as printed, or corrected where that is an erratum."""
    if entry["verdict"] != "erratum":
        return str(entry[key])
    findings.expect(bool(entry.get("errata")), "an erratum without the name of one")
    findings.expect("corrected" in entry, "`corrected` does not say what it should be")
    return str(entry.get("corrected", entry[key]))


def _keys(text: str, findings: Findings) -> list[Key]:
    try:
        return keys_of(text)
    except ValueError as error:
        findings.problems.append(str(error))
        return []


def _known(
    registry: Registry, entry: Mapping[str, Any], raw: bytes, findings: Findings
) -> list[Key]:
    """Return the keys of a command: its axis and its byte as the registry has them, then the rest."""
    stated = {1: registry.messages[entry["message"]]["keyboard"]}
    if "axis" in entry:
        stated[0] = _keyboard_of_axis(registry, entry["axis"])
    keys: list[Key] = []
    for place, byte in enumerate(raw):
        keys += _keys(stated.get(place, ""), findings) or [key_of(byte)]
    return keys


def _keyboard_of_axis(registry: Registry, axis: int) -> str:
    """Return what the registry has for an axis identifier; empty where it has nothing."""
    found = (entry for entry in registry.axes.values() if entry["value"] == axis)
    return str(next(found, {}).get("keyboard", ""))


def _same(keys: list[Key], known: list[Key], findings: Findings) -> None:
    typed, right = (" ".join(key.spelling for key in line) for line in (keys, known))
    findings.expect(keys == known, f"typed is {typed}, the registry has {right}")
