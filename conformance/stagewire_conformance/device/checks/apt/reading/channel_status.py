"""The status of one channel: requested if the unit has a request for it, otherwise the periodic one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from stagewire_conformance.device.causes import DELIVERY, Cause, silence
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_stray
from stagewire_conformance.device.checks.apt.replies import Request, requests_of
from stagewire_conformance.device.checks.apt.streams import Stream, streams_of
from stagewire_conformance.device.checks.apt.wording import described, joined, raw_of
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial
    from stagewire_conformance.registry import Json


_BITS = "status_bits"
"""The field with the bits, in every message that has one."""


@dataclass(frozen=True)
class ChannelStatus:
    """One channel, and how to read its status.

    :param declared: the declaration of the controller.
    :param place: the target that has the channel.
    :param number: the number of the channel.
    :param stream: the periodic status.
    :param requests: the requests for the channel, by the messages that answer them.
    """

    declared: Declaration
    place: Target
    number: int
    stream: Stream
    requests: Mapping[str, Request]

    @property
    def query(self) -> Request | None:
        """The request for the status; None if the status is only periodic."""
        return self.requests.get(self.stream.status)

    @property
    def messages(self) -> tuple[str, ...]:
        """The messages used to read the status."""
        return self.stream.messages if self.query is None else self.query.messages

    @property
    def skip(self) -> str:
        """Why the status cannot be read, which only the PICS can decide; empty if it can."""
        return self.stream.skip if self.query is None else self.query.skip

    @cached_property
    def fields(self) -> Mapping[str, Json]:
        """The fields of the status by name."""
        return self.declared.registry.fields(self.stream.status, "data")

    @cached_property
    def masks(self) -> Mapping[str, int]:
        """The masks of the bits that the document defines for the unit, by name."""
        return self._masks_in(self.stream.status)

    def masks_shared_with(self, message: str) -> Mapping[str, int]:
        """Return the bits that another message has under the same names: a stepper has two tables of bits."""
        return dict(self.masks.items() & self._masks_in(message).items())

    def _masks_in(self, message: str) -> dict[str, int]:
        field = self.declared.registry.fields(message, "data").get(_BITS)
        if field is None:  # such as the status of four channels in one message
            return {}
        table = field.get("flags_by_unit", {}).get(self.place.unit.name, field["flag_table"])
        bits = self.declared.registry.table("flags")[table]["bits"]
        return {name: bit["mask"] for name, bit in bits.items()}

    @property
    def moving(self) -> int:
        """The mask of the bits that mean motion; 0 if there are none."""
        masks = self.place.unit.moving.items()
        return next(
            (mask for cls, (_, mask) in masks if cls.layout.message == self.stream.status), 0
        )

    @cached_property
    def bits_alone(self) -> str | None:
        """The message that has the status bits only; None if none is claimed."""
        named = {getattr(self.declared.protocol, "channel", None)} & self.fields.keys()
        for answer in self.requests:
            fields = self.declared.registry.fields(answer, "data")
            told = {name for name, field in fields.items() if field["role"] == "value"}
            if told == {*named, _BITS} and self.claims(answer):
                return answer
        return None

    def claims(self, answer: str) -> bool:
        """Return whether the channel claims the request that this message answers."""
        return answer in self.requests and not self.requests[answer].skip

    def ask(self, trial: Trial, answer: str) -> Incoming:
        """Send a claimed request, and return the reply. No reply is a FAIL and ends the check."""
        return trial.reply(self.requests[answer].message, self.place.address)

    def get(self, trial: Trial) -> Incoming:
        """Return the current status. No status is a FAIL and ends the check."""
        return self.next(trial) if self.query is None else self.ask(trial, self.stream.status)

    def next(self, trial: Trial) -> Incoming:
        """Start the periodic status, return the next one, and stop it."""
        self.stream.begin(trial)
        came: list[Incoming] = trial.line.listen(1.0, until=self._is_mine)
        self.stream.end(trial)
        trial.line.drain()
        mine = bool(came) and self._is_mine(came[-1])
        if not mine and self.stream.of_it(came) and self.number != self.place.channels[0]:
            trial.inconclusive(
                f"{self.place.name} sends {self.stream.status} for other channels only; the "
                "document describes it for channel 1 and leaves the others open"
            )
            raise EnoughError
        trial.need(
            mine,
            f"after {self.stream.start.layout.message} to {self.place.name}: expected "
            f"{self.stream.status} for channel {self.number} within a second, received "
            f"{described(trial, came)}",
            came=raw_of(came),
            rule=next(
                (rule_of_stray(trial, each) for each in joined(came) if each.kind != "message"),
                "request-answered",
            ),
            cause=trial.likely(Cause(self.stream.status, DELIVERY), silence(self.place.name)),
        )
        return came[-1]

    def _is_mine(self, heard: Incoming) -> bool:
        return bool(self.stream.of_it([heard])) and heard.channel in (self.number, None)


def statuses_of(declared: Declaration) -> Iterator[ChannelStatus]:
    """Yield every channel that has a status."""
    for stream in streams_of(declared):
        alone = len(stream.place.channels) == 1  # messages that name no channel then concern it
        for number in stream.place.channels:
            requests = {
                answer: request
                for request in requests_of(declared, stream.place)
                if request.channel == number or (alone and request.channel is None)
                for answer in request.answers
            }
            yield ChannelStatus(declared, stream.place, number, stream, requests)
