"""Check that units and the stages that they drive agree: scales, ids, and groups of controllers.

All names of units are known here: ``lint/names.py`` reports those that are not.
"""

from __future__ import annotations

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint.units import UnitRules
from stagewire_generator.model import Json, Message, Protocol
from stagewire_generator.model_scales import Conflict, Factor
from stagewire_generator.strict_yaml import Document


def check_stages(protocol: Protocol, document: Document, diagnostics: Diagnostics) -> None:
    """Check the stages of the units of a protocol.

    :param document: the file of the units, for the positions of errors.
    """
    rules = _Rules(protocol, document, diagnostics)
    rules.stages()
    rules.stage_ids()
    rules.defaults()
    rules.groups()


def _is_reply(protocol: Protocol, message: Message) -> bool:
    """Return whether a message is the GET of a set with a REQ, or answers another message."""
    sets = {group.name: group.members for group in protocol.sets}
    if message.set and message.set[1] == "get" and "req" in sets[message.set[0]]:
        return True
    return any(message.name in one.exchange.get("answered_by", ()) for one in protocol.messages)


class _Rules(UnitRules):
    """The rules, each a method."""

    def stages(self) -> None:
        """Check that a unit lists the stages with scales on it, and no others.

        A group of controllers may still list a unit under ``aliases``, which need not list their stages.
        """
        for name, unit in self.units.items():
            usable: dict[str, str] = {}  # stage -> the group with its scales
            missing: dict[str, str] = {}
            for group in (g for g in self.protocol.controllers if name in g.members):
                for stage in self.protocol.stages:
                    scales = stage.scales.get(group.name, {}).values()
                    if any(isinstance(s, Factor | Conflict) for s in scales):
                        usable[stage.name] = group.name
                        if name in group.units and stage.name not in unit["stages"]:
                            missing[stage.name] = group.name
            path = ("units", name, "stages")
            for index, listed in enumerate(unit["stages"]):
                if listed not in usable:
                    what = f"{listed} has no scale on {name}"
                    hint = (
                        f"remove it, or add {name} to a group under `controllers` in stages.yaml "
                        f"on which {listed} has scales"
                    )
                    self.refuse("SW084", (*path, index), what, hint)
            if "built_in" in unit and unit["built_in"] not in unit["stages"]:
                what = f"{unit['built_in']} is not one of its stages"
                self.refuse("SW084", ("units", name, "built_in"), what, "add it to `stages`")
            if "fewer_stages" in unit and not missing:
                what = "the unit has all stages with scales on it"
                self.refuse("SW084", ("units", name, "fewer_stages"), what, "remove it")
                continue
            for stage_name, group_name in () if "fewer_stages" in unit else missing.items():
                what = f"{stage_name} is not listed, but has scales on {name} in stages.yaml"
                hint = (
                    f"add it, remove {name} from the group {group_name}, or give the reason in "
                    "`fewer_stages`"
                )
                self.refuse("SW084", path, what, hint)

    def defaults(self) -> None:
        """Check that the default parameters of stages are fields and values of messages that set them."""
        for stage in self.protocol.stages:
            for name, values in stage.defaults.items():
                message = self.of_name.get(name)
                fields = {
                    f.name: f for x in (message.layouts if message else ()) for f in x.all_fields
                }
                for field, value in values.items():
                    found, is_number = fields.get(field), value[-1:].isdigit()
                    named = found is not None and found.enum and {v.name for v in found.enum.values}
                    if found is None:
                        what = f"stages.{stage.name}.defaults: {name} has no field {field}"
                    elif not (is_number if found.quantity else named and value in named):
                        what = f"stages.{stage.name}.defaults: {field} has no value {value}"
                    else:
                        continue
                    self.diagnostics.add(stage.place, "SW021", what)

    def stage_ids(self) -> None:
        """Check that stage ids name a field, and that a unit reports another id for each of its stages."""
        for stage in self.protocol.stages:
            for name in stage.ids:
                if not self._has_field(name):
                    what = f"stages.{stage.name}: no message has the field {name}"
                    self.diagnostics.add(stage.place, "SW021", what)
        reports = {
            family: entry["reports_stage"]["field"]
            for family, entry in self.protocol.units["families"].items()
            if "reports_stage" in entry
        }
        for family, name in reports.items():
            path = ("families", family, "reports_stage")
            message = name.partition(".")[0]
            if not self._has_field(name):
                self.refuse("SW021", path, f"no message has the field {name}")
            elif not _is_reply(self.protocol, self.of_name[message]):
                what = f"{message} is not the reply to a request"
                self.refuse("SW084", path, what, "name a field of a message that answers a request")
        for key, unit in self.units.items():
            name = reports.get(unit["family"], "")
            if not name:
                continue
            if self._has_field(name) and name.partition(".")[0] not in self.protocol.messages_of(
                unit
            ):
                what = f"its family reports the stage in {name}, which is not among its messages"
                self.refuse("SW084", ("units", key), what)
            seen: dict[int, str] = {}
            for stage in self.protocol.stages:
                if name in stage.ids and stage.name in unit["stages"]:
                    other = seen.setdefault(stage.ids[name].id, stage.name)
                    if other != stage.name:
                        what = f"{stage.name} and {other} have the same id in {name}"
                        hint = "correct one of them, or leave out both"
                        self.refuse("SW084", ("units", key, "stages"), what, hint)

    def _has_field(self, name: str) -> bool:
        """Return whether a message has a field, both named as in ``HW_GET_INFO.stage_id``."""
        message, _, field = name.partition(".")
        layouts = self.of_name[message].layouts if message in self.of_name else ()
        return any(one.name == field for layout in layouts for one in layout.all_fields)

    def _moved(self, unit: Json) -> set[str]:
        """Return the quantities of the targets of a unit that have a scale for each stage."""
        return {
            field.quantity.name
            for name in self.protocol.messages_of(unit)
            for layout in self.of_name[name].layouts
            for field in layout.all_fields
            if field.target and field.quantity and field.quantity.rule.get("by") == "stage"
        }

    def groups(self) -> None:
        """Check that the units of a group report the same status, and have the scales by which they move."""
        aliases = self.protocol.units.get("aliases", {})
        for group in self.protocol.controllers:
            like = {name: aliases.get(name, {}).get("like", name) for name in group.members}
            units = {name: self.units[like[name]] for name in like if like[name] in self.units}
            seen: dict[str, str] = {}
            for name, unit in units.items():
                if "status" in unit:
                    seen.setdefault(unit["status"], name)
            if len(seen) > 1:
                shown = " and ".join(f"{name} {status}" for status, name in seen.items())
                what = f"controllers.{group.name}: its units report different statuses: {shown}"
                self.diagnostics.add(
                    group.place, "SW084", what, "move one of them to another group"
                )
            moved = set().union(*map(self._moved, units.values()))
            for stage in self.protocol.stages:
                for quantity in sorted(moved - {*stage.scales.get(group.name, moved)}):
                    what = f"stages.{stage.name}: no scale of {quantity} on {group.name}"
                    hint = (
                        "add it: units of this group move by it. Or write `unknown` with the reason"
                    )
                    self.diagnostics.add(stage.place, "SW084", what, hint)
