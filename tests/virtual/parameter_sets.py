"""The parameter sets of every unit for tests: their messages, and distinct values."""

from __future__ import annotations

from typing import Any

from apt_host import BAY, USB
from registry_oracle import limits

from stagewire_apt import PROTOCOL
from stagewire_virtual.factory import why_not
from stagewire_virtual.instrument import units_of

UNITS = {name: unit for name, unit in units_of(PROTOCOL).items() if not why_not(unit)}
"""The units that can be simulated."""
ENABLE_MODE = "PZMOT_SET_KCUBECHANENABLEMODE"


def address_of(unit: str) -> int:
    """Return the address of a unit's channels, for a rack of those in the first bay."""
    return USB if UNITS[unit].facts["address"] == "generic_usb" else BAY


def idents_of(unit: str) -> list[int]:
    """Return the values of a unit's channels in messages: numbers, or bits."""
    numbers = range(1, UNITS[unit].facts["channels"] + 1)
    bits = "channel_idents" in UNITS[unit].facts
    return [1 << number - 1 if bits else number for number in numbers]


def plain_sets(unit: str) -> list[tuple[Any, Any, Any]]:
    """Return (SET, REQ, GET) of the sets that a unit stores and returns.

    A set whose request also names a connector, and a set of the unit as a whole, are left out.
    """
    registry = PROTOCOL.registry()["sets"]
    found = [
        tuple(PROTOCOL.message_class(names[role]) for role in ("set", "req", "get"))
        for names in registry.values()
        if {"set", "req", "get"} <= names.keys()
        and {names["set"], names["req"], names["get"]} <= UNITS[unit].messages
        and not names["set"].startswith(("RACK_", "HW_"))
    ]
    return [one for one in found if {*one[1].__match_args__} <= {"chan_ident"}]


def channel_of(message: Any, ident: int = 1) -> dict[str, int]:
    """Return the channel as keyword arguments of a message; empty for a message without a channel."""
    return {"chan_ident": ident} if "chan_ident" in message.layout.fields else {}


def wanted_values(unit: str, set_: Any, seed: int) -> dict[str, Any]:
    """Return a value for each field that can be set; different seeds give different values if possible."""
    entry = next(e for e in PROTOCOL.registry()["messages"] if e["name"] == set_.layout.message)
    values: dict[str, Any] = {}
    layout = next(layout for layout in entry["layouts"] if layout["form"] == set_.layout.form)
    for field in [layout["param1"], layout["param2"], *layout["fields"]]:
        if field is None or field["role"] != "value" or field["name"] == "chan_ident":
            continue
        if field["kind"] == "text":
            values[field["name"]] = f"PART{seed}"
        elif set_.layout.message == ENABLE_MODE and UNITS[unit].facts["channels"] == 1:
            values[field["name"]] = 1  # page 394: only channel 1
        elif "enum" in field:
            lowest, highest = limits(field, unit)
            listed = sorted(v for v in field["enum"].values() if lowest <= v <= highest)
            values[field["name"]] = listed[-seed % len(listed)]
        else:
            lowest, highest = limits(field, unit)
            values[field["name"]] = min(highest, lowest + 40 + seed)
    return values
