"""Methods of parts: one view for threads, and one for asyncio."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from stagewire_generator.model import Field, Protocol
from stagewire_generator.targets.python.devices.arguments import Argument, table_class
from stagewire_generator.targets.python.devices.documentation import method_doc
from stagewire_generator.targets.python.devices.nested import Nested, Source, laid_out
from stagewire_generator.targets.python.devices.plan import Call

__all__ = ["MethodView", "method_view"]

_TYPES = {"integer": "int", "text": "str", "bytes": "bytes"}
_PRIMITIVES = {"get_": "_get", "set_": "_set", "change_": "_change", "start_": "_start"}
_OF_KIND = {"query": "_ask", "action": "_act", "halt": "_halt", "command": "_tell"}
_RETURNS = {"set_": "None", "start_": "Motion"}
_RETURNS_OF_KIND = {"action": "MotionEnd", "halt": "MotionEnd | None", "command": "None"}


@dataclass(frozen=True, slots=True)
class MethodView:
    """One method."""

    name: str
    signature: str
    doc: str
    body: str
    returns: str


def method_view(protocol: Protocol, call: Call, verb: str, name: str, aio: bool) -> MethodView:
    """Make the view of a method.

    :param verb: what its name begins with; empty for one that is called by its words alone.
    :param aio: whether it is for asyncio.
    """
    timeout = verb != "start_"
    arguments = call.arguments
    asked: tuple[Argument, ...] = ()
    positional: tuple[Argument, ...] = ()
    if call.kind == "set":
        asked = call.asked if verb in ("get_", "change_") else ()
        arguments = () if verb == "get_" else _without(call.arguments, asked)
    else:
        positional = _positional(arguments)
    primitive = _PRIMITIVES.get(verb) if call.kind in ("set", "action") else None
    primitive = primitive or _OF_KIND[call.kind]
    if verb == "set_" and "get" not in call.members:
        primitive = "_tell"  # a command, since nothing reads it
    returns = _RETURNS.get(verb) if call.kind in ("set", "action") else None
    if returns is None:
        returns = f"v.{call.values.name}" if call.values else _RETURNS_OF_KIND[call.kind]
    some = verb == "change_"
    head = f"{'async ' if aio else ''}def {name}("
    items: list[Source] = ["self", *(_parameter(a, False) for a in positional)]
    keywords = [p for a in asked for p in _keywords(a, False)]
    keywords += [p for a in _without(arguments, positional) for p in _keywords(a, some)]
    if timeout:
        keywords.append("timeout: float | None = None")
    if keywords:
        items += ["*", *keywords]
    signature = laid_out(Nested(head, tuple(items), f") -> {returns}:"), 4)
    given: list[Source] = [f"t.{call.constant}"]
    if timeout:
        given.append("timeout")
    given += [
        f"{k}={k}" for a in (*asked, *arguments) for k in (a.keyword, *(w.keyword for w in a.ways))
    ]
    result = "" if returns == "None" else "return "
    body = laid_out(
        Nested(f"{result}{'await ' if aio else ''}self.{primitive}(", tuple(given), ")"), 8
    )
    doc = method_doc(protocol, call, verb, (*asked, *arguments), timeout)
    return MethodView(name, signature, doc, body, returns)


def _positional(arguments: Sequence[Argument]) -> tuple[Argument, ...]:
    """Return those that may be given by position: without a unit, and none without a default behind one."""
    found = tuple(a for a in arguments if not a.ways)
    defaults = [a.default is not None for a in found]
    return found if defaults == sorted(defaults) else ()


def _without(arguments: Sequence[Argument], others: Sequence[Argument]) -> tuple[Argument, ...]:
    known = {other.keyword for other in others}
    return tuple(argument for argument in arguments if argument.keyword not in known)


def _keywords(argument: Argument, some: bool) -> list[str]:
    """Return the keywords of a value: the raw one, and one for each unit."""
    parameter = _parameter(argument, some or bool(argument.ways))
    return [parameter, *(f"{way.keyword}: Number | None = None" for way in argument.ways)]


def _parameter(argument: Argument, optional: bool) -> str:
    """Return a raw value as a parameter."""
    field = argument.field
    head = f"{argument.keyword}: {_type(field)}"
    if argument.default is not None and not optional:
        named = f"{table_class(field)}." if isinstance(argument.default, str) else ""
        return f"{head} = {named}{argument.default}"
    return f"{head} | None = None" if optional else head


def _type(field: Field) -> str:
    table = table_class(field)
    return f"{table} | str | int" if table else _TYPES[field.format.kind]
