"""A misbehaving testee for tests: ``python bad_testee.py HOW``.

It answers like the Python testee. HOW selects a function below that changes the timing or adds other output.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator

from stagewire_conformance.testee import Testee

TESTEE = Testee()
TRIGGER = b'"WRITE_TARGET_POSITION"'
"""The message that makes misbehaving testees fail."""


def answer(line: bytes) -> bytes:
    return json.dumps(TESTEE.answer(line)).encode() + b"\n"


def say(data: bytes) -> None:
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()


def lines() -> Iterator[bytes]:
    return iter(sys.stdin.buffer.readline, b"")


def each(act: Callable[[bytes], bytes | None]) -> None:
    """Answer every line. ``act`` may return other bytes to send, or None if it does everything itself."""
    for line in lines():
        other = act(line) if TRIGGER in line else None
        say(answer(line) if other is None else other)


def good() -> None:
    each(lambda line: None)


def crash() -> None:
    def act(line: bytes) -> None:
        print("the stack is gone", file=sys.stderr, flush=True)
        os._exit(3)

    each(act)


def crash_half() -> None:
    def act(line: bytes) -> None:
        say(answer(line)[:10])
        os._exit(4)

    each(act)


def crash_always() -> None:
    say(answer(next(lines())))  # hello
    next(lines())
    os._exit(5)


def crash_after_the_first() -> None:
    """Behave well once; a file records that."""
    mark = sys.argv[2]
    if os.path.exists(mark):
        os._exit(6)
    open(mark, "w").close()
    each(lambda line: os._exit(3))


def hang() -> None:
    each(lambda line: time.sleep(100))


def deaf() -> None:
    """Read nothing after hello, so that the writer's pipe fills up."""
    say(answer(next(lines())))
    time.sleep(100)


def silent() -> None:
    time.sleep(100)


def rubbish() -> None:
    each(lambda line: b"oops\n")


def list_() -> None:
    each(lambda line: b"[1]\n")


def not_utf_8() -> None:
    each(lambda line: b'{"id":"\xff"}\n')


def not_a_number() -> None:
    each(lambda line: b'{"id":NaN,"ok":true}\n')


def deep() -> None:
    each(lambda line: b'{"x":' * 100_000 + b"1" + b"}" * 100_000 + b"\n")


def endless() -> None:
    say(answer(next(lines())))
    while True:
        say(b"y\n" * 1000)


def backwards() -> None:
    """Answer all waiting lines in reverse order."""
    rest = b""
    while data := os.read(0, 1 << 20):
        *whole, rest = (rest + data).split(b"\n")
        say(b"".join(answer(line + b"\n") for line in reversed(whole)))


def late() -> None:
    """Delay one answer until the next."""
    kept: list[bytes] = []

    def act(line: bytes) -> bytes:
        kept.append(answer(line))
        return b"" if len(kept) == 1 else b"".join(kept)

    each(act)


def twice() -> None:
    each(lambda line: answer(line) * 2)


def banner() -> None:
    print("Welcome!", flush=True)
    good()


def chatty() -> None:
    def act(line: bytes) -> None:
        for number in range(2000):
            print(f"line {number} of output that is not read", file=sys.stderr)

    each(act)
    sys.stderr.flush()


def chatty_crash() -> None:
    def act(line: bytes) -> None:
        for number in range(2000):
            print(f"line {number} of output that is not read", file=sys.stderr)
        print("at last", file=sys.stderr, flush=True)
        os._exit(7)

    each(act)


def slow() -> None:
    each(lambda line: time.sleep(0.05))


def stays() -> None:
    """Keep running after the input ends."""
    good()
    time.sleep(100)


def carriage_returns() -> None:
    for line in lines():
        say(answer(line)[:-1] + b"\r\n")


def other_version() -> None:
    for line in lines():
        say(json.dumps({**json.loads(answer(line)), "testee": 2}).encode() + b"\n")


def decodes_alone() -> None:
    for line in lines():
        said = json.loads(answer(line))
        if "operations" in said:
            said["operations"] = ["hello", "decode"]
        say(json.dumps(said).encode() + b"\n")


def refuses_hello() -> None:
    for _ in lines():
        say(b'{"id":0,"ok":false,"error":"unsupported","detail":"who asks?"}\n')


def crash_at_once() -> None:
    os._exit(9)


def steers() -> None:
    each(lambda line: b"\x1b[31m\x07\n")


def steers_at_once() -> None:
    print("\x1b[31m", file=sys.stderr, flush=True)
    say(b"\x1b[31m\n")


def speaks_one() -> None:
    for line in lines():
        said = json.loads(answer(line))
        if "protocols" in said:
            said["protocols"] = ["asi_ms2000"]
        say(json.dumps(said).encode() + b"\n")


if __name__ == "__main__":
    globals()[sys.argv[1]]()
