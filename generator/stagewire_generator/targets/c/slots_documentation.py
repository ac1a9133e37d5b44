"""What the comments on commands and replies say."""

from __future__ import annotations

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.targets.c.documentation import markup_of
from stagewire_generator.targets.c.names import Names
from stagewire_generator.targets.c.source import comment
from stagewire_generator.targets.documentation import (
    command_paragraphs,
    errata_of,
    erratum_text,
    sentence,
)

__all__ = ["command_doc", "reply_doc"]


def command_doc(names: Names, protocol: Protocol, message: Message, layout: Layout) -> str:
    """Return the comment on a command or a setup command."""
    markup, id = markup_of(names), f"0x{message.id:02X}"
    if message.kind == "setup":
        prefix = f"0x{protocol.framing['prefix']:02X}"
        first = f"{message.name} ({prefix} {id}), to the controller, two bytes."
    else:
        data = f"{_bytes(layout.length)} of data" if layout.length else "no data"
        slot = "no size slot" if message.size is None else f"size {message.size}"
        first = f"{message.name} ({id}), to the controller, {data}, {slot}."
    refused = f"{names.macro_prefix}_ALLOW_DUMMIES"
    dummy = f"A dummy function: refused unless {refused} is defined."
    return comment([
        first,
        *command_paragraphs(protocol, message, layout, markup, dummy),
        *(erratum_text(erratum, markup) for erratum in errata_of(protocol, message.errata)),
    ])  # fmt: skip


def reply_doc(names: Names, protocol: Protocol, message: Message, layout: Layout) -> str:
    """Return the comment on a reply."""
    markup = markup_of(names)
    of_fields = [slug for field in layout.fields for slug in field.errata]
    return comment([
        f"The reply to {message.name}, to the host, {_bytes(layout.length)}.",
        "It has no frame: only the command that was sent says what its bytes are.",
        sentence(layout.note) if layout.note else "",
        *(erratum_text(erratum, markup) for erratum in errata_of(protocol, of_fields)),
    ])  # fmt: skip


def _bytes(number: int) -> str:
    return f"{number} byte{'s' if number > 1 else ''}"
