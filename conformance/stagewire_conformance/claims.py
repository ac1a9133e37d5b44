"""Claims of the document's prose, checked against the registry or the framer where a program can."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from stagewire.protocols import Protocol
from stagewire_conformance.framings import codec_of
from stagewire_conformance.registry import Json, registry_of
from stagewire_conformance.verdict import Findings

_Claim = Mapping[str, Any]


def check_claim(protocol: Protocol, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check that the registry agrees with the stated meaning of a sentence, where a program can."""
    claim = entry["claim"]
    if "prose" in claim:
        findings.checked = False
        findings.notes.append("prose that a program cannot check")
        return
    try:
        holds, truth = _claim(protocol, claim)
    except LookupError as error:
        findings.problems.append(str(error.args[0]))
        return
    findings.expect(holds, f"{truth}, which contradicts the statement")
    findings.notes.append(truth)


def _claim(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    """Return whether a claim is true, and the facts of the registry or the framer."""
    found = [check(protocol, claim) for key, check in _CLAIMS.items() if key in claim]
    if not found:
        raise LookupError(f"unknown claim: {', '.join(claim)}")
    return all(holds for holds, _ in found), "; ".join(truth for _, truth in found)


def _flag(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    name = claim["flag"]
    table, _, bit = name.partition(".")
    bits = _entry(protocol, "flags", table)["bits"]
    if bit not in bits:
        raise LookupError(f"{table} has no bit {bit}")
    number: int = bits[bit]["bit"]
    if "of" in claim:
        value = claim["of"]
        held = bool(value >> number & 1)
        return held == claim["set"], f"{name} is {'set' if held else 'clear'} in {value}"
    if "bit" in claim:
        return number == claim["bit"], f"{name} is bit {number} counted from zero"
    return number + 1 == claim["bit_number"], f"{name} is bit {number + 1} counted from one"


def _range(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    field = _field(protocol, claim["range"])
    ends = {key: claim[key] for key in ("minimum", "maximum") if key in claim}
    if not ends:
        raise LookupError(f"the claim states neither end of the range of {claim['range']}")
    truth = f"{claim['range']} ranges from {field['minimum']} to {field['maximum']}"
    return all(field[key] == value for key, value in ends.items()), truth


def _undefined(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    name = claim["undefined"]
    message = registry_of(protocol).messages.get(name)
    defined = message is not None and bool(message["layouts"])
    return not defined, f"{name} has {'a' if defined else 'no'} layout in the registry"


def _enum(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    values = _entry(protocol, "enumerations", claim["enum"])["values"]
    if "missing" in claim:
        return claim["missing"] not in values, f"{claim['enum']} has {', '.join(values)}"
    name = claim["member"]
    if name not in values:
        raise LookupError(f"{claim['enum']} has no {name} (it has {', '.join(values)})")
    value = values[name]["value"]
    return value == claim["value"], f"{claim['enum']} has {value} for {name}"


def _format(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    field = _field(protocol, claim["format"])
    sign = "with" if field["signed"] else "without"
    truth = f"{claim['format']} has {field['size']} bytes {sign} a sign"
    return field["size"] == claim["size"] and field["signed"] == claim["signed"], truth


def _sizes(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    sizes = [command["size"] for command in _commands(protocol) if command["size"] is not None]
    found = {"minimum": min(sizes), "maximum": max(sizes)}
    truth = f"commands have sizes from {found['minimum']} to {found['maximum']}"
    return found == claim["sizes"], truth


def _without_size(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    found = {command["name"] for command in _commands(protocol) if command["size"] is None}
    truth = f"the commands without a size slot are {_list(found)}"
    return found == set(claim["without_size"]), truth


def _dummies(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    found = {command["name"] for command in _commands(protocol) if command["dummy"]}
    return found == set(claim["dummies"]), f"the dummies are {_list(found)}"


def _unanswered(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    name = claim["unanswered"]
    answered = any(layout["form"] == "reply" for layout in _message(protocol, name)["layouts"])
    return not answered, f"{name} has {'a' if answered else 'no'} reply in the registry"


def _switches_to(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    name = claim["command"]
    found = _message(protocol, name).get("switches_to")
    truth = f"{name} switches to {found}" if found else f"{name} does not change the format"
    return found == claim["switches_to"], truth


def _firmware(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    whole = registry_of(protocol).data
    stated = _message(protocol, claim["message"]) if "message" in claim else whole
    versions = [fact["version"] for fact in stated.get("firmware", ())]
    of = claim.get("message", "the protocol")
    truth = f"the registry has statements about {of} for firmware {', '.join(versions) or '(none)'}"
    return claim["firmware"] in versions, truth


def _stream(protocol: Protocol, claim: _Claim) -> tuple[bool, str]:
    """Return whether bytes sent to a controller are split as claimed, and the actual events."""
    raw = bytes.fromhex(claim["stream"])
    answer = codec_of(protocol).stream([raw], {"end": "device"})
    found = [event["event"] for event in answer["events"]]
    waiting = ["incomplete bytes"] if answer["pending"] else []
    truth = f"{claim['stream']} is {', '.join([*found, *waiting])}"
    return not waiting and found == claim["events"], truth


_CLAIMS: dict[str, Callable[[Protocol, _Claim], tuple[bool, str]]] = {
    "flag": _flag,
    "range": _range,
    "undefined": _undefined,
    "enum": _enum,
    "format": _format,
    "sizes": _sizes,
    "without_size": _without_size,
    "dummies": _dummies,
    "unanswered": _unanswered,
    "switches_to": _switches_to,
    "firmware": _firmware,
    "stream": _stream,
}


def _commands(protocol: Protocol) -> list[Json]:
    messages = registry_of(protocol).messages.values()
    found = [message for message in messages if message["kind"] == "command"]
    if not found:
        raise LookupError("the registry has no commands")
    return found


def _message(protocol: Protocol, name: str) -> Json:
    messages = registry_of(protocol).messages
    if name not in messages:
        raise LookupError(f"the registry has no message {name}")
    return messages[name]


def _entry(protocol: Protocol, kind: str, name: str) -> Json:
    found = registry_of(protocol).table(kind).get(name)
    if found is None:
        raise LookupError(f"the registry has no {name} among its {kind}")
    return found


def _field(protocol: Protocol, name: str) -> Json:
    message, _, field = name.partition(".")
    registry = registry_of(protocol)
    for layout in registry.messages.get(message, {}).get("layouts", []):
        fields = registry.fields(message, layout["form"])
        if field in fields:
            return fields[field]
    raise LookupError(f"the registry has no field {name}")


def _list(names: set[str]) -> str:
    return ", ".join(sorted(names)) or "none"
