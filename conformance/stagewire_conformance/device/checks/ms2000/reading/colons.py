"""The end of a command: the colon after its data, however late it comes (section 2)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis, asked
from stagewire_conformance.device.checks.ms2000.axis_check import requests_of
from stagewire_conformance.device.checks.ms2000.harmless import END, harmless_bytes
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.targets import Target
from stagewire_conformance.device.trial import Trial

_WAIT: Final = 0.2
"""Seconds in which a reply would arrive."""
_LUDL: Final = 2.2
"""Seconds: more than the time-out of the controllers that this one imitates; this one has none."""

Look = Callable[[Axis, Command], None]


def _ignored_rest(axis: Axis, request: Command) -> None:
    plain = axis.ask(request)
    for count in (1, 3, 40):
        rest = harmless_bytes(axis.trial.random, count)
        _same(axis, plain.pack(), request, rest, f"{count} bytes before the colon")


def _rest_is_a_command(axis: Axis, request: Command) -> None:
    """Check that a command without its colon absorbs the next one, and is answered alone."""
    plain = axis.ask(request)
    second = request.pack(axis.address)[:-1]
    _same(axis, plain.pack(), request, second, "a second command before the colon")


def _same(axis: Axis, plain: bytes, request: Command, rest: bytes, about: str) -> None:
    axis.line.send(request, axis.address, extra=rest)
    came = axis.line.hear(request)
    axis.trial.must(
        came == plain,
        f"{request.layout.message} of axis {axis.name} with {about} was not answered as "
        "without; these bytes should be ignored",
        wanted=plain,
        came=came,
        rule="ignored-before-colon",
        cause=Cause("colon", "bytes before it"),
    )


def _missing(axis: Axis, request: Command) -> None:
    _paused(axis, request, request.pack(axis.address)[:-1], _WAIT, "without its colon")
    for each in requests_of(axis.trial.declared).values():
        name = each.layout.message
        if name != request.layout.message and not axis.place.why_not(name):
            _unheard(axis, each, each.pack(axis.address)[:-1], _WAIT, "without its colon")
            axis.line.send_bytes(END, f"the colon of {name}")
            axis.exact(each, axis.line.hear(each))


def _no_time_out(axis: Axis, request: Command) -> None:
    _paused(axis, request, request.pack(axis.address)[:2], _LUDL, "with only half of its bytes")


def _paused(axis: Axis, request: Command, begun: bytes, pause: float, what: str) -> None:
    plain = axis.ask(request)
    rest = request.pack(axis.address)[len(begun) :]
    name = request.layout.message
    _unheard(axis, request, begun, pause, what)
    axis.line.send_bytes(rest, f"the rest of {name}")
    came = axis.line.hear(request)
    axis.trial.must(
        came == plain.pack(),
        f"{name} of axis {axis.name}, completed {pause:g} s later, was not answered as usual; "
        "commands have no time-out",
        wanted=plain.pack(),
        came=came,
        rule="no-timeout",
        cause=Cause("colon", "completion"),
    )


def _unheard(axis: Axis, request: Command, begun: bytes, pause: float, what: str) -> None:
    """Send the beginning of a request, and check that it is not answered."""
    name = request.layout.message
    axis.line.send_bytes(begun, f"the beginning of {name}")
    came = axis.line.listen(pause)
    axis.trial.need(
        not came,
        f"{name} of axis {axis.name}, {what}, was answered; it should be answered only "
        "after its colon",
        wanted=b"",
        came=came,
        rule="not-recognised-before-colon",
        cause=Cause("colon", "without it"),
    )


def _behind_garbage(axis: Axis, request: Command) -> None:
    """Check that a colon clears the buffers, so that the next bytes are a command."""
    plain = axis.ask(request)
    garbage = harmless_bytes(axis.trial.random, 5)
    axis.line.send_bytes(
        garbage + END + request.pack(axis.address), "stray bytes, a colon, a request"
    )
    came = axis.line.hear(request)
    axis.trial.must(
        came == plain.pack(),
        f"{request.layout.message} of axis {axis.name}, immediately after stray bytes and a "
        "colon, was not answered as usual; a colon should clear the buffers",
        wanted=plain.pack(),
        came=came,
        rule="clears-on-colon",
        cause=Cause("colon", "buffers"),
        because=(Cause("silence", "answered"), Cause("silence", "recovery")),
    )


_CASES: Final[dict[str, tuple[str, Look, tuple[str, ...], float]]] = {
    "missing": (
        "A request is answered after its colon, and not before",
        _missing,
        ("not-recognised-before-colon", "commands-processed-at-colon", "ends-with-colon"),
        2.5,
    ),
    "no-time-out": (
        f"A request with a pause of {_LUDL:g} s between its bytes is answered",
        _no_time_out,
        ("no-timeout",),
        2.4,
    ),
    "ignored-rest": (
        "Bytes between the size and the colon of a request are ignored",
        _ignored_rest,
        ("ignored-before-colon",),
        0.3,
    ),
    "rest-is-a-command": (
        "A second command before the colon is ignored",
        _rest_is_a_command,
        ("ignored-before-colon", "ends-with-colon"),
        0.2,
    ),
    "behind-garbage": (
        "A request immediately after stray bytes and a colon is answered",
        _behind_garbage,
        ("clears-on-colon",),
        0.2,
    ),
}
"""Name -> title, function, rules, and approximate duration."""


KIND: Final = Kind(
    name="colon",
    title="A command ends at its colon",
    rules=tuple(dict.fromkeys(rule for case in _CASES.values() for rule in case[2])),
)


def _cases(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    place, request = asked(declared)
    name = request.layout.message
    for case, (title, look, rules, seconds) in _CASES.items():
        yield Case(
            name=case,
            words={"title": title},
            arguments={"place": place, "request": request, "look": look},
            messages=(name,),
            rules=rules,
            skip=place.why_not(name),
            seconds=seconds,
        )


@KIND.check("{title}", each=_cases)
def _run(trial: Trial, place: Target, request: Command, look: Look) -> None:
    look(Axis(trial, place), request)
