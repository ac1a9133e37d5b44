"""What a controller may be, by what it reports of itself; its scales are those of that unit or alias."""

from __future__ import annotations

from collections.abc import Mapping

from stagewire.devices import Facts, Unit, candidates, clean_model

__all__ = ["names_of"]


def names_of(unit: Unit, facts: Facts, reported: Mapping[str, int | str]) -> tuple[str, ...]:
    """Return the names of all that a controller may be, whose scales must agree before one is used.

    :param unit: as which it is declared.
    :param reported: the fields of its identity.

    Empty where it reports no serial number, or where the registry has no prefixes: it is taken as declared.
    A controller that does not fit its declaration gets a name that no scale is known for.
    """
    known, number = facts.candidates(), reported.get("serial_number")
    if not isinstance(number, int) or not any(one.prefixes for one in known):
        return ()
    model = clean_model(str(reported.get("model_number", "")))
    found = candidates(known, number, model)
    fitting = tuple(one.name for one in found if one.unit == unit.name)
    return fitting or (f"a controller with the serial number {number} and the model {model!r}",)
