"""Worked examples at a terminal: the keys for a command, and the appearance of a reply.

A key is written as in the document: ``Ctrl<X>`` for X with Ctrl, ``Alt[255]`` for a decimal number, ``ESC``,
``'A'`` or the character alone. Blanks only separate keys.
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
    """A key press: the byte that it sends, and its canonical spelling."""

    byte: int
    spelling: str


def key_of(byte: int) -> Key:
    """Return the key that sends a byte."""
    if byte == _ESCAPE:
        return Key(byte, "ESC")
    if byte < 0x20:
        return Key(byte, f"Ctrl<{chr(byte | 0x40)}>")
    # blanks separate keys, so the space key is written as a number
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
        raise ValueError(f"the key {match[0]} does not send a byte")
    return byte


def shown_as(raw: bytes, code_page: str) -> str:
    """Return the text that a terminal with this code page shows; ``_`` replaces unreadable characters."""
    text = raw.decode(code_page, errors="replace").replace("\N{REPLACEMENT CHARACTER}", "\0")
    return "".join(char if char.isprintable() else _UNREADABLE for char in text)


def check_keyboard(protocol: Protocol, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check keys or displayed text in both directions, according to the verdict."""
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
    """Check the key of an axis identifier: its byte, and its entry in the registry."""
    keys = _keys(entry["typed"], findings)
    raw = bytes(key.byte for key in keys)
    said = octets(entry, "encoded" if entry["verdict"] == "erratum" else "printed")
    findings.expect(raw == said, f"{entry['typed']} sends {spaced(raw)}, not {spaced(said)}")
    findings.expect(raw == bytes((entry["axis"],)), f"{spaced(raw)} is not axis {entry['axis']}")
    if entry["verdict"] == "erratum":
        findings.expect(
            octets(entry, "printed") != said, "unexpected pass: the printed text is right"
        )
    known = _keyboard_of_axis(registry_of(protocol), entry["axis"])
    if findings.expect(known != "", f"the registry has no key for axis {entry['axis']}"):
        _same(keys, _keys(known, findings), findings)


def _typed(protocol: Protocol, entry: Mapping[str, Any], raw: bytes, findings: Findings) -> None:
    """Check that typed keys send the bytes of the command and match the registry."""
    text = _truth(entry, "typed", findings)
    keys = _keys(text, findings)
    check_reproduced(
        protocol, wanted_of(protocol, entry), bytes(key.byte for key in keys), "typed", findings
    )
    _same(keys, _known(registry_of(protocol), entry, raw, findings), findings)
    if "corrected" in entry:
        sent = bytes(key.byte for key in _keys(entry["typed"], findings))
        findings.expect(sent != raw, "unexpected pass: the printed keys send the command")


def _shown(protocol: Protocol, entry: Mapping[str, Any], raw: bytes, findings: Findings) -> None:
    """Check the displayed text of a reply. If all of it is readable, check that it converts back to bytes."""
    text = _truth(entry, "shown", findings)
    code_page = entry.get("code_page", "ascii")
    seen = shown_as(raw, code_page)
    findings.expect(seen == text, f"a terminal shows {seen!r}, not {text!r}")
    if "corrected" in entry:
        findings.expect(seen != entry["shown"], "unexpected pass: a terminal shows exactly this")
    if _UNREADABLE not in text:
        read = text.encode(code_page, errors="replace")
        check_reproduced(protocol, wanted_of(protocol, entry), read, "shown", findings)


def _truth(entry: Mapping[str, Any], key: str, findings: Findings) -> str:
    """Return the correct text: as printed, or as corrected if the text is an erratum."""
    if entry["verdict"] != "erratum":
        return str(entry[key])
    findings.expect(bool(entry.get("errata")), "the name of the erratum is missing")
    findings.expect("corrected" in entry, "`corrected` is missing")
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
    """Return the keys of a command: axis and command byte from the registry, then the rest."""
    stated = {1: registry.messages[entry["message"]]["keyboard"]}
    if "axis" in entry:
        stated[0] = _keyboard_of_axis(registry, entry["axis"])
    keys: list[Key] = []
    for place, byte in enumerate(raw):
        keys += _keys(stated.get(place, ""), findings) or [key_of(byte)]
    return keys


def _keyboard_of_axis(registry: Registry, axis: int) -> str:
    """Return the key for an axis identifier from the registry; empty if there is none."""
    found = (entry for entry in registry.axes.values() if entry["value"] == axis)
    return str(next(found, {}).get("keyboard", ""))


def _same(keys: list[Key], known: list[Key], findings: Findings) -> None:
    typed, right = (" ".join(key.spelling for key in line) for line in (keys, known))
    findings.expect(keys == known, f"the typed keys are {typed}, those of the registry {right}")
