"""Worked examples that are frames: stated values to bytes and bytes to stated values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stagewire.errors import CodecError
from stagewire.protocol import Protocol
from stagewire_conformance.answers import frame_answer
from stagewire_conformance.codec import encode_frame
from stagewire_conformance.hexes import spaced
from stagewire_conformance.registry import registry_of
from stagewire_conformance.verdict import Findings

__all__ = ["check_capture", "check_frame"]

Json = dict[str, Any]

_WANTED = ("message", "form", "dest", "source", "fields", "extra", "data", "context")
_ABSENT = object()


def check_frame(protocol: Protocol, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check a worked example in both directions, as its verdict demands."""
    wanted = _wanted(protocol, entry)
    printed = bytes.fromhex(entry["printed"])
    if entry["verdict"] == "erratum":
        _erratum(protocol, entry, wanted, printed, findings)
    else:
        _reproduced(protocol, wanted, printed, "printed", findings)


def check_capture(protocol: Protocol, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check a frame that somebody sent or published."""
    printed = bytes.fromhex(entry["printed"])
    if entry["verdict"] != "rejected":
        _reproduced(protocol, _wanted(protocol, entry), printed, "captured", findings)
        return
    _rejected(protocol, printed, entry["rejected"], findings)
    if "fields" in entry:
        raw = _encode(protocol, _wanted(protocol, entry), findings)
        if raw is not None and findings.expect(
            raw != printed, "unexpected pass: it can be encoded"
        ):
            findings.notes.append(f"should be {spaced(raw)}")


def _reproduced(
    protocol: Protocol, wanted: Json, raw: bytes, origin: str, findings: Findings
) -> None:
    made = _encode(protocol, wanted, findings)
    if made is not None:
        findings.expect(
            made == raw, f"the stated values give {spaced(made)}, {origin} is {spaced(raw)}"
        )
    _decodes(protocol, raw, wanted, f"{origin} bytes", findings)


def _erratum(
    protocol: Protocol,
    entry: Mapping[str, Any],
    wanted: Json,
    printed: bytes,
    findings: Findings,
) -> None:
    findings.expect(bool(entry.get("errata")), "an erratum without the name of one")
    if entry.get("encoded") is None:
        findings.problems.append("`encoded` does not say what the stated values give")
        return
    encoded = bytes.fromhex(entry["encoded"])
    if findings.expect(
        encoded != printed, "unexpected pass: the printed bytes are those of the stated values"
    ):
        _reproduced(protocol, wanted, encoded, "`encoded`", findings)
    truth = entry.get("printed_is", {})
    if "rejected" in truth:
        _rejected(protocol, printed, truth["rejected"], findings)
    elif findings.expect("decodes" in truth, "`printed_is` does not say what the bytes are"):
        said = _wanted(
            protocol, {**{key: entry[key] for key in ("message", "form")}, **truth["decodes"]}
        )
        _decodes(protocol, printed, said, "printed bytes", findings)


def _rejected(protocol: Protocol, raw: bytes, code: str, findings: Findings) -> None:
    try:
        frame = protocol.decode(raw)
    except CodecError as error:
        findings.expect(error.code == code, f"refused as {error.code}, not as {code}: {error}")
        findings.notes.append(f"{error.code}: {error}")
    else:
        name = frame.message.layout.message
        findings.problems.append(f"unexpected pass: decodes as {name}, expected {code}")


def _encode(protocol: Protocol, wanted: Json, findings: Findings) -> bytes | None:
    try:
        return encode_frame(protocol, wanted).encode()
    except (CodecError, ValueError) as error:
        findings.problems.append(f"the stated values do not encode: {error}")
        return None


def _decodes(protocol: Protocol, raw: bytes, wanted: Json, what: str, findings: Findings) -> None:
    """Expect that ``raw`` decodes to what is wanted, and says nothing beyond it."""
    try:
        cls = protocol.message_class(wanted["message"], wanted.get("form"))
        context = wanted.get("context") or dict(cls.layout.when) or None
        answer = frame_answer(protocol.decode(raw, context))
    except CodecError as error:
        findings.problems.append(f"the {what} do not decode: {error}")
        return
    for key in ("message", "form", "dest", "source"):
        if key in wanted:
            findings.expect(
                answer[key] == wanted[key],
                f"the {what} say {key} {answer[key]}, expected {wanted[key]}",
            )
    findings.expect(
        answer.get("extra", "") == _hex(wanted.get("extra", "")),
        f"the {what} have extra bytes {answer.get('extra', '(none)')}",
    )
    if "data" in wanted:
        findings.expect(
            answer.get("data") == wanted["data"], f"the {what} have the packet {answer.get('data')}"
        )
    stated = wanted.get("fields", {})
    for name, value in stated.items():
        got = answer["fields"].get(name, 0 if name in ("param1", "param2") else _ABSENT)
        if got is _ABSENT:
            findings.problems.append(f"{answer['message']} has no field {name}")
        else:
            findings.expect(got == value, f"the {what} say {name} {got}, expected {value}")
    for name, value in answer["fields"].items():
        silent = cls.layout.constants.get(name, 0)
        empty = not value.strip("0") if isinstance(value, str) else value == silent
        if name not in stated and not (empty and name in cls.layout.optional):
            findings.problems.append(f"the {what} say {name} {value}, which is not stated")


def _wanted(protocol: Protocol, entry: Mapping[str, Any]) -> Json:
    """Return what an example says, with hex as the testee protocol writes it."""
    wanted = {key: entry[key] for key in _WANTED if entry.get(key) is not None}
    for key in ("extra", "data"):
        if key in wanted:
            wanted[key] = _hex(wanted[key])
    known = registry_of(protocol).fields(wanted.get("message", ""), wanted.get("form", ""))
    wanted["fields"] = {
        name: _hex(value) if known.get(name, {}).get("kind") == "bytes" else value
        for name, value in wanted.get("fields", {}).items()
    }
    return wanted


def _hex(text: str) -> str:
    return text.replace(" ", "").lower()
