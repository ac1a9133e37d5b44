"""Check that the facts about units agree: messages, status, addresses, bays and serial numbers.

All names are known here: ``lint/names.py`` reports those that are not.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint.classes import wrong_classes
from stagewire_generator.lint.devices import HARMLESS
from stagewire_generator.lint.unit_messages import unknown_positions, wrong_orders
from stagewire_generator.model import (
    Json,
    Message,
    Protocol,
    firmware_parts,
)
from stagewire_generator.strict_yaml import Document


def check_units(protocol: Protocol, document: Document, diagnostics: Diagnostics) -> None:
    """Check the units of a protocol.

    :param document: the file of the units, for the positions of errors.
    """
    rules = _Rules(protocol, document, diagnostics)
    rules.lists()
    rules.messages()
    rules.statuses()
    rules.contexts()
    rules.positions()
    rules.hazards()
    rules.classes()
    rules.orders()
    if "addresses" in protocol.units and "devices" in protocol.framing:
        rules.addresses()
    rules.prefixes()


_CAUSED = ("completes_with", "stops_with", "starts")


def _replies(message: Message, sets: Mapping[str, Mapping[str, str]]) -> list[str]:
    """Return the messages that answer a message.

    :param sets: the members of each set of messages, by their part in it.
    """
    replies = [*message.exchange.get("answered_by", ()), *message.exchange.get("announces", ())]
    if message.set and message.set[1] == "req" and "get" in sets[message.set[0]]:
        replies.append(sets[message.set[0]]["get"])
    return replies


class UnitRules:
    """Rules about the file of the units, each a method of a subclass."""

    def __init__(self, protocol: Protocol, document: Document, diagnostics: Diagnostics) -> None:
        self.protocol = protocol
        self.document = document
        self.diagnostics = diagnostics
        self.units: Json = protocol.units["units"]
        self.of_name = {message.name: message for message in protocol.messages}

    def refuse(self, code: str, path: tuple[str | int, ...], what: str, hint: str = "") -> None:
        """Report an error at a position in the file of the units."""
        where = ".".join(str(part) for part in path if isinstance(part, str))
        self.diagnostics.add(self.document.place(*path), code, f"{where}: {what}", hint)


class _Rules(UnitRules):
    """The rules, each a method."""

    def __init__(self, protocol: Protocol, document: Document, diagnostics: Diagnostics) -> None:
        super().__init__(protocol, document, diagnostics)
        self.families: Json = protocol.units["families"]
        members = {group.name: group.members for group in protocol.sets}
        self.replies = {m.name: _replies(m, members) for m in protocol.messages}
        self.requests: dict[str, list[str]] = {}  # message -> the messages that it answers
        self.causes: dict[str, set[str]] = {}  # message -> the messages after which it is sent
        for message in protocol.messages:
            for reply in self.replies[message.name]:
                self.requests.setdefault(reply, []).append(message.name)
            ends = (message.exchange.get(key, ()) for key in _CAUSED)
            for name in {*self.replies[message.name], *(name for names in ends for name in names)}:
                self.causes.setdefault(name, set()).add(message.name)

    def lists(self) -> None:
        """Check that each list of a unit adds messages, and that a family is like one of its own units."""
        for name, unit in self.units.items():
            keys = [unit["list"], *unit.get("more_lists", ())] if "list" in unit else []
            for key in keys if len(keys) > 1 else ():
                others = [other for other in keys if other != key]
                if not self._listed([key]) - self._listed(others):
                    index = self.protocol.units["lists"][key]["units"].index(name)
                    what = f"{name} already has these messages from {' and '.join(others)}"
                    self.refuse("SW083", ("lists", key, "units", index), what)
        for key, entry in self.families.items():
            other = entry.get("like")
            if other and self.units[other]["family"] != key:
                what = f"{other} belongs to the family {self.units[other]['family']}"
                hint = f"name a unit of {key}, or correct the family of {other}"
                self.refuse("SW083", ("families", key, "like"), what, hint)

    def _listed(self, keys: Iterable[str]) -> set[str]:
        """Return the messages of lists, completed."""
        entries = [self.protocol.units["lists"][key] for key in keys]
        return {name for e in entries for name in (*e["messages"], *e.get("completes", ()))}

    def messages(self) -> None:
        """Check that each list is complete: no request without reply, no motion without a stop.

        The lists of a unit complete each other.
        """
        for key, entry in self.families.items():
            names = {*entry.get("messages", ())}
            for name, what, missing in self._gaps(names, names):
                hint = f"add {missing}, or remove {name}"
                self.refuse("SW080", ("families", key, "messages"), what, hint)
        lists = self.protocol.units.get("lists", {})
        gaps: dict[tuple[str, str], str] = {}  # list and error -> the missing messages
        for unit in self.units.values():
            keys = [unit["list"], *unit.get("more_lists", ())] if "list" in unit else []
            listed = self._listed(keys)
            moving = {name for key in keys for name in lists[key].get("cannot_stop", ())}
            for key in keys:
                for _, what, missing in self._gaps(self._listed([key]), listed, moving):
                    gaps[key, what] = missing
        for (key, what), missing in gaps.items():
            hint = f"add {missing}, under `completes` if the list does not print it"
            self.refuse("SW080", ("lists", key, "messages"), what, hint)
        for key, entry in lists.items():
            for name in entry.get("cannot_stop", ()):
                halts = self.of_name[name].exchange.get("halted_by", ())
                if not halts or name not in self._listed([key]):
                    what = f"{name} is not a message of the list that another message halts"
                    self.refuse("SW080", ("lists", key, "cannot_stop", name), what, "remove it")

    def _gaps(
        self, names: set[str], others: set[str], moving: Container[str] = ()
    ) -> Iterator[tuple[str, str, str]]:
        """Yield each listed message that lacks another, the error, and the missing message.

        :param others: all messages of the unit.
        :param moving: messages whose motion nothing halts.
        """
        for name in sorted(names):
            for what, missing in self._missing(self.of_name[name], others):
                yield name, what, missing
            halts = self.of_name[name].exchange.get("halted_by", [])
            if halts and name not in moving and not others & {*halts}:
                what = f"{name} is listed, but no message that halts it"
                yield name, what, " or ".join(halts)

    def _missing(self, message: Message, names: set[str]) -> Iterator[tuple[str, str]]:
        """Yield each message that a list lacks although it has another, with the reason."""
        for reply in self.replies[message.name]:
            if reply not in names:
                yield f"{message.name} is listed, but its reply {reply} is not", reply
        requests = self.requests.get(message.name, [])
        causes = names & self.causes.get(message.name, set())
        if requests and not causes and not message.exchange.get("unsolicited"):
            what = f"{message.name} is listed, but no request that it answers"
            yield what, " or ".join(requests)

    def contexts(self) -> None:
        """Check that the firmware selects at most one value of each context."""
        for name, unit in self.units.items():
            for context, values in unit.get("contexts", {}).items():
                seen = set()
                for index, entry in enumerate(values if isinstance(values, list) else ()):
                    since = ".".join(map(str, firmware_parts(entry)))
                    while since.endswith(".0"):
                        since = since.removesuffix(".0")
                    if since in seen:
                        shown = f"firmware {since} and later" if since else "all firmware"
                        what = f"two values apply to {shown}"
                        self.refuse("SW091", ("units", name, "contexts", context, index), what)
                    seen.add(since)

    def statuses(self) -> None:
        """Check the status and the keep-alive message of each unit against its messages."""
        known = {message.exchange.get("reports_status") for message in self.protocol.messages}
        sets = {m.name for m in self.protocol.messages if m.set and m.set[1] == "set"}
        for name, unit in self.units.items():
            messages = [self.of_name[m] for m in sorted(self.protocol.messages_of(unit))]
            reported = {
                m.exchange["reports_status"]: m for m in messages if "reports_status" in m.exchange
            }
            status = unit.get("status", "none")
            addressed = "addresses" in self.protocol.units
            if ("status" in unit or addressed) and reported.keys() != known & {status}:
                shown = " and ".join(f"{s} ({m.name})" for s, m in sorted(reported.items()))
                what = f"{status} contradicts its messages, which report {shown or 'none'}"
                self.refuse("SW081", ("units", name, "status"), what)
            keepers = {m.name for m in messages if m.exchange.get("keeps_alive")}
            keeper = unit.get("keep_alive")
            if keeper and keeper not in (keepers or {"none"}):
                found = " and ".join(sorted(keepers)) or "none"
                what = f"{keeper}, but its keep-alive message is {found}"
                hint = "correct `keep_alive`, or the list or family of the unit"
                self.refuse("SW081", ("units", name, "keep_alive"), what, hint)
            required = unit.get("reports_ends_after")
            if required and required not in sets:
                what = f"{required} is not the SET of a parameter set"
                self.refuse("SW021", ("units", name, "reports_ends_after"), what)

    def hazards(self) -> None:
        """Check that the hazards of a family add to those of the messages of its units."""
        for key, entry in self.families.items():
            units = [unit for unit in self.units.values() if unit["family"] == key]
            messages = {name for unit in units for name in self.protocol.messages_of(unit)}
            for name, hazard in entry.get("hazards", {}).items():
                path = ("families", key, "hazards", name)
                if name not in messages:
                    self.refuse("SW072", path, "not a message of its units")
                elif self.of_name[name].hazard:
                    what = f"{name} has the hazard {self.of_name[name].hazard} on all units"
                    self.refuse("SW072", path, what)
                elif self.of_name[name].effect in HARMLESS:
                    effect = self.of_name[name].effect
                    what = f"{name} has the effect {effect}, which excludes the hazard {hazard}"
                    self.refuse("SW072", path, what)

    def positions(self) -> None:
        """Check the messages, fields, values and bits of units that have only a few positions."""
        for key, entry in self.families.items():
            for part, what in unknown_positions(entry.get("positions"), self.of_name):
                self.refuse("SW021", ("families", key, "positions", part), what)

    def classes(self) -> None:
        """Check how device classes present the units of each family."""
        sets = {owner.name for owner in self.protocol.sets}
        for key, entry in self.families.items():
            for code, path, what in wrong_classes(entry.get("classes", {}), self.of_name, sets):
                self.refuse(code, ("families", key, "classes", *path), what)

    def orders(self) -> None:
        """Check the messages that switch off the outputs of units, or end their loops."""
        for name in self.units:
            for part, what in wrong_orders(self.protocol, name):
                self.refuse("SW085", ("units", name, *part), what)

    def addresses(self) -> None:
        """Check that addresses and bays are those of the framing, and the counts of bays."""
        known = self.protocol.units["addresses"]
        framing = self.protocol.framing
        host, bays = known["host"]["value"], known["bays"]
        if host != framing["host"]:
            what = f"{host:#04x} is not the host of the framing, {framing['host']:#04x}"
            self.refuse("SW082", ("addresses", "host", "value"), what)
        named: dict[tuple[str | int, ...], int] = {
            ("addresses", owner, "value"): known[owner]["value"]
            for owner in ("motherboard", "generic_usb")
        }
        named |= {("addresses", "bays", end): bays[end] for end in ("first", "last")}
        owners = [("families", self.families), ("units", self.units)]
        for section, name, entry in (
            (s, n, e) for s, entries in owners for n, e in entries.items()
        ):
            for index, address in enumerate(entry.get("also_at", {}).get("addresses", ())):
                at = (section, name, "also_at", "addresses", index)
                named[at] = address
                if address == known["generic_usb"]["value"]:
                    what = f"{address:#04x} is already the address of a unit with its own USB node"
                    self.refuse("SW082", at, what, "remove it, or correct it")
            found = entry.get("also_at", {})
            if "preferred" in found and found["preferred"] not in found["addresses"]:
                what = f"{found['preferred']:#04x} is not one of the `addresses`"
                self.refuse("SW082", (section, name, "also_at", "preferred"), what)
        for path, address in named.items():
            if address not in framing["devices"]:
                what = f"{address:#04x} is not one of the `devices` of the framing"
                self.refuse("SW082", path, what)
        in_bays = range(bays["first"], bays["last"] + 1)
        for address in {*framing["devices"]} - {*named.values(), *in_bays}:
            what = f"{address:#04x} is one of the `devices` of the framing, but not an address here"
            self.refuse("SW082", ("addresses",), what)
        if bays["count"] != len(in_bays):
            what = f"{bays['first']:#04x} to {bays['last']:#04x} are {len(in_bays)} addresses"
            self.refuse("SW082", ("addresses", "bays", "count"), f"{bays['count']}, but {what}")
        for name, unit in self.units.items():
            if unit.get("bays", 0) > bays["count"]:
                what = f"{unit['bays']}, but `addresses` has {bays['count']} bays"
                self.refuse("SW082", ("units", name, "bays"), what)

    def prefixes(self) -> None:
        """Check that units with the same prefix are alike, and that a unit has one prefix."""
        printed: dict[str, str] = {}  # prefix -> the first unit that has it
        owned: dict[str, str] = {}  # unit -> its prefix
        for name, unit in self.units.items():
            for key in ("usb_prefix", "card_usb_prefix"):
                if key not in unit:
                    continue
                prefix = str(unit[key])
                self._length(("units", name, key), name, prefix)
                owned[name] = str(unit["usb_prefix"]) if "usb_prefix" in unit else prefix
                other = printed.setdefault(prefix, name)
                if self.units[other]["family"] != unit["family"]:
                    what = f"{prefix} is the prefix of {other}, which is of another family"
                    hint = "look up the prefix, and the families: units with one prefix are of one family"
                    self.refuse("SW083", ("units", name, key), what, hint)
        aliases = self.protocol.units.get("aliases", {})
        refused = self.protocol.units.get("unsupported", {}).values()
        unsupported = {prefix for one in refused for prefix in one.get("prefixes", ())}
        for prefix, entry in self.protocol.units.get("known_prefixes", {}).items():
            path = ("known_prefixes", prefix, "unit")
            owner = printed.get(prefix)
            names = (entry["unit"], *entry.get("shared_with", ()))
            alone = owner is None and len(names) == 1 and int(prefix) not in unsupported
            if "distinguished_by" in entry and alone:
                what = f"only {names[0]} has the prefix {prefix}"
                self.refuse("SW083", (*path[:2], "distinguished_by"), what, "remove it")
            for name in names:
                self._length(path, name, prefix)
                if name in owned:
                    hint = f"keep one prefix for {name}"
                    self.refuse("SW083", path, f"{name} has the prefix {owned[name]}", hint)
                owned[name] = prefix
                like = self.units.get(aliases.get(name, {}).get("like", name), {})
                kin = owner and like.get("family") == self.units[owner]["family"]
                if owner and not kin and "distinguished_by" not in entry:
                    what = f"{prefix} is the prefix of {owner}, and {name} is not of its family"
                    hint = "correct the prefix, or state in `distinguished_by` how they differ"
                    self.refuse("SW083", path, what, hint)
        self._unsupported(printed)

    def _length(self, path: tuple[str, ...], name: str, prefix: str) -> None:
        """Check that a prefix and six more digits are as long as the serial numbers of a unit."""
        digits = self.units.get(name, {}).get("serial_digits", 8)
        if name in self.units and len(prefix) + 6 != digits:
            what = f"{prefix} begins {len(prefix) + 6} digits, but serial numbers of {name} have {digits}"
            self.refuse("SW083", path, what, f"correct the prefix, or `serial_digits` of {name}")

    def _unsupported(self, printed: Mapping[str, str]) -> None:
        """Check that an unsupported unit is not described elsewhere, and shares no prefix of another unit."""
        known = self.protocol.units.get("known_prefixes", {})
        for name, entry in self.protocol.units.get("unsupported", {}).items():
            for prefix in map(str, entry.get("prefixes", ())):
                owner = printed.get(prefix) or known.get(prefix, {}).get("unit")
                if owner:
                    what = f"{prefix} is the prefix of {owner}"
                    hint = f"remove it; if both have it, share {prefix} under `known_prefixes`"
                    self.refuse("SW083", ("unsupported", name, "prefixes"), what, hint)
            described = name in self.units or name in self.protocol.units.get("aliases", {})
            if described:
                what = f"{name} is described as a unit or an alias"
                self.refuse("SW083", ("unsupported", name), what, "remove one of the two")
            for other, unit in self.units.items():
                if name in unit.get("reported_as", ()):
                    what = f"{other} is known to report {name}"
                    self.refuse("SW083", ("unsupported", name), what, "remove one of the two")
