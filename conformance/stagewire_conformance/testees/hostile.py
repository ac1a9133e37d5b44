"""Hostile input: lines that are not requests, unusual requests, and many lines at once.

A testee has to answer all lines in order and continue. Input that JSON parsers treat differently (repeated
keys, numbers of thousands of digits, a byte order mark) may be answered in any way, but must be answered.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from random import Random
from typing import Any

from stagewire_conformance.testees.case import Case, Step, send

_ROUNDS = 5
_LINES = 300
_SHORT = 10_000  # bytes of the longest line in a round


def order_cases(cases: Sequence[Case], seed: int) -> Iterator[Case]:
    """Yield rounds of lines that are all sent before the first answer is read.

    :param cases: the cases to choose from at random; most of their lines must be short.
    """
    random = Random(f"order {seed}")
    steps = [step for case in cases for step in case.steps]
    for number in range(_ROUNDS):
        chosen = tuple(_short_one(steps, random) for _ in range(_LINES))
        yield Case(
            id=f"order/at_once.{number}",
            group="order",
            steps=chosen,
            about=f"{_LINES} lines are sent before the first answer is read",
            at_once=True,
        )


def _short_one(steps: Sequence[Step], random: Random) -> Step:
    while True:
        step = random.choice(steps)
        if len(step.line(0)) < _SHORT:
            return step


Json = Mapping[str, Any]

_BAD: Json = {"ok": False, "error": "bad_request"}
_ANY: Json = {}
_ID = 7
_HELLO = b'{"id":7,"op":"hello"}'
_DEEP = 100_000
_LONG = 1_000_000
_HUGE = 17 * 1024 * 1024
_DAMAGED = 200
_PIECES = (b'"', b"\\", b"{", b"}", b"[", b"]", b":", b",", b" ", b"\x00", b"\x7f", b"0", b"-", b".",
           b"e", b"null", b"true", b"NaN", b"\\u00e9", b"\\ud83d", b"\xc3\xa9", b"\xff", b"1e5", b"01",
           b'"a":1')  # fmt: skip

# name -> (line, description); none of them has a readable id
_NO_REQUEST: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "an empty line"),
    "blank": (b" \t ", "only blanks"),
    "word": (b"hello", "a word"),
    "not_utf_8": (b"\xff\xfe", "bytes that are not text"),
    "not_utf_8.inside": (
        b'{"id":7,"op":"hello","x":"\xff"}',
        "bytes that are not text, in a string",
    ),
    "nul": (b'{"id":7,"op":"hello"}\x00', "a zero byte after the request"),
    "brace": (b"{", "an unterminated object"),
    "cut": (_HELLO[:-1], "a request without its last byte"),
    "array": (b"[" + _HELLO + b"]", "a request in an array"),
    "null": (b"null", "null"),
    "text": (b'"hello"', "a string"),
    "digits": (b"1" * 5000, "a number of 5,000 digits"),
    "two": (_HELLO + b" " + _HELLO, "two requests on one line"),
    "comma": (b'{"id":7,"op":"hello",}', "a trailing comma"),
    "quotes": (b"{'id':7,'op':'hello'}", "single quotes"),
    "open.arrays": (b"[" * _DEEP, f"{_DEEP:,} unterminated arrays"),
    "open.objects": (b'{"id":1,"op":' * (_DEEP // 2), f"{_DEEP // 2:,} unterminated objects"),
    "id.missing": (b'{"op":"hello"}', "no id"),
    "id.null": (b'{"id":null,"op":"hello"}', "null as the id"),
    "id.true": (b'{"id":true,"op":"hello"}', "true as the id"),
    "id.fraction": (b'{"id":1.5,"op":"hello"}', "a fraction as the id"),
    "id.array": (b'{"id":[7],"op":"hello"}', "an array as the id"),
    "id.object": (b'{"id":{"id":7},"op":"hello"}', "an object as the id"),
}

# name -> (line, expected answer with the id or null, description)
_ODD: dict[str, tuple[bytes, Json, str]] = {
    "nan": (b'{"id":7,"op":"hello","x":NaN}', _BAD, "a number that JSON does not have"),
    "infinity": (b'{"id":7,"op":"hello","x":-Infinity}', _BAD, "a number that JSON does not have"),
    "deep": (
        b'{"id":7,"op":"hello","x":' + b"[" * _DEEP + b"]" * _DEEP + b"}",
        _BAD,
        f"{_DEEP:,} nested arrays",
    ),
    "twice": (b'{"id":7,"id":7,"op":"hello"}', _ANY, "a repeated key"),
    "mark": (b"\xef\xbb\xbf" + _HELLO, _ANY, "a byte order mark"),
    "surrogate": (b'{"id":7,"op":"\\ud800"}', _ANY, "half a surrogate pair"),
    "number.long": (b'{"id":7,"op":"hello","x":' + b"9" * 5000 + b"}", _BAD, "a number with 5,000 digits"),
    "number.large": (b'{"id":7,"op":"hello","x":1e999}', _BAD, "a number that is too large"),
}  # fmt: skip

# name -> (line, expected answer with its id, description)
_READ: dict[str, tuple[bytes, Json, str]] = {
    "op.missing": (b'{"id":7}', _BAD, "no operation"),
    "op.array": (b'{"id":7,"op":["hello"]}', _BAD, "an array as the operation"),
    "op.unknown": (
        b'{"id":7,"op":"reboot"}',
        {"ok": False, "error": "unsupported"},
        "an unknown operation",
    ),
    "key.unknown": (b'{"id":7,"op":"hello","why":1}', _BAD, "an unknown key"),
    "key.long": (
        b'{"id":7,"op":"hello","' + b"x" * _LONG + b'":1}',
        _BAD,
        f"a key with {_LONG:,} letters",
    ),
    "value.long": (
        b'{"id":7,"op":"hello","x":"' + b"x" * _LONG + b'"}',
        _BAD,
        f"a string with {_LONG:,} letters",
    ),
    "protocol.unknown": (
        b'{"id":7,"op":"decode","protocol":"no_such_protocol","hex":"00"}',
        {"ok": False, "error": "unsupported"},
        "an unknown protocol",
    ),
    "protocol.number": (b'{"id":7,"op":"decode","protocol":1,"hex":"00"}', _BAD, "a number as the protocol"),
}  # fmt: skip

_IDS: tuple[int | str, ...] = (
    0,
    -1,
    2**31 - 1,
    "",
    "a",
    "7",
    "é",
    "\N{GRINNING FACE}",
    '"\\/\b\f\n\r\t\x00',
    "x" * 1000,
)


def line_cases(clean: Sequence[Step]) -> Iterator[Case]:
    """Yield the hostile lines, each followed by a request that must be answered correctly.

    :param clean: the requests that follow, one for each protocol. They are also written in unusual ways.
    """
    for name, (raw, about) in _NO_REQUEST.items():
        yield _case(name, about, send(raw, _BAD, None), clean[0])
    yield _case("huge", f"{_HUGE:,} blanks", send(b" " * _HUGE, _BAD, None), clean[0])
    for name, (raw, wanted, about) in _ODD.items():
        yield _case(name, about, send(raw, wanted, None, _ID), clean[0])
    for name, (raw, wanted, about) in _READ.items():
        yield _case(name, about, send(raw, wanted, _ID), clean[0])
    for name, raw, about in _unusual(clean[0].request or {}):
        yield _case(f"unusual.{name}", about, send(raw, clean[0].wanted, _ID), clean[0])


def id_cases(clean: Sequence[Step]) -> Iterator[Case]:
    """Yield requests with unusual ids, which must be echoed."""
    for number, id in enumerate(_IDS):
        request = {"id": id, **(clean[0].request or {})}
        for name, ascii in (("escaped", True), ("plain", False)):
            raw = json.dumps(request, ensure_ascii=ascii).encode("utf-8")
            about = f"the id {json.dumps(id) if len(str(id)) < 50 else 'of 1,000 letters'}"
            yield _case(f"id.{number}.{name}", about, send(raw, clean[0].wanted, id))


def damaged_cases(clean: Sequence[Step], seed: int) -> Iterator[Case]:
    """Yield requests with some bytes changed at random. Any answer is accepted, but there must be one."""
    random = Random(f"damaged {seed}")
    for number in range(_DAMAGED):
        raw = bytearray(random.choice(clean).line(_ID).rstrip(b"\n"))
        for _ in range(random.randint(1, 3)):
            at = random.randrange(len(raw))
            raw[at : at + random.choice((0, 0, 1, 5))] = random.choice(_PIECES)
        step = send(bytes(raw), _ANY, None, *_readable(raw))
        yield _case(f"damaged.{number}", "a request with some bytes changed", step, clean[0])


def _unusual(request: Json) -> Iterator[tuple[str, bytes, str]]:
    """Yield unusual but valid ways to write a request in JSON."""
    said = {"id": _ID, **request}
    raw = json.dumps(said).encode("ascii")
    yield "carriage_return", raw + b"\r", "a carriage return after the request"
    yield (
        "blanks",
        b" \t" + raw.replace(b", ", b" \t,  ").replace(b": ", b"\t : ") + b"  ",
        "blanks",
    )
    yield "no_blanks", json.dumps(said, separators=(",", ":")).encode("ascii"), "no blanks"
    backwards = dict(reversed(said.items()))
    yield "order", json.dumps(backwards).encode("ascii"), "the keys in another order"
    escaped = raw.replace(b'"op"', b'"\\u006f\\u0070"').replace(b'"decode"', b'"\\u0064ecode"')
    yield "escapes", escaped, "letters written as escapes"


def _readable(raw: bytearray) -> tuple[int | str, ...]:
    """Return the possible ids of the answer to a damaged line."""
    try:
        id = json.loads(raw.decode("utf-8"))["id"]
    except (ValueError, LookupError, TypeError, RecursionError):
        return ()
    return (id,) if isinstance(id, (int, str)) else ()


def _case(name: str, about: str, *steps: Step) -> Case:
    return Case(id=f"lines/{name}", group="lines", steps=steps, about=about)
