"""The status of one channel, asked for where the unit has a question for it, else as it comes by itself."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from stagewire_conformance.device.checks.apt.replies import Request, requests_of
from stagewire_conformance.device.checks.apt.streams import Stream, streams_of
from stagewire_conformance.device.checks.apt.wording import described, raw_of
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial
    from stagewire_conformance.registry import Json


_BITS = "status_bits"
"""The field with the bits, in every message that has some."""


@dataclass(frozen=True)
class ChannelStatus:
    """One channel, and how its status is had.

    :param declared: the controller.
    :param place: where the channel is.
    :param number: of the channel.
    :param stream: the status as it comes by itself.
    :param requests: what can be asked of the channel, by the messages that answer it.
    """

    declared: Declaration
    place: Target
    number: int
    stream: Stream
    requests: Mapping[str, Request]

    @property
    def query(self) -> Request | None:
        """What asks for it; None: it only comes by itself."""
        return self.requests.get(self.stream.status)

    @property
    def messages(self) -> tuple[str, ...]:
        """The messages by which it is had."""
        return self.stream.messages if self.query is None else self.query.messages

    @property
    def skip(self) -> str:
        """Why it cannot be had, which only the PICS can say; empty: it can."""
        return self.stream.skip if self.query is None else self.query.skip

    @cached_property
    def fields(self) -> Mapping[str, Json]:
        """Its fields by name."""
        return self.declared.registry.fields(self.stream.status, "data")

    @cached_property
    def masks(self) -> Mapping[str, int]:
        """The bits that the document names for the unit, by their names."""
        return self._masks_in(self.stream.status)

    def masks_shared_with(self, message: str) -> Mapping[str, int]:
        """Return the bits that another message has under the same names; a stepper has two tables of bits."""
        return dict(self.masks.items() & self._masks_in(message).items())

    def _masks_in(self, message: str) -> dict[str, int]:
        field = self.declared.registry.fields(message, "data")[_BITS]
        table = field.get("flags_by_unit", {}).get(self.place.unit.name, field["flag_table"])
        bits = self.declared.registry.table("flags")[table]["bits"]
        return {name: bit["mask"] for name, bit in bits.items()}

    @property
    def moving(self) -> int:
        """The bits that mean motion; 0 where none do."""
        masks = self.place.unit.moving.items()
        return next(
            (mask for cls, (_, mask) in masks if cls.layout.message == self.stream.status), 0
        )

    @cached_property
    def bits_alone(self) -> str | None:
        """The message that tells the bits and nothing else; None where none is claimed."""
        channel = getattr(self.declared.protocol, "channel", None)
        for answer in self.requests:
            fields = set(self.declared.registry.fields(answer, "data"))
            if fields == {channel, _BITS} and self.claims(answer):
                return answer
        return None

    def claims(self, answer: str) -> bool:
        """Return whether something else can be asked of the channel, by what answers it."""
        return answer in self.requests and not self.requests[answer].skip

    def ask(self, trial: Trial, answer: str) -> Incoming:
        """Ask for something that the channel claims; where nothing comes, that is a FAIL, and the end."""
        return trial.reply(self.requests[answer].message, self.place.address)

    def get(self, trial: Trial) -> Incoming:
        """Return the status as it is now; where none comes, that is a FAIL, and the end of the check."""
        return self.next(trial) if self.query is None else self.ask(trial, self.stream.status)

    def next(self, trial: Trial) -> Incoming:
        """Return the next status that comes by itself; it is started, and stopped again."""
        self.stream.begin(trial)
        came: list[Incoming] = trial.line.listen(1.0, until=self._is_mine)
        self.stream.end(trial)
        trial.line.drain()
        mine = bool(came) and self._is_mine(came[-1])
        if not mine and self.stream.of_it(came) and self.number != self.place.channels[0]:
            trial.inconclusive(
                f"{self.place.name} sends {self.stream.status} of other channels only, which the document "
                "leaves open (it has channel 1)"
            )
            raise EnoughError
        trial.need(
            mine,
            f"{self.stream.start.layout.message} to {self.place.name} was followed by "
            f"{described(trial, came)}; {self.stream.status} of channel {self.number} should have come "
            "within a second",
            came=raw_of(came),
        )
        return came[-1]

    def _is_mine(self, heard: Incoming) -> bool:
        return bool(self.stream.of_it([heard])) and heard.channel == self.number


def statuses_of(declared: Declaration) -> Iterator[ChannelStatus]:
    """Give every channel whose list has a status."""
    for stream in streams_of(declared):
        for number in stream.place.channels:
            requests = {
                answer: request
                for request in requests_of(declared, stream.place)
                if request.channel == number
                for answer in request.answers
            }
            yield ChannelStatus(declared, stream.place, number, stream, requests)
