"""Types of the values at the end of a motion, which differ between units.

The methods of a mixin are shared by units that report different values. ``self: Mover[Reported]`` takes the
type from the attribute ``_reported`` of the class of the unit, which only type checkers see.
"""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_generator.targets.python.devices.facts_view import status_call
from stagewire_generator.targets.python.devices.parts import ClassPlan, UnitPlan
from stagewire_generator.targets.python.devices.plan import Call, Plan, ValuesPlan
from stagewire_generator.targets.python.devices.tables_view import TableWriter


class MotionTypes:
    """The types of the ends of motions of a protocol."""

    def __init__(self, plan: Plan, tables: TableWriter) -> None:
        self._plan = plan
        self._tables = tables
        self._with_values = {values.message.name for values in plan.values}

    def of_end(self, call: Call) -> str:
        """Return the type of the values at the end: ``Reported``, ``Reported | None`` or ``None``.

        A motion to a target that its message carries ends with values: those of the end message, or those of
        the status that is then requested.
        """
        if call.kind == "action" and any(a.field.target for a in call.arguments):
            return "Reported"
        return "Reported | None" if any(self._ends(call)) else "None"

    def of_unit(self, unit: UnitPlan, plan: ClassPlan) -> str:
        """Return the type ``Reported`` of a class; empty if it has no call that needs it."""
        calls = [c for part in plan.parts for c in part.calls if c.kind in ("action", "halt")]
        if all(self.of_end(call) == "None" for call in calls):
            return ""
        ends = {name for call in calls for name in self._ends(call)} & unit.messages
        status = unit.entry.get("status")
        found = [
            values.name
            for values in self._plan.values
            if values.message.name in ends and values.layout.when.get("status", status) == status
        ]
        asked = status_call(self._plan.protocol, unit, self._tables)
        status_values = None if asked is None else asked.values
        if status_values is not None and _has_position(status_values):
            found.append(status_values.name)
        else:  # an end message without values is not followed by a request
            found.append("")
        return " | ".join(f"v.{name}" if name else "None" for name in dict.fromkeys(found))

    def _ends(self, call: Call) -> Iterator[str]:
        """Yield the messages with values that report the end of a motion."""
        keys = ("completes_with", "stops_with") if call.kind == "halt" else ("completes_with",)
        names = (name for key in keys for name in call.message.exchange.get(key, ()))
        yield from (name for name in names if name in self._with_values)


def _has_position(values: ValuesPlan) -> bool:
    """Return whether values contain the position in units, with which a target is compared."""
    quantities = (field.quantity for field in values.layout.fields)
    return any(quantity is not None and quantity.name == "position" for quantity in quantities)
