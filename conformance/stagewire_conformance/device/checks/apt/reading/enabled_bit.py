"""``enabled-bit``: the status of a channel reports whether the channel is enabled.

If the two contradict each other, either can be wrong. So this check runs after ``enable``, which switches the
channel and thus shows a wrong state. Without permission for motion, this check runs alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.enable_state import ENABLING
from stagewire_conformance.device.checks.apt.reading.agreement import ENABLED, enabled
from stagewire_conformance.device.checks.apt.reading.channel_status import (
    ChannelStatus,
    statuses_of,
)
from stagewire_conformance.device.checks.apt.reading.status import agree

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial

KIND = Kind(
    name="enabled-bit",
    title="The status reports whether a channel is enabled",
    rules=("dc-status-bit-enabled", "piezo-status-bits-meaning"),
)


def _channels(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for channel in statuses_of(declared):
        if channel.claims(ENABLED) and "channel_enabled" in channel.masks:
            yield Case(
                name=f"{channel.place.name}/{channel.number}",
                arguments={"channel": channel},
                messages=(*channel.messages, *channel.requests[ENABLED].messages),
                skip=channel.skip,
            )


@KIND.check(
    "The status of channel {channel.number} at {channel.place.name} has the enabled bit of its state",
    seconds=0.1,
    each=_channels,
)
def _run(trial: Trial, channel: ChannelStatus) -> None:
    trial.depends_on(*ENABLING)
    agree(trial, channel, enabled)
