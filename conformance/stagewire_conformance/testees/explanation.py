"""Explain how an answer differs from the expected one, by message and field.

A byte of a message belongs to a field of its layout, or to a part of its frame.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from stagewire.errors import CodecError
from stagewire.protocols import Layout, Protocol, load_protocol
from stagewire_conformance.comparison import canonical, shape
from stagewire_conformance.framings import codec_of
from stagewire_conformance.framings.base import Codec, Part
from stagewire_conformance.registry import registry_of
from stagewire_conformance.testees.case import Case, Step


def name_at(protocol: Protocol, request: Mapping[str, Any], raw: bytes, at: int) -> str:
    """Return the name of the field or part at a position of an encoded message.

    :param request: the encode request.
    :param raw: the correct bytes.
    :param at: counted from zero.
    """
    try:
        layout = protocol.message_class(request["message"], request.get("form")).layout
    except CodecError:  # the context selects the layout
        return "frame"
    codec = codec_of(protocol)
    parts = [*_fields(codec, layout), *codec.frame_parts(layout, raw)]
    return next((name for name, place in parts if at in place), "extra")


def _fields(codec: Codec, layout: Layout) -> Iterator[Part]:
    stated = registry_of(codec.protocol).layout(layout.message, layout.form) or {}
    for key in ("param1", "param2"):  # counted from the beginning of the frame
        if stated.get(key):
            at = stated[key]["offset"]
            yield stated[key].get("name") or key, range(at, at + 1)
    for field in stated.get("fields", ()):
        yield field["name"], codec.field_place(layout, field["offset"], field["size"])


Json = Mapping[str, Any]

_ROOM = 200
_MOST = 6


def explain(case: Case, step: Step, came: Json, number: int) -> str:
    """Return one sentence about an answer that is not the expected one.

    :param number: the id of the request.
    """
    subject = f"{case.message}, {case.field}: " if case.field else f"{case.message}: "
    return (subject if case.message else "") + _problem(case, step, came, number)


def shortened(text: str) -> str:
    """Return a text, truncated if it is long."""
    return text if len(text) <= _ROOM else f"{text[:_ROOM]}… ({len(text):,} characters)"


def _problem(case: Case, step: Step, came: Json, number: int) -> str:
    wanted = step.wanted
    wrong = shape(came)
    if wrong:
        return f"the answer has an invalid shape: {wrong}"
    ids = [_value(id) for id in step.echoes(number)]
    if _value(came.get("id")) not in ids:
        return f"the answer has the id {_value(came.get('id'))}, expected {' or '.join(ids)}"
    if not came["ok"]:
        refused = f"refused with {came['error']} ({shortened(came['detail'])})"
        if wanted["ok"]:
            return f"{refused}, expected {_granted(wanted)}"
        return f"{refused}, expected a refusal with {wanted['error']}"
    if not wanted["ok"]:
        return f"granted with {_granted(came)}, expected a refusal with {wanted['error']}"
    found = list(_Differences(case, step).of(wanted, came))
    more = f"; and {len(found) - _MOST} more" if len(found) > _MOST else ""
    return "; ".join(found[:_MOST]) + more


def _granted(answer: Json) -> str:
    said = {key: value for key, value in answer.items() if key not in ("id", "ok", "detail")}
    return shortened(canonical(said))


def _value(value: object) -> str:
    return shortened(json.dumps(value, sort_keys=True, ensure_ascii=False))


class _Differences:
    """The differences between two answers that grant the request of a step."""

    def __init__(self, case: Case, step: Step) -> None:
        self._case = case
        self._request = step.request

    def of(self, wanted: Json, came: Json) -> Iterator[str]:
        """Yield a sentence for each key in which the answers differ."""
        for key in [*wanted, *(key for key in came if key not in wanted)]:
            if key in ("id", "ok"):
                continue
            one, other = wanted.get(key), came.get(key)
            if key == "fields" and isinstance(one, dict) and isinstance(other, dict):
                yield from self.of(one, other)
            elif key == "events" and isinstance(one, list) and isinstance(other, list):
                yield from self._events(one, other)
            elif key == "hex" and isinstance(one, str) and isinstance(other, str):
                yield from self._bytes(one, other)
            elif key not in came:
                yield f"{key} is missing, expected {_value(one)}"
            elif key not in wanted:
                yield f"{key} is {_value(other)}, but must be absent"
            elif canonical({"": one}) != canonical({"": other}):
                yield f"{key} is {_value(other)}, expected {_value(one)}"

    def _events(self, wanted: list[Json], came: list[Any]) -> Iterator[str]:
        if len(wanted) != len(came):
            yield f"{len(came)} events, expected {len(wanted)}"
        for number, (one, other) in enumerate(zip(wanted, came, strict=False), 1):
            name = f"event {number} ({one.get('message', one['event'])})"
            if not isinstance(other, dict):
                yield f"{name} is {_value(other)}, expected an object"
                continue
            for difference in self.of(one, other):
                yield f"{name}: {difference}"

    def _bytes(self, wanted: str, came: str) -> Iterator[str]:
        """Yield differences between bytes, by field."""
        try:
            one, other = bytes.fromhex(wanted), bytes.fromhex(came)
        except ValueError:
            other = b""
        if other.hex() != came:
            yield f"hex is {_value(came)}, expected {_value(wanted)}"
            return
        pairs = list(zip(one, other, strict=False))
        wrong = [at for at, (a, b) in enumerate(pairs) if a != b]
        if len(one) != len(other):
            at = wrong[0] if wrong else min(len(other), len(one) - 1)
            more = f", first difference at byte {at}" if wrong else ""
            yield f"{len(other)} bytes, expected {len(one)}{more} ({self._name(one, at)})"
            return
        places: dict[str, list[int]] = {}
        for at in wrong:
            places.setdefault(self._name(one, at), []).append(at)
        for name, found in places.items():
            first, last = found[0], found[-1]
            where = f"byte {first}" if first == last else f"bytes {first} to {last}"
            is_, should = other[first : last + 1].hex(" "), one[first : last + 1].hex(" ")
            yield f"{name} ({where}) is {is_}, expected {should}"

    def _name(self, raw: bytes, at: int) -> str:
        """Return the name of the part at a position of an encoded message; empty for other answers."""
        if self._request is None or self._request.get("op") != "encode":
            return "bytes"
        return name_at(load_protocol(self._case.protocol), self._request, raw, at)
