"""Whether messages and commands fit the framing of their protocol."""

from __future__ import annotations

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.framing import rules_of
from stagewire_generator.model import Protocol
from stagewire_generator.strict_yaml import Document

_SHOWN = {"message": "a message", "command": "a command", "setup": "a setup command"}


def check_framing(protocol: Protocol, head: Document, diagnostics: Diagnostics) -> None:
    """Check the kind of every message, and what a framing asks of itself and of the messages.

    :param head: the file of the protocol, for the places of what is wrong in it.
    """
    kind = protocol.framing["kind"]
    rules = rules_of(kind)
    for message in protocol.messages:
        if message.kind not in rules.kinds:
            what = f"{message.name} is {_SHOWN[message.kind]}, and the framing has kind {kind}"
            diagnostics.add(message.place, "SW038", what)
    rules.check(protocol, head, diagnostics)
