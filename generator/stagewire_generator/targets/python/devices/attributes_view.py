"""Attributes of device classes, and further names of reads, which the registry states under `call`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.model import Protocol
from stagewire_generator.targets.documentation import title_of, where_all
from stagewire_generator.targets.python.brackets import Nested
from stagewire_generator.targets.python.devices.arguments import Argument, Way
from stagewire_generator.targets.python.devices.documentation import unit_text
from stagewire_generator.targets.python.devices.parts import MethodView, method_view
from stagewire_generator.targets.python.devices.plan import Call, plan_of
from stagewire_generator.targets.python.source import docstring, paragraph

_SECONDS = ":param timeout: in seconds; default: the timeout of the device."
_TIMEOUT = "timeout: float | None = None"
_ERRORS = (
    ":raises UnknownScaleError: if its scale is unknown; nothing is sent.",
    ":raises ReplyTimeoutError: if no reply arrives in time.",
    ":raises TransportLostError: if the connection is lost.",
    ":raises SessionClosedError: if the session is closed.",
)
_REFUSED = (
    ":raises OutOfRangeError: if it is out of range, or above a limit (``LimitError``); nothing is sent.",
    ":raises BadValueError: if it has the wrong type; nothing is sent.",
)


def check_attributes(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check that each attribute names the keyword of a value with a unit in the calls of its set."""
    for call in plan_of(protocol).calls:
        if "attribute" not in call.message.call:
            continue
        name, value = (call.message.call["attribute"][key] for key in ("name", "value"))
        known = [way.keyword for argument in call.arguments for way in argument.ways]
        if value not in known:
            what = f"{call.message.name}: the attribute {name} has the unknown value {value}"
            hint = f"known values: {', '.join(known)}" if known else "remove the attribute"
            diagnostics.add(call.message.place, "SW021", what, hint)


def further_views(protocol: Protocol, call: Call, verbs: Sequence[str]) -> Iterator[MethodView]:
    """Make the views of the attribute and the read of a call, if the registry states them.

    :param verbs: the verbs of the methods that the class has.
    """
    facts = call.message.call
    if "reading" in facts and "get_" in verbs:
        yield method_view(protocol, call, "get_", facts["reading"], "None")
    if "attribute" not in facts or "get_" not in verbs:
        return
    name, value = facts["attribute"]["name"], facts["attribute"]["value"]
    [(argument, way)] = [(a, w) for a in call.arguments for w in a.ways if w.keyword == value]
    sent = [call.members[role] for role in ("set", "req", "get") if role in call.members]
    pages = where_all(protocol, [(page, m.overlay) for m in sent for page in m.pages[:1]])
    names = ", ".join(f"``{message.name}``" for message in sent)
    title = f"{title_of(call.message)} in {way.unit}"
    assigned = "set_" in verbs
    sends = "Each access sends a request" + (", and an assignment a message." if assigned else ".")
    source = f"{names}, {pages}."
    doc = _doc(f"{title[:1].upper()}{title[1:]}.", (sends, _scale(argument, way), source), assigned)
    get = Nested("return self._get(", (f"t.{call.constant}", "None"), f").{value}")
    yield MethodView(
        name, Nested(f"def {name}(", ("self",), ") -> float:"), doc, get, "float", "@property"
    )
    if "set_" not in verbs:
        return
    primitive = "_set" if len(call.arguments) == 1 else "_change"
    given = (f"t.{call.constant}", "None", f"{value}={name}")
    setter = Nested(f"def {name}(", ("self", f"{name}: Number"), ") -> None:")
    told = docstring(f"Set the {title}.")
    yield MethodView(
        name, setter, told, Nested(f"self.{primitive}(", given, ")"), "None", f"@{name}.setter"
    )
    method = Nested(f"def set_{name}(", ("self", f"{name}: Number", "*", _TIMEOUT), ") -> None:")
    body = Nested(f"self.{primitive}(", (given[0], "timeout", given[2]), ")")
    doc = _doc(f"Set the {title}.", (_scale(argument, way), source), True, _SECONDS)
    yield MethodView(f"set_{name}", method, doc, body, "None")


def _scale(argument: Argument, way: Way) -> str:
    text = unit_text(argument, way)
    return f"{text if text[:1] != '`' else f'It is {text}'}."


def _doc(first: str, texts: Sequence[str], assigned: bool, timeout: str = "") -> str:
    """Return the docstring of an attribute, or of the method that sets it."""
    lines = (*((timeout,) if timeout else ()), *(_REFUSED if assigned else ()), *_ERRORS)
    parts = [
        *(paragraph(text, 8) for text in (first, *texts)),
        "\n        ".join(paragraph(line, 8, 4) for line in lines),
    ]
    return docstring("\n\n        ".join(parts) + "\n        ")
