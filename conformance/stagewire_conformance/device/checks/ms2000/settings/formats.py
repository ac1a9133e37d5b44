"""The two formats, and the setup commands that switch between them (section 1).

RESET_CONTROLLER is never sent, because it may lose the position. Neither are the commands that set the digits
of WHERE: no documented command reads them, so they could not be restored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Final

from stagewire.protocols import SetupCommand
from stagewire_conformance.device.causes import UNSOLICITED, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis, Clean, asked, line_of
from stagewire_conformance.device.checks.ms2000.broken_rules import rule_of_silence
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Need, Permissions
from stagewire_conformance.device.trial import Trial
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as m

_WAIT: Final = 0.2
"""Seconds in which a reply would arrive."""


def _low_level_again(trial: Trial) -> None:
    clean = Clean(trial)
    _switch(trial, m.SwitchToLowLevel())
    clean.again("after 255 66 in the low-level format")


def _high_level(trial: Trial) -> None:
    """Leave the low-level format, check that its commands do nothing there, and come back."""
    line, clean = line_of(trial), Clean(trial)
    place, request = asked(trial.declared)
    answer = Axis(trial, place).ask(request).pack()
    trial.undo("the low-level format", partial(line.send, m.SwitchToLowLevel()))
    _switch(trial, m.SwitchToHighLevel())
    came = line.ask(request, place.address, _WAIT)
    trial.must(
        came != answer,
        f"after 255 65, which leaves the low-level format, {request.layout.message} was "
        "answered as in that format",
        came=came,
        rule="high-level-switch",
    )
    line.send(m.SwitchToLowLevel())
    line.listen(_WAIT)  # it may have answered text with anything
    clean.again("after 255 65 and 255 66")


def _capital(trial: Trial) -> None:
    """Check that a lower-case letter switches nothing."""
    line, clean = line_of(trial), Clean(trial)
    trial.undo("the low-level format", partial(line.send, m.SwitchToLowLevel()))
    small = bytes((PROTOCOL.marks.prefix, ord("a"), PROTOCOL.marks.terminator))
    line.send_bytes(small, "255 and a lower-case a")
    came = line.listen(_WAIT)
    trial.must(
        not came,
        "255 97 was answered; the letter should be upper-case",
        came=came,
        rule="high-level-switch",
    )
    clean.again("after 255 97, whose letter is lower-case")


def _switch(trial: Trial, command: SetupCommand) -> None:
    line = line_of(trial)
    line.send(command)
    came = line.listen(_WAIT)
    name = command.layout.message
    trial.must(
        not came,
        f"{name} was answered; it should get no reply",
        wanted=b"",
        came=came,
        rule=rule_of_silence(name),
        cause=Cause(name, UNSOLICITED),
    )


_CASES: Final[
    dict[str, tuple[str, Callable[[Trial], None], tuple[str, ...], tuple[str, ...], bool]]
] = {
    "low-level-again": (
        "255 66 in the low-level format changes nothing",
        _low_level_again,
        ("SWITCH_TO_LOW_LEVEL",),
        ("low-level-switch", "setup-prefix"),
        False,
    ),
    "high-level": (
        "255 65 leaves the low-level format, and 255 66 enters it again",
        _high_level,
        ("SWITCH_TO_HIGH_LEVEL", "SWITCH_TO_LOW_LEVEL"),
        ("low-level-only-by-setup", "setup-prefix", "high-level-switch", "low-level-switch"),
        True,
    ),
    "capital-letter": (
        "255 and a lower-case letter switch nothing",
        _capital,
        ("SWITCH_TO_HIGH_LEVEL",),
        ("high-level-switch",),
        True,
    ),
}
"""Name -> title, function, messages, rules, and whether it may switch formats."""


KIND: Final = Kind(
    name="formats",
    title="Setup commands switch from one format to the other and back",
    rules=("low-level-only-by-setup", "setup-prefix", "high-level-switch", "low-level-switch"),
)


def _cases(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    place, request = asked(declared)
    for case, (title, look, messages, rules, switches) in _CASES.items():
        used = (*messages, request.layout.message)
        yield Case(
            name=case,
            words={
                "title": title,
                "effect": "switches to the high-level format for a moment" if switches else "",
            },
            arguments={"look": look},
            messages=used,
            rules=rules,
            needs=frozenset({Need.SETTINGS} if switches else ()),
            skip=place.why_none(used),
        )


@KIND.check("{title}", does="{effect}", seconds=0.6, each=_cases)
def _run(trial: Trial, look: Callable[[Trial], None]) -> None:
    look(trial)
