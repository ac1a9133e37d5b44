"""Commands with errors: they are not answered, and the next valid request is answered (section 2).

A controller must also send nothing without a request: the document has no unsolicited messages.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from random import Random
from typing import Final

from stagewire_conformance.device.causes import UNSOLICITED, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.ms2000.axis import Clean, asked, line_of
from stagewire_conformance.device.checks.ms2000.harmless import END, HARMLESS, harmless_bytes
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.trial import Trial
from stagewire_ms2000 import PROTOCOL

_SECONDS: Final = 0.5


QUIET: Final = Kind(
    name="quiet",
    title="The controller sends nothing unsolicited",
    rules=("no-blanks-in-replies",),
)


@QUIET.check("The controller sends nothing without a request", seconds=_SECONDS)
def _quiet(trial: Trial) -> None:
    came = line_of(trial).listen(_SECONDS)
    trial.must(
        not came,
        f"{len(came)} bytes came within {_SECONDS:g} s without a request; nothing should come",
        came=came,
        rule="no-blanks-in-replies",
        cause=Cause("the line", UNSOLICITED),
    )


_WAIT: Final = 0.1
"""Seconds in which a reply would arrive."""
_PREFIX: Final = bytes((PROTOCOL.marks.prefix,))
_XOFF: Final = 0x13
_LONG: Final = 300
"""More bytes than any buffer for commands of nine bytes must hold."""

Make = Callable[[Declaration, Random], Iterable[bytes]]


def _axis(declared: Declaration) -> bytes:
    return bytes((asked(declared)[0].address,))


def _request(declared: Declaration) -> bytes:
    """Return the bytes of a clean request without its axis."""
    place, request = asked(declared)
    return request.pack(place.address)[1:]


def _unknown_commands(declared: Declaration, random: Random) -> Iterator[bytes]:
    axis = _axis(declared)
    for data in (None, 0, 1, 3, 6):
        size = b"" if data is None else bytes((data,))
        yield axis + harmless_bytes(random, 1) + size + harmless_bytes(random, data or 0) + END


def _unknown_axes(declared: Declaration, random: Random) -> Iterator[bytes]:
    known = {axis["value"] for axis in declared.registry.axes.values()}
    for byte in random.sample(sorted(set(HARMLESS) - known), 4):
        yield bytes((byte,)) + _request(declared)


def _reserved_axes(declared: Declaration, random: Random) -> Iterator[bytes]:
    for axis in declared.registry.axes.values():
        if axis.get("reserved") and axis["value"] != _XOFF:  # this byte would stop the line
            yield bytes((axis["value"],)) + _request(declared)


def _aborted(declared: Declaration, random: Random) -> Iterator[bytes]:
    yield _axis(declared) + END
    yield harmless_bytes(random, 1) + END


def _colons(declared: Declaration, random: Random) -> Iterator[bytes]:
    yield END
    yield END * 3


def _garbage(declared: Declaration, random: Random) -> Iterator[bytes]:
    for count in (1, 2, 5, 40):
        yield harmless_bytes(random, count) + END


def _long_garbage(declared: Declaration, random: Random) -> Iterator[bytes]:
    yield harmless_bytes(random, _LONG) + END
    yield _axis(declared) + harmless_bytes(random, _LONG) + END


def _unknown_setup(declared: Declaration, random: Random) -> Iterator[bytes]:
    for _ in range(2):
        yield _PREFIX + harmless_bytes(random, 1) + END


_CASES: Final[dict[str, tuple[str, str, Make, tuple[str, ...]]]] = {
    "unknown-command": (
        "an unknown command byte",
        "An unknown command is not answered",
        _unknown_commands,
        ("foreign-command-silent", "errors-ignored", "command-identifiers"),
    ),
    "unknown-axis": (
        "a request to an unknown axis",
        "A request to an unknown identifier is not answered",
        _unknown_axes,
        ("errors-ignored", "axis-identifiers"),
    ),
    "reserved-axis": (
        "a request to a reserved identifier",
        "A request to a reserved identifier is not answered",
        _reserved_axes,
        ("reserved-identifiers",),
    ),
    "aborted": (
        "a colon immediately after an axis",
        "A colon instead of the command aborts it",
        _aborted,
        ("colon-after-command-aborts",),
    ),
    "colons": (
        "colons alone",
        "A colon alone is not answered",
        _colons,
        ("clears-on-colon", "errors-ignored"),
    ),
    "garbage": (
        "stray bytes and a colon",
        "Stray bytes up to a colon are not answered",
        _garbage,
        ("clears-on-colon", "errors-ignored"),
    ),
    "long-garbage": (
        f"{_LONG} bytes and a colon",
        "A command that is longer than any valid one is not answered",
        _long_garbage,
        ("clears-on-colon", "errors-ignored"),
    ),
    "unknown-setup": (
        "255 and an unknown setup byte",
        "255 and an unknown setup byte are not answered",
        _unknown_setup,
        ("setup-prefix", "errors-ignored"),
    ),
}
"""Name -> description of the bytes, title, function that makes the bytes, and rules."""


SILENCE: Final = Kind(
    name="silence",
    title="A command with an error is ignored, and the next one is answered",
    rules=tuple(dict.fromkeys(rule for case in _CASES.values() for rule in case[3])),
)


def _cases(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    place, request = asked(declared)
    name = request.layout.message
    for case, (about, title, make, rules) in _CASES.items():
        yield Case(
            name=case,
            words={"title": title},
            arguments={"about": about, "make": make},
            messages=(name,),
            rules=rules,
            skip=place.why_not(name),
        )


@SILENCE.check("{title}", seconds=0.6, each=_cases)
def _silence(trial: Trial, about: str, make: Make) -> None:
    line, clean = line_of(trial), Clean(trial)
    for raw in make(trial.declared, trial.random):
        line.send_bytes(raw, about)
        came = line.listen(_WAIT)
        trial.must(
            not came,
            f"{about} ({_shortly(raw)}) was answered; commands with errors should be ignored",
            wanted=b"",
            came=came,
            rule="errors-ignored",
            cause=Cause(trial.check.partition("/")[0], "answered"),
        )
        clean.again(f"after {about} ({_shortly(raw)})")


def _shortly(raw: bytes) -> str:
    return raw.hex(" ") if len(raw) <= 12 else f"{raw[:8].hex(' ')} … {raw[-1:].hex()}"
