"""``strain-gauge``: a strain gauge reader reports one signal in all its messages (pages 103, 127 and 129).

The document does not define ``smoothed``. It is taken as a mean of readings, in two's complement, so a signal
at rest has the same value in both.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.outputs.piezo import FULL_SCALE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_MESSAGES: Final = ("PZ_REQ_TSG_READING", "PZ_GET_TSG_READING")
_NEAR: Final = FULL_SCALE // 50
_READINGS: Final = 20
_APART: Final = 0.1
"""Seconds between two readings."""
_SIGN: Final = 0x8000

KIND = Kind(
    name="strain-gauge",
    title="The smoothed reading of a strain gauge follows the reading",
    rules=("tsg-reading", "tsg-reading-range"),
)


def _cases(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        if not place.listed.issuperset(_MESSAGES):
            continue
        for channel in place.channels:
            yield Case(
                name=f"{place.name}/{channel}",
                arguments={"place": place, "channel": channel},
                words={"output": f"channel {channel} of {place.name}"},
                skip=place.why_none(_MESSAGES),
            )


@KIND.check(
    "The smoothed reading of {output} follows its reading",
    messages=_MESSAGES,
    each=_cases,
)
def _run(trial: Trial, place: Target, channel: int) -> None:
    pairs = []
    for _ in range(_READINGS):
        heard = trial.reply(m.PzReqTsgReading(channel), place.address)
        reading, smoothed = heard.message.reading, heard.message.smoothed
        smoothed = (smoothed ^ _SIGN) - _SIGN  # printed as a word
        pairs.append(reading)
        if abs(reading - smoothed) <= _NEAR:
            return
        trial.line.listen(_APART)
    if max(pairs) - min(pairs) > _NEAR:
        trial.inconclusive(f"{place.name} channel {channel}: its signal is not at rest")
        return
    trial.should(
        False,
        f"{place.name} channel {channel}: PZ_GET_TSG_READING has a reading of {reading} and a "
        f"smoothed reading of {smoothed}, although the signal is at rest",
        came=heard.raw,
        rule="tsg-reading",
    )
