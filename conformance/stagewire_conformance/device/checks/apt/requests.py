"""The requests of a place: what can be asked without changing anything, as the registry has it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from stagewire.protocols import FramedMessage

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.targets import Target


@dataclass(frozen=True)
class Request:
    """One question.

    :param name: of the message.
    :param place: who is asked.
    :param channel: about which; None: the message names none.
    :param answers: the messages that answer it.
    :param message: the question.
    """

    name: str
    place: Target
    channel: int | None
    answers: tuple[str, ...]
    message: FramedMessage

    @property
    def about(self) -> str:
        """What is asked whom, for a sentence: ``MOT_REQ_VELPARAMS for channel 1 to 0x50``."""
        channel = "" if self.channel is None else f" for channel {self.channel}"
        return f"{self.name}{channel} to {self.place.name}"

    @property
    def id(self) -> str:
        """What distinguishes it in the id of a check: ``0x50/MOT_REQ_VELPARAMS/1``."""
        channel = "" if self.channel is None else f"/{self.channel}"
        return f"{self.place.name}/{self.name}{channel}"

    @property
    def messages(self) -> tuple[str, ...]:
        """It and what answers it."""
        return self.name, *self.answers

    @property
    def skip(self) -> str:
        """Why it is not asked, which only the PICS can say; empty: it is."""
        return next((why for name in self.messages if (why := self.place.why_not(name))), "")


def requests_of(declared: Declaration, place: Target) -> Iterator[Request]:
    """Give every request in the list of a place, channel by channel, in the order of the registry.

    Those that the PICS takes back are among them, see :attr:`Request.skip`.
    """
    for name, entry in declared.registry.messages.items():
        if (
            name in place.listed
            and entry["effect"] == "none"
            and "answered_by" in entry["exchange"]
        ):
            for channel in place.channels if _names_channel(declared, name) else (None,):
                yield ask_for(declared, place, name, channel)


def a_request(declared: Declaration, place: Target, names: Iterable[str] = ()) -> Request | None:
    """Return a request that a place claims: the first of ``names``, or else any; None where there is none."""
    claimed = [each for each in requests_of(declared, place) if not each.skip]
    chosen = [each for name in names for each in claimed if each.name == name]
    return next(iter([*chosen, *claimed]), None)


def ask_for(declared: Declaration, place: Target, name: str, channel: int | None = None) -> Request:
    """Make one request."""
    answers = tuple(declared.registry.messages[name]["exchange"]["answered_by"])
    return Request(name, place, channel, answers, declared.request(name, channel))


def _names_channel(declared: Declaration, name: str) -> bool:
    field = getattr(declared.protocol, "channel", None)
    return field in declared.protocol.message_class(name).layout.fields
