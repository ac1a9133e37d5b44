"""A message that sets something, with a byte too few: nothing should be set by it.

It carries a changed value, so that who takes it is seen; therefore it needs leave to change settings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

from stagewire.errors import CodecError
from stagewire.protocols import HEADER_SIZE
from stagewire_conformance.device.check import Check, Need
from stagewire_conformance.device.checks.apt.clean import clean, unheeded
from stagewire_conformance.device.checks.apt.settings.care import CARE, Care, When
from stagewire_conformance.device.checks.apt.settings.sets import Spot, Values, spots
from stagewire_conformance.device.checks.apt.settings.variants import first_variant

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial

__all__ = ["short_checks"]


def short_checks(declared: Declared, allowed: Permissions) -> Iterator[Check]:
    """Give a check for each place where a parameter set can be changed without a further thought."""
    for place in declared.places:
        of_place = [
            spot for spot in spots(declared) if spot.place is place and _is_fit(declared, spot)
        ]
        if of_place:
            yield Check(
                id=f"wrong-length/short/{place.name}",
                title=f"A message to {place.name} whose packet is too short sets nothing",
                messages=tuple(
                    dict.fromkeys(name for each in of_place for name in each.set.messages)
                ),
                run=partial(_run, of_place),
                needs=frozenset({Need.SETTINGS}),
                does="sends a setting with a byte too few, which should change nothing, and puts it back",
                seconds=0.5,
            )


def _is_fit(declared: Declared, spot: Spot) -> bool:
    care = CARE.get(spot.set.name, Care())
    layout = declared.registry.messages[spot.set.set]["layouts"][0]
    plain = spot.set.effect == "settings" and not spot.set.skip and care.when is When.ALWAYS
    return bool(plain and care.fields and layout["length"] > 1)


def _run(of_place: Sequence[Spot], trial: Trial) -> None:
    for spot in trial.random.sample(of_place, len(of_place)):
        before = spot.read(trial)
        variant = first_variant(spot.set, CARE[spot.set.name], before, trial.random)
        if variant is None:
            continue
        changed = {**before, variant[0]: variant[1]}
        try:
            raw, length = _shortened(trial, spot, changed)
        except CodecError:
            continue  # what was told cannot be set, which other checks say
        if not trial.line.refusal(raw):  # which looks for messages among the values, too
            break
    else:
        trial.inconclusive("none of the settings has a value that could be changed a little")
        return
    trial.undo(f"{spot.set.set} at {spot.text}", lambda: spot.put_back(trial, before))
    about = f"{spot.set.set} with a packet of {length} bytes, where it has {length + 1}"
    unheeded(trial, raw, about)
    if clean(trial, f"after {about}", spot.place):
        now = spot.read(trial)
        trial.should(
            now == before,
            f"{about}, changed {', '.join(name for name in now if now[name] != before[name])}; a message "
            "that is not whole should set nothing",
            came=raw,
        )


def _shortened(trial: Trial, spot: Spot, values: Values) -> tuple[bytes, int]:
    """Return the frame that would write values, with a byte too few, and the length that it declares."""
    message = trial.declared.make(spot.set.set, spot.channel, **values)
    whole: bytes = message.pack(spot.place.address, trial.declared.framed.host)
    length = len(whole) - HEADER_SIZE - 1
    return whole[:2] + length.to_bytes(2, "little") + whole[4:-1], length
