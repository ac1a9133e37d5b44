"""Check the facts for device classes: effects, halts, ends of actions, defaults and settings.

Every message that moves something must declare it.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterable, Iterator

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.framing import rules_of
from stagewire_generator.model import Json, Message, Protocol
from stagewire_generator.model_fields import NO_BITS, Enumeration, Field
from stagewire_generator.strict_yaml import Document


def check_effects(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check that every message to a controller has an effect that fits its exchange.

    The effect of a parameter set applies to SET; REQ has the effect ``none``, and GET has no effect.
    """
    messages = {message.name: message for message in protocol.messages}
    for message in protocol.messages:
        if message.direction == "to_host" and message.effect:
            what = f"{message.name} declares an effect, but only the controller sends it"
            diagnostics.add(message.place, "SW070", what, "remove the effect")
        elif message.direction != "to_host" and not message.effect:
            diagnostics.add(message.place, "SW070", f"the effect of {message.name} is missing")
        _hazard(message, diagnostics)
        _halt_effects(message, messages, diagnostics)


HARMLESS = ("", "none", "stream", "stop", "connection")
"""Effects of messages that have no hazard."""


def _hazard(message: Message, diagnostics: Diagnostics) -> None:
    """Check that a message with a hazard can change an output."""
    if message.hazard and message.effect in HARMLESS:
        why = f"has the effect {message.effect}" if message.effect else "is sent to the host only"
        what = f"{message.name} {why}, which excludes the hazard {message.hazard}"
        diagnostics.add(message.place, "SW072", what)


def _halt_effects(message: Message, messages: dict[str, Message], diagnostics: Diagnostics) -> None:
    """Check that a halted message has the effect ``motion``, and the halting one ``stop``."""
    halts = [messages[name] for name in message.exchange.get("halted_by", ()) if name in messages]
    if halts and message.effect not in ("", "motion"):
        what = (
            f"{message.name} is halted by {halts[0].name}, but has the effect {message.effect}, "
            "not motion"
        )
        diagnostics.add(message.place, "SW071", what)
    for halt in halts:
        if halt.effect not in ("", "stop"):
            what = f"{halt.name} halts {message.name}, but has the effect {halt.effect}, not stop"
            diagnostics.add(halt.place, "SW071", what)


def check_devices(
    protocol: Protocol, quantities: Iterable[Document], diagnostics: Diagnostics
) -> None:
    """Check the facts from which device classes are generated.

    :param quantities: the files with the settings, for the positions of errors.
    """
    messages = {message.name: message for message in protocol.messages}
    for message in protocol.messages:
        _defaults(protocol, message, diagnostics)
        _presets(message, diagnostics)
        _halts(protocol, message, messages, diagnostics)
        _asked(protocol, message, messages, diagnostics)
        _required(message, messages, diagnostics)
        _faults(protocol, message, diagnostics)
    _tells(protocol, diagnostics)
    for document in quantities:
        for name, setting in document.data.get("settings", {}).items():
            for owner, teller in setting["told_by"].items():
                place = document.place("settings", name, "told_by", owner)
                for what in _wrong(protocol, f"the setting {name}", setting, owner, teller):
                    diagnostics.add(place, *what)


def _sent(message: Message) -> list[Field]:
    """Return the fields of a message that a host sends."""
    return [f for x in message.layouts if x.form != "reply" for f in x.all_fields]


def _answer(message: Message, messages: dict[str, Message]) -> list[Field]:
    """Return the fields of the reply to a message; none if there is not exactly one reply."""
    replies = [layout for layout in message.layouts if layout.form == "reply"]
    for name in message.exchange.get("answered_by", ()):
        replies += messages[name].layouts if name in messages else ()
    return list(replies[0].all_fields) if len(replies) == 1 else []


def _attribute(message: Message, diagnostics: Diagnostics) -> None:
    """Check that an attribute of device classes is a value with a unit or a name of a parameter set."""
    facts = message.call.get("attribute")
    if facts is None or (message.set is not None and message.set[1] == "req"):
        return
    if message.set is None or not any(
        f.quantity or (f.name == facts["value"] and (f.enum or f.flags))
        for x in message.layouts
        for f in x.all_fields
    ):
        what = f"{message.name}: an attribute is a value with a unit or a name of a parameter set"
        diagnostics.add(message.place, "SW035", what)
    if keyword.iskeyword(facts["name"]):
        diagnostics.add(message.place, "SW023", f"{message.name}: {facts['name']} is reserved")


def _defaults(protocol: Protocol, message: Message, diagnostics: Diagnostics) -> None:
    for key in ("name", "reading"):
        name = message.call.get(key, "")
        if keyword.iskeyword(name):
            what = f"{message.name}: the method name {name} is reserved"
            diagnostics.add(message.place, "SW023", what)
    _attribute(message, diagnostics)
    for name, argument in message.call.get("also", {}).items():
        counts = {sum(f.role == "value" for f in x.all_fields) for x in message.layouts}
        channel = any(f.name == protocol.framing.get("channel") for f in _sent(message))
        if 1 + channel not in counts and 1 not in counts:
            what = f"{message.name}: no form has only one value, which {name} would take"
            diagnostics.add(message.place, "SW035", what)
        for word in (name, argument):
            if keyword.iskeyword(word):
                diagnostics.add(message.place, "SW023", f"{message.name}: {word} is reserved")
    fields = {field.name: field for field in _sent(message)}
    for key, value in message.call.get("defaults", {}).items():
        field = fields.get(key)
        where = f"{message.name}: the default of {key}"
        if field is None:
            diagnostics.add(message.place, "SW021", f"{where}: unknown field")
        elif isinstance(value, str) and value not in _names(field.enum):
            diagnostics.add(message.place, "SW021", f"{where}: unknown value {value}")
        elif isinstance(value, int) and not field.minimum <= value <= field.maximum:
            what = f"{where}: {value} is not between {field.minimum} and {field.maximum}"
            diagnostics.add(message.place, "SW033", what)


def _presets(message: Message, diagnostics: Diagnostics) -> None:
    """Check the methods that send fixed values."""
    if message.set is not None and message.set[1] != "set":
        return
    fields = {field.name: field for field in _sent(message)}
    for method, preset in message.call.get("presets", {}).items():
        if keyword.iskeyword(method):
            what = f"{message.name}: the method name {method} is reserved"
            diagnostics.add(message.place, "SW023", what)
        for name, value in (*preset["values"].items(), *preset.get("otherwise", {}).items()):
            field, where = fields.get(name), f"{message.name}: {method}"
            if field is None:
                diagnostics.add(message.place, "SW021", f"{where}: unknown field {name}")
            elif isinstance(value, str) and value not in _names(field.enum):
                diagnostics.add(message.place, "SW021", f"{where}: unknown value {value}")
        if "confirmed" in preset and message.set is None:
            what = f"{message.name}: {method}: only a parameter set can be read back"
            diagnostics.add(message.place, "SW035", what)


def _names(table: Enumeration | None) -> list[str]:
    return [value.name for value in table.values] if table else []


def _bits(field: Field) -> tuple[str, ...]:
    """Return the names of the bits of a field, and that of their absence."""
    return (*(bit.name for bit in field.flags.bits), NO_BITS) if field.flags else ()


def _halts(
    protocol: Protocol, message: Message, messages: dict[str, Message], diagnostics: Diagnostics
) -> None:
    """Check that a message that halts a motion can be sent on its own, without a value from the user."""
    for name in message.exchange.get("halted_by", ()):
        halt = messages.get(name)
        if halt is None:
            continue  # reported with all exchanges
        if halt.set or halt.direction == "to_host" or not halt.layouts or halt.id is None:
            what = (
                f"{message.name}: {name} cannot halt it, because a host cannot send it on its own"
            )
            diagnostics.add(message.place, "SW035", what)
        for field in _sent(halt):
            chosen = field.name in halt.call.get("defaults", {})
            channel = field.name == protocol.framing.get("channel")
            if field.role == "value" and not channel and not chosen:
                what = f"{message.name}: {name} halts it, but its {field.name} has no default"
                diagnostics.add(halt.place, "SW035", what, "add a default under `call`")


def _asked(
    protocol: Protocol, message: Message, messages: dict[str, Message], diagnostics: Diagnostics
) -> None:
    """Check the request for the end of an action, and for a target that a controller has stored."""
    for key in ("ends_when", "stored"):
        asked = message.exchange.get(key)
        if asked is None:
            continue
        if key == "ends_when" and not rules_of(protocol.framing["kind"]).polls:
            what = f"{message.name}: ends_when is for commands; here a message reports the end"
            diagnostics.add(message.place, "SW038", what)
        read = messages.get(asked["read"])
        fields = {f.name: f for f in _answer(read, messages)} if read else {}
        if read is None:
            what = f"{message.name}: {key}: unknown message {asked['read']}"
            diagnostics.add(message.place, "SW021", what)
        elif asked["field"] not in fields:
            what = f"{message.name}: {key}: the reply to {read.name} has no field {asked['field']}"
            diagnostics.add(message.place, "SW021", what)
        elif "value" in asked and asked["value"] not in _names(fields[asked["field"]].enum):
            what = f"{message.name}: {key}: {asked['field']} has no value {asked['value']}"
            diagnostics.add(message.place, "SW021", what)
        elif "when" in asked:
            state = fields.get(asked["when"]["field"])
            if state is None or asked["when"]["value"] not in _names(state.enum):
                what = "{}: {}: the reply to {} has no field {} with a value {}".format(
                    message.name, key, read.name, asked["when"]["field"], asked["when"]["value"]
                )
                diagnostics.add(message.place, "SW021", what)


def _required(message: Message, messages: dict[str, Message], diagnostics: Diagnostics) -> None:
    """Check the requests for the state that a motion needs."""
    for name, need in message.exchange.get("requires", {}).items():
        read = messages.get(name)
        if read is None or not read.set:
            what = f"{message.name}: requires: {name} is not the request of a parameter set"
            diagnostics.add(message.place, "SW021", what)
            continue
        fields = {field.name for field in _answer(read, messages)}
        ignored = need.get("ignored", {"fields": (), "with": name})
        for field in (*need.get("usable", ()), *need.get("unhindered", ()), *ignored["fields"]):
            if field not in fields:
                what = f"{message.name}: requires: the reply to {name} has no field {field}"
                diagnostics.add(message.place, "SW021", what)
        if ignored["with"] not in messages:
            what = f"{message.name}: requires: unknown message {ignored['with']}"
            diagnostics.add(message.place, "SW021", what)


def _faults(protocol: Protocol, message: Message, diagnostics: Diagnostics) -> None:
    """Check that a fault report is a message from a controller, in a frame with a header."""
    if "reports_fault" not in message.exchange:
        return
    if not rules_of(protocol.framing["kind"]).reports_faults:
        what = f"{message.name}: reports_fault requires frames with a header"
        diagnostics.add(message.place, "SW038", what)
    elif message.direction == "to_controller" or message.id is None:
        what = f"{message.name} has reports_fault, but no controller sends it"
        diagnostics.add(message.place, "SW035", what)


def _tells(protocol: Protocol, diagnostics: Diagnostics) -> None:
    told: dict[str, str] = {}
    for owner in protocol.sets:
        members = [m for m in protocol.messages if m.set and m.set[0] == owner.name and m.tells]
        for tells in {member.tells for member in members}:
            if tells in told and tells != "counter":
                what = f"{owner.name} and {told[tells]} both have `tells: {tells}`"
                diagnostics.add(owner.place, "SW020", what)
            told[tells] = owner.name
            if not {"req", "get"} <= owner.members.keys():
                what = f"{owner.name} has `tells: {tells}`, which requires a REQ and a GET"
                diagnostics.add(owner.place, "SW035", what)


def _wrong(
    protocol: Protocol, where: str, setting: Json, owner: str, teller: Json
) -> Iterator[tuple[str, str]]:
    """Yield code and text of each error in a set that gives the value of a setting."""
    unit, quantity = setting.get("unit", ""), setting.get("quantity", "")
    members = [m for m in protocol.messages if m.set == (owner, "get")]
    members += [m for m in protocol.messages if m.set == (owner, "set")]
    if not members:
        yield "SW021", f"{where}: unknown parameter set {owner}, or it has no content"
        return
    fields = {f.name: f for x in members[0].layouts for f in x.all_fields}
    field = fields.get(teller["field"])
    if field is None:
        yield "SW021", f"{where}: {owner} has no field {teller['field']}"
        return
    for name in teller.get("not_on", ()):
        if name not in protocol.units.get("units", {}):
            yield "SW021", f"{where}: unknown unit {name} in `not_on`"
    state = teller.get("while", {})
    if state and state["field"] not in fields:
        yield "SW021", f"{where}: {owner} has no field {state['field']}"
    for name in state.get("values", ()) if state.get("field") in fields else ():
        if name not in _names(fields[state["field"]].enum):
            yield "SW021", f"{where}: {state['field']} has no value {name}"
    values = teller.get("values", {})
    for name in values:
        if name not in (*_names(field.enum), *_bits(field)):
            yield "SW021", f"{where}: {field.name} has no value {name}"
    if quantity:
        if unit or not field.quantity or field.quantity.name != quantity:
            yield "SW037", f"{where} is a {quantity} in counts, but {field.name} or its unit is not"
        return
    if unit and values and set(values) == set(_bits(field)):
        return
    if not field.enum and not unit:
        yield "SW037", f"{where} has no unit, so {field.name} requires an enumeration"
    elif field.enum and unit and not values:
        yield (
            "SW037",
            f"{where} is in {unit}: give the numbers for the names of {field.name} in `values`",
        )
    elif not field.enum and not (field.unit == unit and field.quantity and field.quantity.factor):
        yield "SW037", f"{where} is in {unit}, but {field.name} has no exact factor for that unit"
