"""A colon or 255 in the data: the report states which of two interpretations a controller follows.

Section 2 counts as data as many bytes as the size states, including colons, but also states that any colon
clears the buffers. Section 1 places 255 before the letter of a setup command, and does not say whether this
also holds within a command. A controller may follow either interpretation, but nothing in between.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis, Clean
from stagewire_conformance.device.checks.ms2000.axis_check import AxisCase, axis_check, first_place
from stagewire_conformance.device.checks.ms2000.harmless import harmless_bytes
from stagewire_conformance.device.checks.ms2000.stored import INCREMENT, keep
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Need, Permissions
from stagewire_ms2000 import PROTOCOL

_COLON: Final = PROTOCOL.marks.terminator
_SIZE: Final = INCREMENT.write.layout.length
_NOTHING: Final = bytes((PROTOCOL.marks.prefix, ord("B")))
"""The setup command that changes nothing, because the low-level format is active."""

_COLONS: Final = {"low": (0,), "middle": (1,), "high": (2,), "all": (0, 1, 2)}
"""Name -> the data bytes that are colons."""


KIND: Final = Kind(
    name="marks-in-data",
    title="A colon or 255 in the data does not corrupt a command",
    rules=("colon-found-behind-data", "setup-prefix"),
)


_DOES: Final = "writes increments that contain colons and 255, and restores the increment"


def _first(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    yield AxisCase(place=first_place(declared, *INCREMENT.messages))


def _places_of_colons(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    for first in _first(declared, allowed):
        for name, at in _COLONS.items():
            yield replace(first, name=f"colon-{name}", arguments={"at": at})


@axis_check(
    KIND,
    f"{INCREMENT.name} with a colon in its data writes exactly that value, or nothing",
    rules=("colon-found-behind-data",),
    each=_places_of_colons,
    messages=INCREMENT.messages,
    needs={Need.SETTINGS},
    does=_DOES,
    seconds=0.3,
)
def _colons(axis: Axis, at: tuple[int, ...]) -> None:
    data = bytearray(harmless_bytes(axis.trial.random, _SIZE))
    for place in at:
        data[place] = _COLON
    _try(axis, bytes(data), "a colon in the data is data", "any colon ends a command")


@axis_check(
    KIND,
    f"{INCREMENT.name} with 255 in its data writes exactly that value, or nothing",
    rules=("setup-prefix",),
    name="prefix",
    each=_first,
    messages=INCREMENT.messages,
    needs={Need.SETTINGS},
    does=_DOES,
    seconds=0.3,
)
def _prefix(axis: Axis) -> None:
    data = _NOTHING + harmless_bytes(axis.trial.random, 1)
    _try(axis, data, "255 in the data is data", "255 and a letter are a setup command anywhere")


def _try(axis: Axis, data: bytes, taken: str, not_taken: str) -> None:
    trial, clean = axis.trial, Clean(axis.trial)
    present = keep(axis, INCREMENT)
    value = int.from_bytes(data, "little", signed=True)
    INCREMENT.set(axis, value)
    found = INCREMENT.of(axis)
    if trial.must(
        found in (value, present),
        f"{INCREMENT.name} of axis {axis.name} with the data {data.hex(' ')} changed {present} "
        f"to {found}; it should write {value}, or nothing",
        wanted=data,
        came=(found % 256**_SIZE).to_bytes(_SIZE, "little"),
        rule="colon-found-behind-data",
        cause=Cause("marks in data", EFFECT),
        because=INCREMENT.defects,
    ):
        trial.info(
            "of two interpretations of the document, the controller follows: "
            f"{taken if found == value else not_taken}"
        )
    clean.again(f"after {INCREMENT.name} with the data {data.hex(' ')}")
