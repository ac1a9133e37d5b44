"""How the classes of a unit present it: a word for its channels, names of methods, how channels are enabled.

The facts are under `classes` of the family of the unit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.python.brackets import Nested, Source
from stagewire_generator.targets.python.devices.parts import ClassPlan, Part, UnitPlan
from stagewire_generator.targets.python.devices.plan import DEVICE, Call
from stagewire_generator.targets.python.devices.tables_view import TableWriter
from stagewire_generator.targets.python.source import literal, paragraph

_WITH_CHANNELS = ("ChannelsDevice", "ModuleDevice", "ChannelsBay")


def facts_of(protocol: Protocol, unit: UnitPlan) -> Json:
    """Return the `classes` of the family of a unit; empty if it has none."""
    found: Json = protocol.units["families"][unit.entry["family"]].get("classes", {})
    return found


def _stop(parts: Iterable[Part]) -> Call | None:
    """Return the call that stops the motion of a motor; None if there is none."""
    calls = (call for part in parts for call in part.calls)
    return next((c for c in calls if c.kind == "halt" and c.words[-1] == "stop"), None)


def member_sources(
    protocol: Protocol, unit: UnitPlan, plan: ClassPlan, *, aio: bool
) -> Iterator[str]:
    """Yield the members of a class of a unit that are not in its parts.

    They are a stop of all channels, the word for a channel, and other names of methods.
    """
    facts = facts_of(protocol, unit)
    inner = next((one for one in unit.classes if one.name == plan.element), None)
    stop = _stop(inner.parts) if inner and plan.base in _WITH_CHANNELS else None
    if stop is not None and _stop(plan.parts) is None:
        before, waits = ("async ", "await ") if aio else ("", "")
        text = paragraph(
            f"Sends ``{stop.message.name}`` to each channel, ahead of all waiting requests, and waits for no "
            "confirmation.",
            8,
        )
        yield (
            f"{before}def stop(self, *, timeout: float | None = None) -> None:\n"
            f'        """Stop all channels.\n\n'
            f"        {text}\n\n"
            f"        :param timeout: in seconds; default: the timeout of the device.\n"
            f"        :raises TransportLostError: if the connection is lost.\n"
            f"        :raises SessionClosedError: if the session is closed.\n"
            f'        """\n'
            f"        {waits}self._halt_each(t.{stop.constant}, timeout)\n"
        )
    if word := facts.get("channel", "") if plan.element and plan.level == DEVICE else "":
        yield (
            f"def {word}(self, number: int | str) -> {plan.element}:\n"
            f'        """Return a {word} by its number, counted from 1; the same as ``channel(number)``.\n\n'
            f"        :raises OutOfRangeError: for a number without a {word}.\n"
            f"        :raises BadValueError: for anything else.\n"
            f'        """\n'
            f"        return self.channel(number)\n"
        )
    for name, message in facts.get("methods", {}).items():
        for part in plan.parts:
            calls = [call for call in part.calls if call.message.name == message and call.arguments]
            if calls:
                owner, method = f"{calls[0].message.chapter}.{part.name}", "_".join(calls[0].words)
                yield f"{name} = {owner}.{method}\n    start_{name} = {owner}.start_{method}\n"


def enabling_entries(protocol: Protocol, unit: UnitPlan, tables: TableWriter) -> Iterator[Source]:
    """Yield how the channels of a unit are enabled, as arguments of its facts."""
    facts = facts_of(protocol, unit).get("enabling")
    if facts is None:
        return
    items: list[Source] = []
    if "set" in facts:
        [call] = [
            one for one in tables.calls if one.message.set and one.message.set[0] == facts["set"]
        ]
        [field] = [one for one in call.layout.all_fields if one.name == facts["field"]]
        assert field.enum  # a lint rule ensures it
        values = {value.name: value.value for value in field.enum.values}
        numbers = {
            values[name]: Nested("(", tuple(map(str, numbers)), ")")
            for name, numbers in facts.get("channels", {}).items()
        }
        items += [f"table=t.{call.constant}", f"field={literal(facts['field'])}"]
        if numbers:
            keyed = tuple(_keyed(value, one) for value, one in numbers.items())
            items.append(Nested("channels={", keyed, "}"))
    items += [f"{key}=True" for key in ("disables_others", "before_motions") if facts.get(key)]
    yield Nested("enabling=Enabling(", tuple(items), ")")


def _keyed(value: int, numbers: Nested) -> Nested:
    return numbers._replace(opening=f"0x{value:02X}: {numbers.opening}")
