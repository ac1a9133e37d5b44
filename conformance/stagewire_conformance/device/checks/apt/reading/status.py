"""Checks that the status of a channel is well-formed, and agrees with other replies."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import MOTION_AT_REST, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_status
from stagewire_conformance.device.checks.apt.reading.agreement import (
    CLOSED_LOOP,
    POSITION,
    Look,
    agreements,
    looks_at_rest,
)
from stagewire_conformance.device.checks.apt.reading.channel_status import (
    ChannelStatus,
    statuses_of,
)
from stagewire_conformance.device.checks.apt.replies import ask_all, judge_answer, judge_message

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_TRIES: Final = 4
_EXCLUSIVE: Final = (
    ("moving_forward", "moving_reverse"),
    ("jogging_forward", "jogging_reverse"),
    ("moving_forward", "settled"),
    ("moving_reverse", "settled"),
)
"""Bits that exclude each other (pages 66, 77 and 79)."""

_BITS: Final = "status_bits"
_SWITCHES: Final = ("forward_hardware_limit", "reverse_hardware_limit")
"""Switches at the two ends, which a stage cannot reach at the same time."""


KIND = Kind(
    name="status",
    title="The status of a channel is well-formed, and agrees with the other replies",
    rules=(
        "updates-requestable",
        "updates-content",
        "status-updates-position",
        "status-requested",
        "status-answer",
        "status-instead-of-updates",
        "status-always-chan1",
        "status-position",
        "status-bits-meaning",
        "status-bits-motion",
        "status-bits-limits",
        "dc-status-requested",
        "dc-status-answer",
        "dc-status-always-chan1",
        "dc-status-position",
        "dc-status-velocity",
        "dc-status-bits",
        "dc-status-bits-motion",
        "dc-status-bits-limits",
        "status-bits-alone",
        "status-bits-same",
        "at-rest-unchanged",
        "settled-at-rest",
        "position-counter-absolute",
        "piezo-status-bits-meaning",
        "piezo-update-content",
        "piezo-update-always-chan1",
        "piezo-update-voltage",
        "piezo-update-position",
    ),
)


def _channels(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for channel in statuses_of(declared):
        if "status_bits" not in channel.fields and len(channel.place.channels) > 1:
            continue  # one status with numbered fields for all channels
        others = [name for name in (POSITION, CLOSED_LOOP) if channel.claims(name)]
        if channel.bits_alone is not None:
            others.append(channel.bits_alone)
        compared = [name for answer in others for name in channel.requests[answer].messages]
        yield Case(
            name=f"{channel.place.name}/{channel.number}",
            arguments={"channel": channel},
            messages=(*channel.messages, *channel.stream.messages, *compared),
            skip=channel.skip,
        )


@KIND.check(
    "The status of channel {channel.number} at {channel.place.name} agrees with the other replies",
    seconds=0.6,
    each=_channels,
)
def _run(trial: Trial, channel: ChannelStatus) -> None:
    status = _first(trial, channel)
    if status is None:
        return
    _judge_contradictions(trial, channel, status)
    for look in (*agreements(channel), *looks_at_rest(channel)):
        agree(trial, channel, look)


def _first(trial: Trial, channel: ChannelStatus) -> Incoming | None:
    """Return the status, and report what is wrong with its layout, addresses and channel."""
    if channel.query is not None:
        return judge_answer(trial, channel.query, ask_all(trial, channel.query))
    status = channel.get(trial)
    judge_message(trial, channel.place, channel.number, status)
    return status


def _judge_contradictions(trial: Trial, channel: ChannelStatus, status: Incoming) -> None:
    if not channel.masks:  # such as the status of four channels in one message
        return
    bits = status.message.status_bits
    for pair in _EXCLUSIVE:
        trial.must(
            not all(bits & channel.masks.get(name, 0) for name in pair),
            f"{status.name}: the status bits {bits:#010x} report {' and '.join(pair)} at "
            "the same time; they exclude each other",
            came=status.raw,
            rule="settled-at-rest" if "settled" in pair else _rule(channel, "bits-motion"),
            cause=Cause(status.name, "exclusive bits"),
        )
    trial.should(
        not all(bits & channel.masks.get(name, 0) for name in _SWITCHES),
        f"{status.name}: the status bits {bits:#010x} report both limit switches as active; a "
        "stage cannot be at both ends (ignore this if no stage is connected)",
        came=status.raw,
        rule=_rule(channel, "bits-limits"),
        cause=Cause(status.name, "limit switches"),
    )


def agree(trial: Trial, channel: ChannelStatus, look: Look) -> None:
    """Repeat a comparison until it agrees. A persistent difference is a FAIL."""
    found = None
    for _ in range(_TRIES):
        found = look(trial, channel)
        if found is None:
            return
    assert found is not None
    trial.must(
        False,
        f"{found.text} (seen {_TRIES} times in a row)",
        came=found.came,
        rule=_rule_of_difference(channel, found.aspect),
        cause=Cause(found.text.removeprefix("periodic ").partition(" ")[0], found.aspect),
        because=() if found.aspect == _BITS else (Cause(channel.bits_alone or "", _BITS),),
    )


def _rule(channel: ChannelStatus, what: str) -> str:
    """Return a rule about the status of motors or of piezo actuators."""
    if channel.stream.status.startswith("PZ_"):
        return "piezo-status-bits-meaning"
    return rule_of_status(channel.place, what)


def _rule_of_difference(channel: ChannelStatus, aspect: str) -> str:
    """Return the rule about a difference between the status and another reply."""
    is_piezo = channel.stream.status.startswith("PZ_")
    rules = {
        "position": _rule(channel, "position"),
        "status_bits": "piezo-status-bits-meaning" if is_piezo else "status-bits-same",
        "channel_enabled": "piezo-status-bits-meaning" if is_piezo else "dc-status-bit-enabled",
        "closed_loop": "piezo-status-bits-meaning",
        MOTION_AT_REST: _rule(channel, "bits-motion"),
        "velocity at rest": "dc-status-velocity",
    }
    return rules[aspect]
