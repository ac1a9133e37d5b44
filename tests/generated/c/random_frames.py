"""Random protocols with a header framing, for the parser, which uses only a few of their properties."""

from __future__ import annotations

from dataclasses import replace
from random import Random

from checkout import SMALL_SPECS
from stagewire._framings.header.table import shared_forms
from stagewire.framing import Forms, FramingTable
from stagewire.protocols import Direction
from stagewire_generator import check
from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.model_fields import Field, Format

INVENTED = 4
GOOD_SPEC = SMALL_SPECS / "good_spec"
DIRECTIONS = {
    "to_host": Direction.TO_HOST,
    "to_controller": Direction.TO_CONTROLLER,
    "both": Direction.BOTH,
}
# A low address, runs of addresses, the highest address; the host has another one.
ADDRESSES = (
    (0x01, [0x11, *range(0x21, 0x2B), 0x50]),
    (0x00, [0x01, 0x02, 0x03, 0x7F]),
    (0x7F, [*range(0x10)]),
    (0x50, [0x51]),
)


SUB_MESSAGES = (0, 1, 2, 6, 0xFF, 0x100, 0xFFFF)


def invent(rng: Random) -> Protocol:
    """Return a protocol with random ids, forms, lengths and addresses."""
    [base] = check(GOOD_SPEC)
    host, devices = rng.choice(ADDRESSES)
    ids = sorted(rng.sample([*range(0x10), *range(0x400, 0x430), 0xFFFE, 0xFFFF], 40))
    messages = []
    for id in ids:
        messages += _messages(rng, base.messages[0], id)
    framing = {**base.framing, "host": host, "devices": devices}
    return replace(
        base, messages=tuple(messages), framing=framing, examples={}, captures={}, errata=()
    )


def _messages(rng: Random, like: Message, id: int) -> list[Message]:
    """Return the message of an id, or several that share it."""
    only = _message(rng, like, id)
    found = []
    for value in sorted(rng.sample(SUB_MESSAGES, rng.choice((0, 0, 1, 2, 4)))):
        of = _message(rng, like, id)
        layouts = tuple(
            layout
            for layout in of.layouts
            if layout.length > 1 or (layout.form == "header" and value <= 0xFF)
        )
        if layouts:
            name, words = f"{of.name}_{value}", (*of.words, str(value))
            kept = {"direction": only.direction, "layouts": layouts, "sub_message": value}
            found.append(replace(of, name=name, words=words, **kept))
    return found or [only]


def _message(rng: Random, like: Message, id: int) -> Message:
    lengths = sorted(rng.sample([1, 2, 4, 6, 12, 14, 20, 100, 255], rng.choice((0, 1, 1, 2, 3))))
    has_header = rng.random() < 0.5
    layouts: list[Layout] = []
    blank = replace(like.layouts[0], param1=None, param2=None, fields=(), when={}, only_zero=False)
    if has_header:
        only_zero = rng.random() < 0.3
        layouts.append(replace(blank, form="header", length=0, only_zero=only_zero))
    for length in lengths:
        form = "data" if len(lengths) == 1 else f"data:of{length}"
        layouts.append(replace(blank, form=form, length=length, fields=(_content(like, length),)))
    return replace(
        like,
        name=f"INVENTED_{id:04X}",
        id=id,
        words=("invented", f"{id:04x}"),
        direction=rng.choice([*DIRECTIONS]),
        layouts=tuple(layouts),  # no layout: undocumented
        set=None,
        exchange={},
        errata=(),
        without_flag="a program sends it so" if rng.random() < 0.2 else "",
    )


def _content(like: Message, length: int) -> Field:
    """Return a field of ``size`` bytes."""
    format = Format(f"byte[{length}]", length, False, "bytes")
    plain = {"enum": None, "quantity": None, "flags": None, "default": None, "constant": None}
    field = replace(like.layouts[0].fields[0], name="content", offset=0, format=format, **plain)
    return replace(field, role="value", minimum=0, maximum=0, ranged=False)


def table_of(protocol: Protocol) -> FramingTable:
    """Return the properties of a protocol that the Python framer needs."""
    forms = {}
    shared: dict[int, dict[int, Forms]] = {}
    for message in protocol.messages:
        headers = [layout for layout in message.layouts if layout.form == "header"]
        assert message.id is not None
        of = Forms(
            message.name,
            DIRECTIONS[message.direction],
            bool(headers),
            frozenset(layout.length for layout in message.layouts if layout not in headers),
            message.documented,
            any(layout.only_zero for layout in headers),
        )
        forms[message.id] = of
        if message.sub_message is not None:
            shared.setdefault(message.id, {})[message.sub_message] = of
    forms |= {id: shared_forms(each) for id, each in shared.items()}
    heads = {
        (layout.length << 16 | (message.id or 0)).to_bytes(4, "little")
        for message in protocol.messages
        for layout in message.layouts
        if message.without_flag and layout.form != "header"
    }
    framing = protocol.framing
    devices = frozenset(framing["devices"])
    return FramingTable(forms, framing["host"], devices, frozenset(heads))
