"""Cases in C: frames for one number, examples typed at a terminal, and the cases of the vectors."""

from __future__ import annotations

import re
from collections import Counter, deque
from collections.abc import Callable, Iterator
from typing import NamedTuple

from stagewire_generator.model import Json, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.targets.c.testing.values import CannotSayError
from stagewire_generator.targets.c.testing.vector import Content, Vectors, VectorView
from stagewire_generator.targets.vectors.cases import cases_of
from stagewire_generator.targets.vectors.subject import Case, Subject


def octets_of(entry: Json, key: str) -> bytes:
    """Return the bytes of an example in its notation: hex, decimal (``24 97 03 58``) or ``#FF#41``."""
    text: str = entry[key]
    if entry.get("notation") == "decimal":
        return bytes(int(number) for number in text.split())
    return bytes.fromhex(text.replace("#", ""))


def field_where(vectors: Vectors, wanted: Callable[[Subject, Field], bool]) -> Number:
    """Return the first field of a payload that is wanted.

    :raises CannotSayError: if there is none.
    """
    for of in vectors.subjects.values():
        for field in of.layout.fields:
            if wanted(of, field):
                return Number(vectors, of, field)
    raise CannotSayError("an unknown field")


class Number:
    """A field under test in a message with otherwise plain values."""

    def __init__(self, vectors: Vectors, of: Subject, field: Field) -> None:
        self._vectors = vectors
        self._of = of
        self.field = field

    def content(self, value: int) -> Content:
        """Return the content of a message with this value."""
        asked = {key: said for key, said in self._of.asked.items() if key != "op"}
        return self._vectors.content({**asked, "fields": self._held(value)})

    def raw(self, value: int) -> bytes:
        """Return the frame of a message with this value."""
        return self._vectors.bytes_of(self._of, self._held(value))

    def around(self, printed: bytes) -> bytes:
        """Return a frame with these bytes as the field."""
        raw = self._vectors.bytes_of(self._of, self._of.plain.held)
        start = self._vectors.framing.data_at(self._vectors.protocol, self._of) + self.field.offset
        return raw[:start] + printed + raw[start + self.field.format.size :]

    def _held(self, value: int) -> Json:
        return {**self._of.plain.held, self.field.name: value}


_KEY = re.compile(
    r"\s+|Ctrl<(?P<ctrl>[@-_])>|Alt\[(?P<alt>\d{1,4})\]|(?P<esc>ESC)|'(?P<quoted>.)'|(?P<char>.)"
)
_UNREADABLE = "_"  # placeholder for bytes that a terminal does not show
_ESCAPE = 0x1B


def keyboard_vectors(vectors: Vectors, id: str, entry: Json) -> Iterator[VectorView]:
    """Yield checks that the typed or shown characters are the bytes of a message.

    Placeholders for unreadable bytes are not checked.
    """
    if "message" not in entry:
        yield vectors.holds(id, _axis(vectors, entry))
        return
    content = vectors.content(entry)
    text = entry.get("corrected") or entry.get("typed") or entry["shown"]
    if "typed" in entry:
        yield vectors.both(id, content, bytes_of(text))
        if "corrected" in entry:
            yield vectors.differs(id, content, bytes_of(entry["typed"]))
    elif _UNREADABLE in text:
        yield vectors.both(id, content, vectors.bytes_of(content.of, dict(content.values)))
    else:
        raw = text.encode(entry.get("code_page", "ascii"), errors="replace")
        yield vectors.both(id, content, raw)


def _axis(vectors: Vectors, entry: Json) -> str:
    """Return the condition that the key of an axis sends its identifier byte."""
    name = vectors.protocol.framing.get("axes")
    tables = [table for table in vectors.protocol.enumerations if table.name == name]
    typed = bytes_of(entry["typed"])
    named = [axis.name for table in tables for axis in table.values if axis.value == entry["axis"]]
    if len(typed) != 1 or not named:
        raise CannotSayError("an axis without a key")
    return f"{vectors.names.table(tables[0]).upper()}_{named[0]} == {typed[0]}"


def bytes_of(text: str) -> bytes:
    """Return the bytes that keys send: ``Ctrl<X>``, ``Alt[255]``, ``ESC``, ``'A'`` or ``A``.

    :raises CannotSayError: if a key does not send one byte.
    """
    numbers = []
    for key in _KEY.finditer(text):
        if key["esc"]:
            numbers.append(_ESCAPE)
        elif key["ctrl"]:
            numbers.append(ord(key["ctrl"]) & 0x1F)
        elif key["alt"]:
            numbers.append(int(key["alt"]))
        elif key["quoted"] or key["char"]:
            numbers.append(ord(key["quoted"] or key["char"]))
    if any(number > 0xFF for number in numbers):
        raise CannotSayError("a key that does not send one byte")
    return bytes(numbers)


_FUNCTIONS = ("refuse_prefix_bytes",)  # keys of a request that are separate functions in C


class CasesView(NamedTuple):
    """Vectors of the cases.

    :param held: number of these cases; encoding and decoding the same message is one vector.
    :param total: number of cases of the protocol.
    :param left_out: the reasons for missing cases, each with the number of cases.
    """

    vectors: tuple[VectorView, ...]
    held: int
    total: int
    left_out: tuple[str, ...]


def cases_view(protocol: Protocol) -> CasesView:
    """Make the view of all cases that can be written in C."""
    vectors, cases = Vectors(protocol), cases_of(protocol)
    made: list[VectorView] = []
    held = 0
    reasons: Counter[str] = Counter()
    waiting = deque(cases)
    while waiting:
        case = waiting.popleft()
        following = waiting[0] if waiting else None
        try:
            if following and (both := _pair(vectors, case, following)):
                made.append(both)
                waiting.popleft()
                held += 2
            else:
                made.append(_vector(vectors, case))
                held += 1
        except CannotSayError as error:
            reasons[str(error)] += 1
    left_out = tuple(f"{count} with {reason}" for reason, count in sorted(reasons.items()))
    return CasesView(tuple(made), held, len(cases), left_out)


def _pair(vectors: Vectors, encode: Case, decode: Case) -> VectorView | None:
    """Return one vector for two cases that encode and decode the same message, or None."""
    id = encode.id.replace("/encode/", "/encode+decode/")
    if id != decode.id.replace("/decode/", "/encode+decode/") or encode.refusal or decode.refusal:
        return None
    there, back = _encoded(vectors, encode), _decoded(vectors, decode)
    if there != back or encode.raw != decode.raw or encode.raw is None:
        return None
    make = vectors.carried if encode.request.get("allow_dummy") else vectors.both
    return make(id, there, encode.raw)


def _vector(vectors: Vectors, case: Case) -> VectorView:
    """Return a case as a vector.

    :raises CannotSayError: if the case cannot be written in C.
    """
    operation = case.request.get("op")
    if case.refusal == "bad_request":
        raise CannotSayError("an invalid request")
    if operation == "encode":
        return _encode(vectors, case)
    if operation == "decode":
        return _decode(vectors, case)
    if operation == "stream":
        raise CannotSayError("a stream, which only testees test")
    raise CannotSayError("another operation of testees")


def _encode(vectors: Vectors, case: Case) -> VectorView:
    if case.refusal not in ("", "out_of_range", "unsupported"):
        raise CannotSayError(f"the error {case.refusal} of encoding, which the compiler reports")
    content = _encoded(vectors, case)
    if case.refusal:
        return vectors.not_encoded(case.id, content, case.refusal)
    assert case.raw is not None
    if case.request.get("allow_dummy"):
        return vectors.carried(case.id, content, case.raw)
    return vectors.encoded(case.id, content, case.raw)


def _encoded(vectors: Vectors, case: Case) -> Content:
    """Return the content that a case encodes."""
    if any(case.request.get(key) for key in _FUNCTIONS):
        raise CannotSayError("a check of prefix bytes, which is a separate function")
    form = case.request.get("form", case.layout.form if case.layout else "")
    return vectors.content({**case.request, "form": form})


def _decode(vectors: Vectors, case: Case) -> VectorView:
    raw = case.raw
    if raw is None:
        raise CannotSayError("invalid hex")
    if case.refusal:
        return vectors.refused(case.id, raw, case.refusal, case.request)
    return vectors.decoded(case.id, _decoded(vectors, case), raw)


def _decoded(vectors: Vectors, case: Case) -> Content:
    """Return the content that a case decodes."""
    return vectors.content(dict(case.answer))
