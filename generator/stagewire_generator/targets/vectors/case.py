"""One case: what a testee is asked, and what it has to answer."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Json, Layout, Message


@dataclass(frozen=True, slots=True)
class Case:
    """A request of the testee protocol and its answer, made without any encoder of ours.

    :param id: unique in its protocol; it stays what it is as long as what it names does.
    :param about: what it looks at, in a few words; empty where the id says it.
    :param request: without ``id`` and ``protocol``, which the asker adds.
    :param answer: without ``id``; a refusal has no ``detail``, which is for people.
    :param message: the message that it is about, if it is about one.
    :param layout: the layout that is encoded or decoded, or would be if it was not refused; None where
        the request leads to none.
    """

    id: str
    about: str
    request: Json
    answer: Json
    message: Message | None = None
    layout: Layout | None = None

    @property
    def operation(self) -> str:
        """What is asked for: ``encode``, ``decode`` or ``stream``; what else where that is the case."""
        return str(self.request.get("op", ""))

    @property
    def refusal(self) -> str:
        """The code with which it is refused; empty where it is not."""
        return str(self.answer.get("error", ""))

    @property
    def raw(self) -> bytes | None:
        """The bytes that are decoded, or that an encoder makes; None for other cases."""
        holder = self.request if self.operation == "decode" else self.answer
        text = holder.get("hex")
        try:
            return None if text is None else bytes.fromhex(text)
        except ValueError:
            return None  # it is what the case is about

    @property
    def fields(self) -> Json:
        """The values by field that are encoded, or that a decoder finds; empty for other cases."""
        holder = self.request if self.operation == "encode" else self.answer
        fields: Json = holder.get("fields", {})
        return fields
