"""The Python testee with one mistake in a message or field.

``python broken_codecs.py NUMBER`` runs the testee with the mistake of this number from :func:`drawn`.
"""

from __future__ import annotations

import json
import sys
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from random import Random
from typing import Any

from stagewire.protocols import CommandProtocol, Protocol, load_protocol
from stagewire_conformance.registry import registry_of
from stagewire_conformance.testee import Testee, lines_of
from stagewire_conformance.testees.case import EndedError

NAMES = ("asi_ms2000", "thorlabs_apt")
SEED = 20120601

Json = dict[str, Any]


@dataclass(frozen=True)
class Mistake:
    """A mistake.

    :param kind: a key of the table below.
    :param form: the layout with the mistake; other layouts of the message are correct.
    :param field: the field with the mistake; empty for the whole message.
    """

    kind: str
    protocol: str
    message: str
    form: str
    field: str = ""

    def __str__(self) -> str:
        return " ".join(filter(None, (self.kind, self.message, self.form, self.field)))


class Broken:
    """A testee with a mistake."""

    def __init__(self, mistake: Mistake) -> None:
        self._testee = Testee()
        self._mistake = mistake
        self._layout = Layout(mistake)
        self._make = KINDS[mistake.kind]

    def answer(self, line: bytes) -> Json:
        right = self._testee.answer(line)
        try:
            request = json.loads(line)
            if request["protocol"] != self._mistake.protocol:
                return right
        except (ValueError, LookupError, TypeError, RecursionError):
            return right
        if right.get("error") in ("bad_request", "unsupported"):
            return right
        return self._make(self._layout, self._ask, request, right)

    def _ask(self, request: Json) -> Json:
        return self._testee.answer(json.dumps(request).encode())


_loaded = cache(load_protocol)


class Layout:
    """The layout with the mistake, as in the registry."""

    def __init__(self, mistake: Mistake) -> None:
        self.protocol = _loaded(mistake.protocol)
        registry = registry_of(self.protocol)
        self.message, self.form, self.name = mistake.message, mistake.form, mistake.field
        self.layout = registry.layout(self.message, self.form) or {}
        self.fields = registry.fields(self.message, self.form)
        self.field = self.fields.get(self.name, {})
        self.size: int = self.field.get("size", 0)
        self._id: int = registry.messages[self.message]["id"]
        self._kind: str = registry.messages[self.message]["kind"]

    @property
    def start(self) -> int:
        """The position of the field in the bytes of the message."""
        if self.name in (
            self.layout[key] and self.layout[key]["name"] for key in ("param1", "param2")
        ):
            return int(self.field["offset"])
        return self.payload + int(self.field["offset"])

    @property
    def payload(self) -> int:
        """The position of the payload."""
        if isinstance(self.protocol, CommandProtocol):
            return 0 if self.form == "reply" else 3
        return 6

    @property
    def whole(self) -> bool:
        """Whether the range of the field covers all values of its bytes."""
        numbers: int = self.field["maximum"] - self.field["minimum"] + 1
        return numbers == 1 << 8 * self.size

    @property
    def free(self) -> bool:
        """Whether a packet with any value of the field can be decoded."""
        arrays = (f["array"]["rows"] for f in self.fields.values() if f["kind"] == "array")
        return self.field["role"] != "constant" and self.name not in arrays

    def neighbour(self) -> str:
        """Another field of the same kind and size; empty if there is none."""
        alike = (self.field["kind"], self.size, "value", "value")
        for name, field in self.fields.items():
            roles = field["role"], self.field["role"]
            if name != self.name and (field["kind"], field["size"], *roles) == alike:
                return name
        return ""

    def said(self, answer: Json) -> bool:
        """Return whether an answer or event contains this layout."""
        return (answer.get("message"), answer.get("form")) == (self.message, self.form)

    def encodes(self, request: Json) -> bool:
        """Return whether a request encodes this layout."""
        if request["op"] != "encode" or request.get("message") != self.message:
            return False
        forms = {"command": "request", "reply": "reply"}
        return self.form == (
            request.get("form") or forms.get(request.get("direction", ""), self.form)
        )

    def decodes(self, request: Json) -> bool:
        """Return whether the first bytes of a request match this layout."""
        if request["op"] != "decode":
            return False
        raw = bytes.fromhex(request["hex"])
        if self.form == "reply":
            return request.get("command") == self.message
        if isinstance(self.protocol, CommandProtocol):
            setup = raw[:1] == b"\xff"
            return raw[1:2] == bytes((self._id,)) and setup == (self._kind == "setup")
        data = len(raw) > 4 and bool(raw[4] & 0x80)
        return raw[:2] == self._id.to_bytes(2, "little") and data == (self.form != "header")


Ask = Callable[[Json], Json]
Make = Callable[[Layout, Ask, Json, Json], Json]


# Mistakes of a decoder


def _decoder(change: Callable[[Layout, Json, Any], Any]) -> Make:
    """Return a decoder that changes a field, in messages and streams."""

    def make(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
        def changed(answer: Json) -> Json:
            if not layout.said(answer) or layout.name not in answer["fields"]:
                return answer
            value = change(layout, answer, answer["fields"][layout.name])
            return {**answer, "fields": {**answer["fields"], layout.name: value}}

        if "events" in right:
            return {**right, "events": [changed(event) for event in right["events"]]}
        return changed(right)

    return make


def _number(layout: Layout, value: int) -> bytes:
    return (value % (1 << 8 * layout.size)).to_bytes(layout.size, "little")


def _signed_otherwise(layout: Layout, answer: Json, value: int) -> int:
    return int.from_bytes(_number(layout, value), "little", signed=not layout.field["signed"])


def _bytes_reversed(layout: Layout, answer: Json, value: int) -> int:
    return int.from_bytes(_number(layout, value), "big", signed=layout.field["signed"])


def _top_bit_lost(layout: Layout, answer: Json, value: int) -> int:
    return value & ((1 << (8 * layout.size - 1)) - 1)


def _low_byte_alone(layout: Layout, answer: Json, value: int) -> int:
    return value & 0xFF


def _of_neighbour(layout: Layout, answer: Json, value: Any) -> Any:
    return answer["fields"][layout.neighbour()]


def _always_zero(layout: Layout, answer: Json, value: Any) -> Any:
    return {int: 0, str: ""}[type(value)]


def _from_source(layout: Layout, answer: Json, value: int) -> int:
    return int(answer["source"])


def _from_axis(layout: Layout, answer: Json, value: int) -> int:
    return int(answer["axis"])


def _a_text(layout: Layout, answer: Json, value: int) -> str:
    return str(value)


def _true(layout: Layout, answer: Json, value: int) -> object:
    return True if value == 1 else value


def _last_letter_lost(layout: Layout, answer: Json, value: str) -> str:
    return value[:-2] if layout.field["kind"] == "bytes" else value[:-1]


# Mistakes of an encoder


def _encoder(change: Callable[[Layout, bytearray], None]) -> Make:
    """Return an encoder that changes the bytes."""

    def make(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
        if not right["ok"] or not layout.encodes(request):
            return right
        raw = bytearray.fromhex(right["hex"])
        change(layout, raw)
        return {**right, "hex": raw.hex()}

    return make


def _encoded_reversed(layout: Layout, raw: bytearray) -> None:
    raw[layout.start : layout.start + layout.size] = raw[layout.start : layout.start + layout.size][
        ::-1
    ]


def _encoded_zero(layout: Layout, raw: bytearray) -> None:
    raw[layout.start : layout.start + layout.size] = bytes(layout.size)


def _encoded_mask(layout: Layout, raw: bytearray) -> None:
    raw[layout.start + layout.size - 1] &= 0x7F


def _encoded_short(layout: Layout, raw: bytearray) -> None:
    del raw[layout.start + layout.size - 1]


def _encoded_one_off(layout: Layout, raw: bytearray) -> None:
    end = layout.start + layout.size
    raw[layout.start : end] = bytes(1) + raw[layout.start : end - 1]


def _encoded_of_neighbour(layout: Layout, raw: bytearray) -> None:
    first, second = layout.start, layout.payload + layout.fields[layout.neighbour()]["offset"]
    if layout.form == "header":
        first, second = 2, 3
    size = layout.size
    raw[first : first + size], raw[second : second + size] = (
        raw[second : second + size],
        raw[first : first + size],
    )


# Mistakes of both: refusals


def _wraps(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    """Truncate values that are out of range to the size of the field."""
    value = request.get("fields", {}).get(layout.name) if layout.encodes(request) else None
    if right.get("error") != "out_of_range" or not isinstance(value, int):
        return right
    raw = _number(layout, value)
    inside = int.from_bytes(raw, "little", signed=layout.field["signed"])
    return ask({**request, "fields": {**request["fields"], layout.name: inside}})


def _signed_range(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    """Use the range of a signed number for an unsigned one, and vice versa."""
    value = request.get("fields", {}).get(layout.name) if layout.encodes(request) else None
    if not isinstance(value, int) or isinstance(value, bool):
        return right
    half = 1 << (8 * layout.size - 1)
    low, high = (0, 2 * half - 1) if layout.field["signed"] else (-half, half - 1)
    if low <= value <= high:
        return _wraps(layout, ask, request, right)
    return {"id": right["id"], "ok": False, "error": "out_of_range", "detail": "out of range"}


def _not_needed(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    """Treat a missing required field as zero."""
    if right.get("error") != "missing_field" or not layout.encodes(request):
        return right
    if layout.name in request.get("fields", {}):
        return right
    zero = {"integer": 0, "text": "", "bytes": "00" * layout.size}[layout.field["kind"]]
    return ask({**request, "fields": {**request["fields"], layout.name: zero}})


def _any_kind(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    """Accept a number written as text."""
    value = request.get("fields", {}).get(layout.name) if layout.encodes(request) else None
    if right.get("error") != "bad_value" or not isinstance(value, str) or not value.isdigit():
        return right
    return ask({**request, "fields": {**request["fields"], layout.name: int(value)}})


def _knows_any_field(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    if right.get("error") != "unknown_field" or not layout.encodes(request):
        return right
    known = {name: value for name, value in request["fields"].items() if name in layout.fields}
    return ask({**request, "fields": known})


def _another_code(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    about = layout.encodes(request) or layout.decodes(request)
    return {**right, "error": "unknown_message"} if about and not right["ok"] else right


def _takes_half(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    """Treat missing bytes as zero."""
    if right.get("error") != "truncated" or not layout.decodes(request):
        return right
    for more in range(100):
        for end in ("", "3a"):
            answer = ask({**request, "hex": request["hex"] + "00" * more + end})
            if answer["ok"]:
                return answer
    return right


def _takes_too_much(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    """Ignore bytes after the end."""
    if right.get("error") != "trailing" or not layout.decodes(request):
        return right
    for less in range(1, 40):
        answer = ask({**request, "hex": request["hex"][: -2 * less]})
        if answer["ok"]:
            return answer
    return right


def _loses_extra(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    if layout.said(right):
        return {key: value for key, value in right.items() if key != "extra"}
    return right


def _sends_no_extra(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    if right["ok"] and layout.encodes(request) and request.get("extra"):
        return ask({key: value for key, value in request.items() if key != "extra"})
    return right


def _refuses(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    """Refuse a valid message."""
    if not (layout.said(right) or (right["ok"] and layout.encodes(request))):
        return right
    return {"id": right["id"], "ok": False, "error": "bad_length", "detail": "it looks wrong"}


def _keeps_announcement(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    """Keep the packet flag in the address."""
    return {**right, "dest": right["dest"] | 0x80} if layout.said(right) else right


def _swaps_addresses(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    said = layout.said(right) and "dest" in right
    return {**right, "dest": right["source"], "source": right["dest"]} if said else right


def _loses_at_a_cut(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    """Lose a message if the first chunk has only one or two bytes."""
    if not any(layout.said(event) for event in right.get("events", ())):
        return right
    if len(request["chunks"]) < 2 or not 1 <= len(request["chunks"][0]) // 2 <= 2:
        return right
    return {**right, "events": [event for event in right["events"] if not layout.said(event)]}


def _loses_the_last_chunk(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    if not any(layout.said(event) for event in right.get("events", ())):
        return right
    return ask({**request, "chunks": request["chunks"][:-1]}) if request["chunks"][1:] else right


def _repeats_messages(layout: Layout, ask: Ask, request: Json, right: Json) -> Json:
    if not any(layout.said(event) for event in right.get("events", ())):
        return right
    events = [e for event in right["events"] for e in [event] * (1 + layout.said(event))]
    return {**right, "events": events}


KINDS: dict[str, Make] = {
    "decoded: sign": _decoder(_signed_otherwise),
    "decoded: byte order": _decoder(_bytes_reversed),
    "decoded: dropped mask": _decoder(_top_bit_lost),
    "decoded: low byte alone": _decoder(_low_byte_alone),
    "decoded: swapped": _decoder(_of_neighbour),
    "decoded: constant": _decoder(_always_zero),
    "decoded: channel from source": _decoder(_from_source),
    "decoded: from axis": _decoder(_from_axis),
    "decoded: number as text": _decoder(_a_text),
    "decoded: true": _decoder(_true),
    "decoded: last letter lost": _decoder(_last_letter_lost),
    "encoded: byte order": _encoder(_encoded_reversed),
    "encoded: constant": _encoder(_encoded_zero),
    "encoded: dropped mask": _encoder(_encoded_mask),
    "encoded: a byte short": _encoder(_encoded_short),
    "encoded: a place further": _encoder(_encoded_one_off),
    "encoded: swapped": _encoder(_encoded_of_neighbour),
    "range: wraps": _wraps,
    "range: sign": _signed_range,
    "fields: not needed": _not_needed,
    "fields: any kind": _any_kind,
    "fields: any name": _knows_any_field,
    "refusals: another code": _another_code,
    "refusals: half a message": _takes_half,
    "refusals: too much": _takes_too_much,
    "refusals: what is right": _refuses,
    "extra: lost": _loses_extra,
    "extra: not sent": _sends_no_extra,
    "addresses: dropped mask": _keeps_announcement,
    "addresses: swapped": _swaps_addresses,
    "stream: lost at a cut": _loses_at_a_cut,
    "stream: last chunk lost": _loses_the_last_chunk,
    "stream: twice": _repeats_messages,
}


def every_mistake() -> Iterator[Mistake]:
    """Yield each kind of mistake for each field or layout that can have it."""
    for name in NAMES:
        protocol = _loaded(name)
        for message in registry_of(protocol).data["messages"]:
            for layout in message["layouts"]:
                form = layout["form"]
                for kind in _of_layouts(protocol, message, layout):
                    yield Mistake(kind, name, message["name"], form)
                for field in registry_of(protocol).fields(message["name"], form):
                    for kind in _of_fields(
                        protocol, Layout(Mistake("", name, message["name"], form, field))
                    ):
                        yield Mistake(kind, name, message["name"], form, field)


def _of_layouts(protocol: Protocol, message: Json, layout: Json) -> Iterator[str]:
    yield from (
        "fields: any name",
        "refusals: another code",
        "refusals: too much",
        "refusals: what is right",
    )
    yield from ("stream: last chunk lost", "stream: twice")
    if message["kind"] != "setup":  # one of its two bytes does not identify it
        yield "refusals: half a message"
    if layout["length"] and layout["form"] != "reply":
        yield from ("extra: lost", "extra: not sent")
    if not isinstance(protocol, CommandProtocol):
        yield from ("addresses: swapped", "stream: lost at a cut")
        if layout["form"] != "header":
            yield "addresses: dropped mask"


def _of_fields(protocol: Protocol, layout: Layout) -> Iterator[str]:
    field, stated = layout.field, layout.field["role"] == "value"
    yield from ("decoded: constant", "encoded: constant")
    if layout.form != "header":
        yield "encoded: a byte short"
    if stated:
        yield "fields: not needed"
        if layout.neighbour():
            yield from ("decoded: swapped", "encoded: swapped")
    if field["kind"] != "integer":
        yield "decoded: last letter lost"
        return
    yield "decoded: number as text"
    if layout.free:
        yield from ("decoded: sign", "decoded: dropped mask")
    yield "range: wraps"
    if layout.whole:  # other ranges have no valid value with the top bit
        yield from ("encoded: dropped mask", "range: sign")
    if layout.size > 1:
        yield "decoded: byte order"
        if layout.free:
            yield "decoded: low byte alone"
        yield from ("encoded: byte order", "encoded: a place further")
    if layout.name == "chan_ident":
        yield from ("decoded: channel from source", "decoded: true")
        if layout.name == next(iter(layout.fields)):  # the field that the cases write as text
            yield "fields: any kind"
    if layout.form == "request":
        yield "decoded: from axis"


@cache
def drawn(number: int = 200) -> tuple[Mistake, ...]:
    """Return random mistakes of every kind, spread over all messages and fields."""
    random = Random(SEED)
    kinds: dict[str, list[Mistake]] = {}
    for mistake in every_mistake():
        kinds.setdefault(mistake.kind, []).append(mistake)
    for mistakes in kinds.values():
        random.shuffle(mistakes)
    found: list[Mistake] = []
    waiting = deque(kinds.values())
    while waiting and len(found) < number:
        mistakes = waiting.popleft()
        found.append(mistakes.pop())
        if mistakes:
            waiting.append(mistakes)
    return tuple(found)


class InProcess:
    """A testee in this process instead of a child process."""

    def __init__(self, answer: Callable[[bytes], Json]) -> None:
        self._answer = answer
        self._came: deque[bytes] = deque()

    def send(self, data: bytes) -> None:
        for line in data.split(b"\n")[:-1]:
            self._came.append(json.dumps(self._answer(line)).encode() + b"\n")

    def receive(self, timeout: float) -> bytes:
        if not self._came:
            raise EndedError
        return self._came.popleft()

    def early(self) -> bytes:
        return self._came.popleft() if self._came else b""

    def said(self) -> str:
        return ""

    def end(self, patience: float = 0.0) -> str:
        return "has ended"


def broken(mistake: Mistake) -> InProcess:
    """Return the testee with a mistake, in this process."""
    return InProcess(Broken(mistake).answer)


if __name__ == "__main__":
    testee = Broken(drawn()[int(sys.argv[1])])
    for line in lines_of(sys.stdin.buffer):
        print(json.dumps(testee.answer(line)), flush=True)
