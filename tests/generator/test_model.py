"""The model is frozen and complete, with all references followed; and names reserved in generated code."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import FrozenInstanceError, fields, is_dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from stagewire.protocols import (
    Command,
    Enumeration,
    Flags,
    FramedMessage,
    Message,
    Reply,
    SetupCommand,
    UndecidedMessage,
    UndocumentedMessage,
    load_protocol,
)
from stagewire_generator import check
from stagewire_generator.diagnostics import Diagnostic, Place, SpecError
from stagewire_generator.model import Message as RegistryMessage
from stagewire_generator.model import Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.model_scales import Factor, Limit


def parts(value: Any) -> Iterator[Any]:
    """Yield every dataclass in the model."""
    if is_dataclass(value):
        yield value
        for field in fields(value):
            yield from parts(getattr(value, field.name))
    elif isinstance(value, tuple | list):
        for item in value:
            yield from parts(item)
    elif isinstance(value, dict):
        for item in value.values():
            yield from parts(item)


def message(protocol: Protocol, name: str) -> RegistryMessage:
    return next(message for message in protocol.messages if message.name == name)


def field(protocol: Protocol, owner: str, name: str) -> Field:
    layouts = message(protocol, owner).layouts
    return next(f for layout in layouts for f in layout.all_fields if f.name == name)


def test_everything_is_frozen(protocol: Protocol, commands: Protocol) -> None:
    kinds = set()
    for part in (*parts(protocol), *parts(commands)):
        kinds.add(type(part).__name__)
        for attribute in fields(part):
            with pytest.raises(FrozenInstanceError):
                setattr(part, attribute.name, None)
            with pytest.raises(FrozenInstanceError):
                delattr(part, attribute.name)
        assert not hasattr(part, "__dict__")  # no room for anything else
    assert {"Protocol", "Message", "Layout", "Field", "Format", "Enumeration", "FlagTable"} < kinds
    assert {"Quantity", "Factor", "Stage", "Controller", "Erratum", "Chapter", "Place"} < kinds
    assert "Firmware" in kinds


def test_sequences_are_tuples(protocol: Protocol, commands: Protocol) -> None:
    for part in (*parts(protocol), *parts(commands)):
        for attribute in fields(part):
            value = getattr(part, attribute.name)
            assert not isinstance(value, list), f"{type(part).__name__}.{attribute.name}"


def test_messages_are_sorted(protocol: Protocol) -> None:
    assert [(m.name, m.id) for m in protocol.messages] == [
        ("POS_SET_VELPARAMS", 0x0101),
        ("POS_REQ_VELPARAMS", 0x0102),
        ("POS_GET_VELPARAMS", 0x0103),
        ("POS_REQ_MODE", 0x0111),
        ("POS_GET_MODE", 0x0112),
        ("POS_MOVE", 0x0120),
        ("POS_MOVED", 0x0121),
        ("POS_ECHO", 0x0122),
        ("POS_ALIVE", 0x0123),
        ("LAMP", 0x0201),
        ("LAMP_TEST", 0x0202),
        ("LAMP_BROKEN", None),
    ]
    assert [e.id for e in protocol.errata] == ["tiny-lamp-test", "tiny-move-length"]
    assert [c.name for c in protocol.chapters] == ["core", "extra"]


def test_commands_are_sorted(commands: Protocol) -> None:
    """The order is that of their bytes, which setup commands may share with other commands."""
    assert [(m.name, m.kind, m.id, m.size) for m in commands.messages] == [
        ("MOOD", "command", 0x3F, None),
        ("CALL", "command", 0x43, 4),
        ("GO_TO", "command", 0x47, 6),
        ("SLEEP", "setup", 0x47, None),
        ("HALT", "command", 0x48, 0),
        ("KNOCK", "command", 0x4B, 4),
        ("NAME", "command", 0x4E, 4),
        ("SPIN", "command", 0x53, 2),
        ("WAKE", "setup", 0x57, None),
        ("WHERE", "command", 0x77, 7),
    ]


def test_a_command_and_its_reply_are_one_message(commands: Protocol) -> None:
    layouts = {m.name: [(x.form, x.length) for x in m.layouts] for m in commands.messages}
    assert layouts["GO_TO"] == [("request", 6)]
    assert layouts["WHERE"] == [("request", 0), ("reply", 7)]
    assert layouts["NAME"] == [("request", 4), ("reply", 5)]
    assert layouts["WAKE"] == [("request", 0)]
    name = message(commands, "NAME")
    assert (name.title, name.keyboard, name.words, name.pages) == ("Name", "N", ("name",), (8,))
    assert [(fact.version, fact.page) for fact in name.firmware] == [("1.5", None)]
    assert [m.name for m in commands.messages if m.dummy] == ["SPIN"]
    assert {m.name: m.switches_to for m in commands.messages if m.switches_to} == {
        "SLEEP": "high_level",
        "WAKE": "low_level",
    }
    assert [fact.version for fact in commands.firmware] == ["1.2", "1.4"]
    request, reply = name.layouts
    assert [(f.name, f.offset, f.format.kind) for f in request.fields] == [
        ("name", 0, "text"),
        ("spare", 3, "integer"),
    ]
    assert [(f.name, f.offset, f.format.kind) for f in reply.fields] == [
        ("name", 0, "text"),
        ("blob", 3, "bytes"),
    ]


def test_references_of_commands_are_followed(commands: Protocol) -> None:
    place = field(commands, "WHERE", "place")
    assert (place.unit, place.minimum, place.maximum) == ("um", -(2**23), 2**23 - 1)
    assert place.format.is_odd
    assert not field(commands, "SPIN", "turns").format.is_odd
    mood = field(commands, "MOOD", "mood")
    assert mood.enum is not None
    assert [v.keyboard for v in mood.enum.values] == ["H", ""]
    [axis, _] = commands.enumerations
    assert [v.name for v in axis.values if v.reserved] == ["TAIL"]
    assert field(commands, "GO_TO", "height").errata == ("turtle-height",)
    assert field(commands, "WHERE", "height").errata == ()
    assert message(commands, "WHERE").errata == ("turtle-example-size", "turtle-short-form")


def test_parameter_sets_are_expanded(protocol: Protocol) -> None:
    [mode, velocity] = protocol.sets
    assert dict(velocity.members) == {
        "set": "POS_SET_VELPARAMS",
        "req": "POS_REQ_VELPARAMS",
        "get": "POS_GET_VELPARAMS",
    }
    assert dict(mode.members) == {"req": "POS_REQ_MODE", "get": "POS_GET_MODE"}
    request = message(protocol, "POS_REQ_VELPARAMS")
    assert request.exchange == {"answered_by": ["POS_GET_VELPARAMS"]}
    assert request.direction == "to_controller"
    assert request.class_name == "PosReqVelParams"
    assert [layout.form for layout in request.layouts] == ["header"]
    reply = message(protocol, "POS_GET_VELPARAMS")
    assert reply.direction == "to_host"
    assert reply.pages == (4, 5)
    assert reply.layouts[0].note == ""  # the note is the message's
    assert reply.note == ""  # the note of a set is about its SET
    setter = message(protocol, "POS_SET_VELPARAMS")
    assert setter.note == "Kept until the device is switched off."
    assert {setter.title, request.title, reply.title} == {"velocity parameters"}


def test_references_are_followed(protocol: Protocol) -> None:
    bits = field(protocol, "POS_MOVED", "status_bits")
    assert bits.flags is not None
    assert [bit.mask for bit in bits.flags.bits] == [1, 2, 1 << 31]
    assert bits.flags_by_unit["TP9"].name == "coil_bits"
    distance = field(protocol, "POS_MOVE", "absolute_distance")
    assert distance.unit == "mm"
    assert distance.offset == 2
    assert (distance.minimum, distance.maximum) == (-(2**31), 2**31 - 1)
    wait = field(protocol, "POS_SET_VELPARAMS", "wait")
    assert wait.quantity is not None
    assert wait.quantity.factor is not None
    assert wait.quantity.factor.counts_per_unit == Fraction(5, 512)
    channel = field(protocol, "POS_MOVE", "chan_ident")
    assert channel.enum is not None
    assert [(v.name, v.value) for v in channel.enum.values] == [("CHANNEL_1", 1), ("CHANNEL_2", 2)]
    [stage] = protocol.stages
    factor = stage.scales["TPx"]["speed"]
    assert isinstance(factor, Factor)
    assert factor.value == Fraction(16777216, 125)
    assert stage.scales["TP9"]["speed"] == "no page says so"


_LIKE = """
  Long:
    title: a longer slide
    page: 3
    like: Slide
    limits: {travel: {mm: 20, page: 3}}
"""


def with_stages(spec: Path, old: str, new: str) -> Path:
    stages = spec / "tiny" / "stages.yaml"
    text = stages.read_text(encoding="utf-8").rstrip()
    assert old in text
    stages.write_text(text.replace(old, new) + _LIKE, encoding="utf-8")
    units = spec / "tiny" / "units.yaml"
    text = units.read_text(encoding="utf-8")
    units.write_text(text.replace("[Slide]", "[Slide, Long]"), encoding="utf-8")
    return spec


def test_a_stage_has_limits_and_may_be_like_another(spec: Path) -> None:
    [protocol] = check(with_stages(spec, "mm: 10", "mm: 10"))
    slide, long = protocol.stages
    assert slide.limits["travel"] == Limit(Fraction(10), "mm", "the title", 3, "as printed")
    assert slide.limits["max_velocity"] == Limit(Fraction("2.5"), "mm/s", "a data sheet", None)
    assert slide.limits["max_acceleration"] == "no page says so"
    assert long.scales == slide.scales
    assert long.limits == {**slide.limits, "travel": Limit(Fraction(20), "mm", "", 3)}


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ('mm_per_s: "2.5", source: a data sheet', 'mm_per_s: "2.5"', "SW010"),  # no source
        ('mm_per_s: "2.5"', "mm: 3", "SW010"),
        ('mm_per_s: "2.5"', 'mm_per_s: "0.0"', "SW010"),
        ('mm_per_s: "2.5"', "mm_per_s: 5/2", "SW010"),
        ("mm: 10, source", "mm: 10, unknown: lost, source", "SW010"),
        ("    limits:\n", "    like: Long\n    limits:\n", "SW010"),  # it has its own scales
        ("  Slide:\n", "  Slip:\n", "SW021"),  # Long refers to an undefined stage
    ],
)
def test_a_limit_has_one_value_and_a_source(spec: Path, old: str, new: str, code: str) -> None:
    with pytest.raises(SpecError) as caught:
        check(with_stages(spec, old, new))
    assert code in {diagnostic.code for diagnostic in caught.value.diagnostics}


def test_errata_reach_their_fields(protocol: Protocol) -> None:
    assert field(protocol, "POS_MOVE", "absolute_distance").errata == ("tiny-move-length",)
    assert field(protocol, "POS_MOVE", "chan_ident").errata == ()


@pytest.mark.parametrize("name", ["POS_GET_VELPARAMS.wait", "POS_VELPARAMS.wait"])
def test_errata_reach_fields_of_sets(spec: Path, name: str) -> None:
    """The name of a message selects only that message; the name of a set selects all its messages."""
    errata = spec / "tiny" / "errata" / "core.yaml"
    text = errata.read_text(encoding="utf-8").replace("POS_MOVE.absolute_distance", name)
    errata.write_text(text, encoding="utf-8")
    [protocol] = check(spec)
    assert field(protocol, "POS_GET_VELPARAMS", "wait").errata == ("tiny-move-length",)
    of_set = ("tiny-move-length",) if name.startswith("POS_VEL") else ()
    assert field(protocol, "POS_SET_VELPARAMS", "wait").errata == of_set


def test_errata_reach_fields_of_blocks(spec: Path) -> None:
    errata = spec / "tiny" / "errata" / "core.yaml"
    text = errata.read_text(encoding="utf-8")
    errata.write_text(text.replace("POS_MOVE.absolute_distance", "POS_MOVED.velocity"))
    [protocol] = check(spec)
    assert field(protocol, "POS_MOVED", "velocity").errata == ("tiny-move-length",)


# Names that are reserved in generated classes


def with_lamp(spec: Path, fields_: str, length: int) -> Path:
    path = spec / "tiny" / "messages" / "extra.yaml"
    text = path.read_text(encoding="utf-8")
    start = text.index("    data: {length: 0x04")
    end = text.index("\n", start)
    data = f"    data: {{length: {length}, fields: {{{fields_}}}}}"
    path.write_text(text[:start] + data + text[end:], encoding="utf-8")
    return spec


BASES = {
    Message, FramedMessage, UndecidedMessage, UndocumentedMessage, Command, SetupCommand, Reply
}  # fmt: skip


def members(kind: type[Message]) -> Iterator[str]:
    """Yield the public attributes of a class, without its fields and their flags."""
    fields = () if kind in BASES else kind.layout.fields
    for name in dir(kind):
        if not name.startswith("_") and name.removesuffix("_flags") not in fields:
            yield name


MEMBERS = sorted(
    {
        name
        for kind in (*BASES, *load_protocol("asi_ms2000").messages)
        for name in members(kind)
    }
)  # fmt: skip


def test_a_field_cannot_have_the_name_of_an_attribute_of_the_runtime(spec: Path) -> None:
    assert {"reply", "marks"} < set(MEMBERS)  # attributes of commands
    with_lamp(spec, ", ".join(f"{n}: {{format: byte}}" for n in MEMBERS), len(MEMBERS))
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert [d.message for d in caught.value.diagnostics if d.code == "SW023"] == [
        f"LAMP: the field name {name} is reserved" for name in MEMBERS
    ]


def test_a_bit_cannot_have_the_name_of_an_attribute_of_the_runtime(spec: Path) -> None:
    names = sorted(name for name in dir(Flags) if not name.startswith("_"))
    path = spec / "tiny" / "messages" / "extra.yaml"
    bits = ", ".join(f"{name}: {{bit: {n}}}" for n, name in enumerate(names))
    table = f"flags:\n  lamp_bits: {{page: 7, format: dword, bits: {{{bits}}}}}\n"
    text = path.read_text(encoding="utf-8").replace("messages:\n", table + "messages:\n", 1)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert sorted(d.message for d in caught.value.diagnostics) == [
        f"lamp_bits: the bit name {name} is reserved" for name in names
    ]


def test_an_enumeration_value_cannot_have_the_name_of_an_attribute_of_the_runtime() -> None:
    """Values are in upper case, and attributes of the runtime are not."""
    assert [name for name in dir(Enumeration) if name.isupper()] == []


# Diagnostics


def test_diagnostics_print_place_code_message_and_hint() -> None:
    found = Diagnostic(Place("a/b.yaml", 3, 5), "SW030", "A and B: 0x0001")
    assert str(found) == (
        "a/b.yaml:3:5: SW030 A and B: 0x0001\n"
        "    hint: one of the ids is wrong: compare both with the document"
    )
    assert str(Diagnostic(Place("x"), "SW001", "y", "do z")).endswith("\n    hint: do z")
