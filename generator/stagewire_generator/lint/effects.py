"""Effects: nothing may move because nobody said that it does."""

from __future__ import annotations

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.model import Message, Protocol

__all__ = ["check_effects"]


def check_effects(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check that every message to a controller has an effect, and one that fits its exchange.

    Of a parameter set it is that of the SET: a REQ asks, and a GET has none.
    """
    messages = {message.name: message for message in protocol.messages}
    for message in protocol.messages:
        if message.direction == "to_host" and message.effect:
            what = f"{message.name} has an effect, and only the controller sends it"
            diagnostics.add(message.place, "SW070", what, "remove it")
        elif message.direction != "to_host" and not message.effect:
            diagnostics.add(message.place, "SW070", f"{message.name} does not say its effect")
        _halts(message, messages, diagnostics)


def _halts(message: Message, messages: dict[str, Message], diagnostics: Diagnostics) -> None:
    """Check that what is halted moves something, and that what halts it stops."""
    halts = [messages[name] for name in message.exchange.get("halted_by", ()) if name in messages]
    if halts and message.effect not in ("", "motion"):
        what = f"{message.name} is halted by {halts[0].name}, and its effect is {message.effect}"
        diagnostics.add(message.place, "SW071", what)
    for halt in halts:
        if halt.effect not in ("", "stop"):
            what = f"{halt.name} halts {message.name}, and its effect is {halt.effect}"
            diagnostics.add(halt.place, "SW071", what)
