"""Attributes, further names of reads, and methods with fixed values, as stated under `call`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.model import Json, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.targets.documentation import title_of, where_all
from stagewire_generator.targets.python.brackets import Nested, Source, Text
from stagewire_generator.targets.python.devices.arguments import Argument, Way, table_class
from stagewire_generator.targets.python.devices.documentation import unit_text
from stagewire_generator.targets.python.devices.parts import MethodView, method_view
from stagewire_generator.targets.python.devices.plan import Call, plan_of
from stagewire_generator.targets.python.source import docstring, literal, paragraph

_SECONDS = ":param timeout: in seconds; default: the timeout of the device."
_TIMEOUT = "timeout: float | None = None"
_UNKNOWN = ":raises UnknownScaleError: if its scale is unknown; nothing is sent."
_UNCONFIRMED = ":raises NotReadyError: if the controller reports another state."
_READ_BACK = "The state is read back."
_ERRORS = (
    ":raises ReplyTimeoutError: if no reply arrives in time.",
    ":raises TransportLostError: if the connection is lost.",
    ":raises SessionClosedError: if the session is closed.",
)
_REFUSED = (
    ":raises OutOfRangeError: if it is out of range, or above a limit (``LimitError``); nothing is sent.",
    ":raises BadValueError: if it has the wrong type; nothing is sent.",
)


def check_attributes(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check that each attribute names the keyword of a value with a unit or a name in its set."""
    for call in plan_of(_with_attributes(protocol)).calls:
        if "attribute" not in call.message.call:
            continue
        name, value = (call.message.call["attribute"][key] for key in ("name", "value"))
        known = list(_candidates(call))
        if value not in known:
            what = f"{call.message.name}: the attribute {name} has the unknown value {value}"
            hint = f"known values: {', '.join(known)}" if known else "remove the attribute"
            diagnostics.add(call.message.place, "SW021", what, hint)


def _with_attributes(protocol: Protocol) -> Protocol:
    """Return the protocol with only the messages that have an attribute, their sets and their answers.

    Planning the calls of all messages takes longer than the other checks.
    """
    stated = [message for message in protocol.messages if "attribute" in message.call]
    names = {m.name for m in stated}.union(*(m.exchange.get("answered_by", ()) for m in stated))
    sets = {m.set[0] for m in protocol.messages if m.set and m.name in names}
    return replace(
        protocol,
        messages=tuple(
            m for m in protocol.messages if m.name in names or (m.set and m.set[0] in sets)
        ),
        sets=tuple(found for found in protocol.sets if found.name in sets),
    )


def further_views(protocol: Protocol, call: Call, verbs: Sequence[str]) -> Iterator[MethodView]:
    """Make the views of the attribute and the read of a call, if the registry states them.

    :param verbs: the verbs of the methods that the class has.
    """
    facts = call.message.call
    if "reading" in facts and "get_" in verbs:
        yield method_view(protocol, call, "get_", facts["reading"], "None")
    yield from _preset_views(protocol, call, verbs)
    if "attribute" not in facts or "get_" not in verbs:
        return
    name, value = facts["attribute"]["name"], facts["attribute"]["value"]
    argument, way = _candidates(call)[value]
    sent = [call.members[role] for role in ("set", "req", "get") if role in call.members]
    pages = where_all(protocol, [(page, m.overlay) for m in sent for page in m.pages[:1]])
    names = ", ".join(f"``{message.name}``" for message in sent)
    title = f"{title_of(call.message)} in {way.unit}" if way else title_of(call.message)
    read, given = _types(argument) if way is None else ("float", "Number")
    scale = (_scale(argument, way),) if way else ()
    unknown = (_UNKNOWN,) if way else ()
    assigned = "set_" in verbs
    sends = "Each access sends a request" + (", and an assignment a message." if assigned else ".")
    source = f"{names}, {pages}."
    doc = _doc(f"{title[:1].upper()}{title[1:]}.", (sends, *scale, source), assigned, "", unknown)
    get = Nested("return self._get(", (f"t.{call.constant}", "None"), f").{value}")
    yield MethodView(
        name, Nested(f"def {name}(", ("self",), f") -> {read}:"), doc, get, read, "@property"
    )
    if "set_" not in verbs:
        return
    primitive = "_set" if len(call.arguments) == 1 else "_change"
    items = (f"t.{call.constant}", "None", f"{value}={name}")
    setter = Nested(f"def {name}(", ("self", f"{name}: {given}"), ") -> None:")
    told = docstring(f"Set the {title}.")
    yield MethodView(
        name, setter, told, Nested(f"self.{primitive}(", items, ")"), "None", f"@{name}.setter"
    )
    method = Nested(f"def set_{name}(", ("self", f"{name}: {given}", "*", _TIMEOUT), ") -> None:")
    body = Nested(f"self.{primitive}(", (items[0], "timeout", items[2]), ")")
    doc = _doc(f"Set the {title}.", (*scale, source), True, _SECONDS, unknown)
    yield MethodView(f"set_{name}", method, doc, body, "None")


def _candidates(call: Call) -> dict[str, tuple[Argument, Way | None]]:
    """Return the values that can be attributes, by keyword: values in a unit, named values and bits."""
    arguments = call.arguments or (call.values.arguments if call.values else ())
    found: dict[str, tuple[Argument, Way | None]] = {
        way.keyword: (argument, way) for argument in arguments for way in argument.ways
    }
    found |= {a.keyword: (a, None) for a in arguments if a.field.enum or a.field.flags}
    return found


def _types(argument: Argument) -> tuple[str, str]:
    """Return the types of a named value or of bits, as it is read and as it is assigned."""
    table = table_class(argument.field)
    read = f"{table} | int" if argument.field.enum else table
    return read, f"{table} | str | int"


def _preset_views(protocol: Protocol, call: Call, verbs: Sequence[str]) -> Iterator[MethodView]:
    """Make the views of the methods that send fixed values."""
    if call.kind == "set" and "set_" not in verbs:
        return
    keywords = {argument.field.name: argument for argument in call.arguments}

    def given(values: Json) -> list[tuple[str, str]]:
        return [(keywords[n].keyword, _raw(keywords[n].field, v)) for n, v in values.items()]

    for name, preset in call.message.call.get("presets", {}).items():
        sent = [call.members[role] for role in ("set",) if role in call.members] or [call.message]
        names = ", ".join(f"``{message.name}``" for message in sent)
        pages = where_all(protocol, [(page, m.overlay) for m in sent for page in m.pages[:1]])
        values = tuple(f"{key}={value}" for key, value in given(preset["values"]))
        items: tuple[Source, ...] = (f"t.{call.constant}", "timeout")
        primitive = "_tell" if call.kind == "command" else "_set"
        errors: tuple[str, ...] = ()
        texts: tuple[str, ...] = ()
        if "confirmed" in preset:
            otherwise = ", ".join(
                f"{literal(k)}: {v}" for k, v in given(preset.get("otherwise", {}))
            )
            items += (Text("", preset["confirmed"]), f"{{{otherwise}}}")
            primitive, errors, texts = "_establish", (_UNCONFIRMED,), (_READ_BACK,)
        doc = _doc(preset["summary"], (*texts, f"{names}, {pages}."), False, _SECONDS, errors)
        yield MethodView(
            name,
            Nested(f"def {name}(", ("self", "*", _TIMEOUT), ") -> None:"),
            doc,
            Nested(f"self.{primitive}(", (*items, *values), ")"),
            "None",
        )


def _raw(field: Field, value: str | int) -> str:
    """Return the expression of a value, which may be a name."""
    return f"{table_class(field)}.{value}" if isinstance(value, str) else str(value)


def _scale(argument: Argument, way: Way) -> str:
    text = unit_text(argument, way)
    return f"{text if text[:1] != '`' else f'It is {text}'}."


def _doc(
    first: str,
    texts: Sequence[str],
    assigned: bool,
    timeout: str,
    errors: Sequence[str],
) -> str:
    """Return the docstring of an attribute, or of a method without units.

    :param errors: its own errors.
    """
    lines = (*((timeout,) if timeout else ()), *(_REFUSED if assigned else ()), *errors, *_ERRORS)
    parts = [
        *(paragraph(text, 8) for text in (first, *texts)),
        "\n        ".join(paragraph(line, 8, 4) for line in lines),
    ]
    return docstring("\n\n        ".join(parts) + "\n        ")
