"""Fuzzing inputs for commands: real ones and damaged ones, like those for messages in ``streams.py``."""

from __future__ import annotations

from random import Random

from stagewire.protocols import Command, SetupCommand
from stagewire_ms2000 import PROTOCOL

COMMAND_CONTROLS = 4
"""Control bytes before a stream: chunk sizes (two bytes), first request, when the host gives up."""

COMMANDS = tuple(cls for cls in PROTOCOL.messages if issubclass(cls, Command))
SETUP_COMMANDS = tuple(cls for cls in PROTOCOL.messages if issubclass(cls, SetupCommand))
AXES = tuple(PROTOCOL.axes.values())
INTERESTING = (0x00, 0x03, 0x18, 0x3A, 0x3F, 0x41, 0x54, 0xFF)
LONG = 120


def _byte(rng: Random) -> int:
    return rng.choice(INTERESTING) if rng.random() < 0.7 else rng.randrange(256)


def command(rng: Random) -> bytes:
    """Return one command, usually whole and valid."""
    if rng.random() < 0.1:
        return rng.choice(SETUP_COMMANDS)().pack()
    layout = rng.choice(COMMANDS).layout
    axis = rng.choice(AXES) if rng.random() < 0.9 else _byte(rng)
    size = layout.size or 0
    kind = rng.random()
    if kind < 0.1:
        return bytes((axis, layout.id, PROTOCOL.marks.terminator))
    if kind < 0.15:
        size = _byte(rng)
    data = bytes(_byte(rng) for _ in range(layout.length))
    count = rng.choice((0,) * 9 + (1, 2, 250, 256, 300))
    # A long run of different bytes would probably contain a terminator.
    extra = bytes((_byte(rng),)) * count if count > 2 else bytes(_byte(rng) for _ in range(count))
    return bytes((axis, layout.id, size)) + data + extra + bytes((PROTOCOL.marks.terminator,))


def beginnings() -> list[bytes]:
    """Return the inputs a fuzzer starts from."""
    rng = Random(0)
    return [new_commands(rng) for _ in range(200)]


def new_commands(rng: Random) -> bytes:
    """Return control bytes and a few consecutive commands, some of them damaged."""
    made = b"".join([command(rng) for _ in range(rng.choice((0, 1, 1, 2, 4, 8)))])
    for _ in range(rng.choice((0, 0, 1, 2))):
        made = _damaged(rng, made)
    return rng.randbytes(COMMAND_CONTROLS) + made


def change_commands(rng: Random, data: bytes) -> bytes:
    """Return an input with its control bytes or its stream changed."""
    if rng.random() < 0.1:
        return new_commands(rng)
    controls, body = data[:COMMAND_CONTROLS].ljust(COMMAND_CONTROLS, b"\0"), data[COMMAND_CONTROLS:]
    if rng.random() < 0.2:
        controls = rng.randbytes(COMMAND_CONTROLS)
    # Most mutations lengthen the stream, and long streams are slow.
    if len(body) > LONG and rng.random() < 0.7:
        return controls + body[: rng.randrange(len(body))]
    return controls + _damaged(rng, body)


def _damaged(rng: Random, data: bytes) -> bytes:
    """Return ``data`` with one mutation."""
    at = rng.randrange(len(data) + 1)
    rest = at + rng.choice((0, 1, 1, 2, 4))
    kind = rng.randrange(4)
    if kind == 0:
        return data[:at] + data[rest:]
    if kind == 1:
        return data[:rest] + data[at:]
    if kind == 2:
        return data[:at] + command(rng) + data[rest:]
    return (
        data[:at] + bytes(_byte(rng) for _ in range(rng.choice((1, 1, 1, 2, 5)))) + data[at + 1 :]
    )
