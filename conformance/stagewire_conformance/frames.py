"""Worked examples with frames: stated values to bytes, and bytes to stated values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stagewire.errors import CodecError
from stagewire.protocols import Protocol
from stagewire_conformance.answers import ADDRESSES
from stagewire_conformance.framings import Codec, codec_of
from stagewire_conformance.notation import octets, spaced
from stagewire_conformance.registry import registry_of
from stagewire_conformance.verdict import Findings

Json = dict[str, Any]

_WANTED = ("message", "form", *ADDRESSES, "fields", "extra", "data", "context")
_ABSENT = object()


def check_frame(protocol: Protocol, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check a worked example in both directions, according to its verdict."""
    wanted = wanted_of(protocol, entry)
    printed = octets(entry, "printed")
    if entry["verdict"] == "erratum":
        _erratum(protocol, entry, wanted, printed, findings)
    else:
        check_reproduced(protocol, wanted, printed, "printed", findings)


def check_capture(protocol: Protocol, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check a frame that a third party sent or published."""
    printed = octets(entry, "printed")
    if entry["verdict"] == "tolerated":
        wanted, encoded = wanted_of(protocol, entry), octets(entry, "encoded")
        check_reproduced(protocol, wanted, encoded, "`encoded`", findings)
        _decodes(codec_of(protocol), printed, wanted, "captured bytes", findings)
        return
    if entry["verdict"] != "rejected":
        check_reproduced(protocol, wanted_of(protocol, entry), printed, "captured", findings)
        return
    codec, wanted = codec_of(protocol), wanted_of(protocol, entry)
    _rejected(codec, printed, wanted, entry["rejected"], findings)
    if "fields" in entry:
        raw = _encode(codec, wanted, findings)
        if raw is not None and findings.expect(
            raw != printed, "unexpected pass: the message can be encoded"
        ):
            findings.notes.append(f"should be {spaced(raw)}")


def check_reproduced(
    protocol: Protocol, wanted: Json, raw: bytes, origin: str, findings: Findings
) -> None:
    """Check that ``wanted`` encodes to ``raw``, and that ``raw`` decodes to exactly that."""
    codec = codec_of(protocol)
    made = _encode(codec, wanted, findings)
    if made is not None:
        findings.expect(
            made == raw,
            f"the stated values give {spaced(made)}, the {origin} bytes are {spaced(raw)}",
        )
    _decodes(codec, raw, wanted, f"{origin} bytes", findings)


def _erratum(
    protocol: Protocol,
    entry: Mapping[str, Any],
    wanted: Json,
    printed: bytes,
    findings: Findings,
) -> None:
    findings.expect(bool(entry.get("errata")), "the name of the erratum is missing")
    if entry.get("encoded") is None:
        findings.problems.append("`encoded` does not match the stated values")
        return
    encoded = octets(entry, "encoded")
    if findings.expect(
        encoded != printed, "unexpected pass: the printed bytes match the stated values"
    ):
        check_reproduced(protocol, wanted, encoded, "`encoded`", findings)
    truth = entry.get("printed_is", {})
    codec = codec_of(protocol)
    if "rejected" in truth:
        _rejected(codec, printed, wanted, truth["rejected"], findings)
    elif findings.expect("decodes" in truth, "`printed_is` does not describe the bytes"):
        said = wanted_of(
            protocol, {**{key: entry[key] for key in ("message", "form")}, **truth["decodes"]}
        )
        _decodes(codec, printed, said, "printed bytes", findings)


def _rejected(codec: Codec, raw: bytes, wanted: Json, code: str, findings: Findings) -> None:
    """Check that ``raw``, decoded in the same way as the stated message, is refused with ``code``."""
    try:
        reading = codec.reading(wanted) if "message" in wanted else {}
    except CodecError as error:
        findings.problems.append(f"the stated values cannot be used: {error}")
        return
    try:
        name = codec.decode(raw, reading)["message"]
    except CodecError as error:
        findings.expect(error.code == code, f"refused as {error.code}, not as {code}: {error}")
        findings.notes.append(f"{error.code}: {error}")
    else:
        findings.problems.append(f"unexpected pass: decodes as {name}, expected {code}")


def _encode(codec: Codec, wanted: Json, findings: Findings) -> bytes | None:
    try:
        return codec.encode(wanted)
    except (CodecError, ValueError) as error:
        findings.problems.append(f"the stated values do not encode: {error}")
        return None


def _decodes(codec: Codec, raw: bytes, wanted: Json, what: str, findings: Findings) -> None:
    """Check that ``raw`` decodes to exactly ``wanted``."""
    try:
        cls = codec.protocol.message_class(wanted["message"], wanted.get("form"))
        answer = codec.decode(raw, codec.reading(wanted))
    except CodecError as error:
        findings.problems.append(f"the {what} do not decode: {error}")
        return
    for key in ("message", "form", *ADDRESSES):
        if key in wanted:
            findings.expect(
                answer.get(key) == wanted[key],
                f"the {what} have {key} {answer.get(key)}, expected {wanted[key]}",
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
            findings.expect(got == value, f"the {what} have {name} {got}, expected {value}")
    for name, value in answer["fields"].items():
        silent = cls.layout.constants.get(name, 0)
        empty = not value.strip("0") if isinstance(value, str) else value == silent
        if name not in stated and not (empty and name in cls.layout.optional):
            findings.problems.append(f"the {what} have {name} {value}, which is not stated")


def wanted_of(protocol: Protocol, entry: Mapping[str, Any]) -> Json:
    """Return the values that an example states, with hex as in the testee protocol."""
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
