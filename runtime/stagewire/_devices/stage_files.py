"""The stages of a user, read from a TOML file. See ``docs/how-to/devices.md``."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import Any, Final

from stagewire._codec.protocol import usable_protocols
from stagewire.errors import BadValueError
from stagewire.quantities import Scale, Stage, UnknownScale, exact, find_stages

__all__ = ["read_stages"]

_LIMITS: Final = {
    "travel": "travel_{unit}",
    "max_velocity": "max_velocity_{unit}_per_s",
    "max_acceleration": "max_acceleration_{unit}_per_s2",
}
"""Key of a stage -> keyword of :meth:`Stage.of_user`."""
_KEYS: Final = ("unit", "title", *_LIMITS, "counts_per_unit", "controllers")
_NUMBER: Final = 'a number above 0, such as 34304, or a fraction as text, such as "16777216/125"'


def read_stages(path: str | Path) -> dict[str, Stage]:
    """Read the stages in a TOML file, and return them by name.

    Pass one of them as ``stage=`` to ``open``. The file has a table for each stage::

        [slide]
        unit = "mm"                      # or "deg" for a rotary stage
        title = "Linear slide"           # optional, like the three limits
        travel = 50                      # mm, from one end to the other
        max_velocity = 2.4               # mm/s
        max_acceleration = 4             # mm/s²

        [slide.counts_per_unit]          # on every controller
        position = 34304                 # counts per mm
        velocity = "16777216/125"        # counts per mm/s: a fraction, as text

        [slide.controllers.KST101]       # other scales on one unit or family
        position = 819200

    Numbers are exact, including decimal ones.

    Raise :class:`~stagewire.errors.BadValueError`, which names the file, the key and the expected value, for
    an unknown or missing key, an invalid value, and a stage with the name of one in the registry. Raise
    :class:`OSError` for a file that cannot be read.
    """
    path = Path(path)
    try:
        tables = tomllib.loads(path.read_text("utf-8"), parse_float=Decimal)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadValueError(f"{path}: not valid TOML: {error}") from None
    if not tables:
        raise BadValueError(f"{path}: no stage; expected a table for each stage, such as [slide]")
    found = {name: _File(path).stage(name, table) for name, table in tables.items()}
    spelled: dict[str, str] = {}
    for name in found:
        first = spelled.setdefault(name.upper(), name)
        if first != name:
            raise BadValueError(f"{path}: {name}: {first} is the same name in another case")
    return found


class _File:
    def __init__(self, path: Path) -> None:
        self._path = path

    def stage(self, name: str, table: object) -> Stage:
        given = self._table(name, table, _KEYS)
        for protocol in usable_protocols():
            if named := _built_in(protocol.package, name):
                raise self._wrong(
                    name,
                    f"{named} is a stage in the registry; choose another name, such as my-{name}",
                )
        unit = given.get("unit")
        if unit not in ("mm", "deg"):
            raise self._wrong(f"{name}.unit", 'expected "mm" or "deg"', unit)
        title = given.get("title", "your own stage")
        if not isinstance(title, str):
            raise self._wrong(f"{name}.title", "expected text", title)
        limits = {
            keyword.format(unit=unit): self._number(f"{name}.{key}", given[key])
            for key, keyword in _LIMITS.items()
            if key in given
        }
        rotary = unit == "deg"
        general = self._scales(f"{name}.counts_per_unit", given.get("counts_per_unit", {}), rotary)
        own = self._controllers(f"{name}.controllers", given.get("controllers", {}), rotary)
        if not general and not own:
            raise self._wrong(
                f"{name}.counts_per_unit", "missing; expected a table such as position = 34304"
            )
        scales: dict[str, Mapping[str, Scale | UnknownScale]] = {
            controller: {**general, **others} for controller, others in own.items()
        }
        units = _controllers()
        controllers = {controller: units[controller] for controller in own}
        if general:
            scales[""], controllers[""] = general, ()
        stage = Stage.of_user(name, rotary=rotary, **limits)  # type: ignore[arg-type]
        return replace(stage, title=title, scales=scales, controllers=controllers)

    def _controllers(self, where: str, given: object, rotary: bool) -> dict[str, dict[str, Scale]]:
        known = {name.upper(): name for name in _controllers()}
        found = {}
        for name, scales in self._table(where, given).items():
            if name.upper() not in known:
                raise self._wrong(
                    f"{where}.{name}",
                    f"unknown controller{_like(name.upper(), known.values())}; expected a unit such as "
                    "TDC001, or a family such as BBD10x",
                )
            found[known[name.upper()]] = self._scales(f"{where}.{name}", scales, rotary)
        return found

    def _scales(self, where: str, given: object, rotary: bool) -> dict[str, Scale]:
        units = _quantities(rotary)
        return {
            quantity: Scale(exact(self._number(f"{where}.{quantity}", value)), units[quantity])
            for quantity, value in self._table(where, given, units).items()
        }

    def _table(
        self, where: str, given: object, known: Iterable[str] | None = None
    ) -> dict[str, Any]:
        if not isinstance(given, dict):
            raise self._wrong(where, f"expected a table, [{where}]", given)
        for key in given:
            if known is not None and key not in known:
                listed = ", ".join(known)
                raise self._wrong(
                    f"{where}.{key}", f"unknown key{_like(key, known)}; expected {listed}"
                )
        return given

    def _number(self, where: str, value: object) -> int | Decimal | str:
        try:
            if isinstance(value, int | Decimal | str) and exact(value) > 0:
                return value
        except BadValueError:
            pass
        raise self._wrong(where, f"expected {_NUMBER}", value)

    def _wrong(self, where: str, problem: str, value: object = None) -> BadValueError:
        got = "" if value is None else f", not {str(value)!r}"
        return BadValueError(f"{self._path}: {where}: {problem}{got}")


def _built_in(package: str, name: str) -> str:
    """Return the names of the stages in a registry that ``name`` means; empty if there is none."""
    try:
        return " or ".join(stage.name for stage in find_stages(package, name))
    except ModuleNotFoundError as error:
        if error.name != f"{package}.stages":
            raise
        return ""  # a protocol without stages


def _quantities(rotary: bool) -> dict[str, str]:
    """Return the quantities whose scale depends on the stage, with their units."""
    return {
        name: entry["rotary_unit" if rotary else "unit"]
        for protocol in usable_protocols()
        for name, entry in protocol.registry().get("quantities", {}).items()
        if entry["scale"].get("by") == "stage" and "rotary_unit" in entry
    }


def _controllers() -> dict[str, tuple[str, ...]]:
    """Return the families of controllers and their units, and each unit on its own."""
    units: dict[str, tuple[str, ...]] = {}
    families: dict[str, tuple[str, ...]] = {}
    for protocol in usable_protocols():
        registry = protocol.registry()
        named = (
            *(unit["name"] for unit in registry.get("units", ())),
            *registry.get("aliases", ()),
        )
        units |= dict.fromkeys(named, ())
        for name, family in registry.get("controllers", {}).items():
            families[name] = (*family.get("units", ()), *family.get("aliases", ()))
    return families | units


def _like(name: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(name[:80], list(known), n=1)
    return f"; did you mean {close[0]}?" if close else ""
