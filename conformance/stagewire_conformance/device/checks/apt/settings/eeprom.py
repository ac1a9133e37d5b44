"""``eeprom``: a message that saves a parameter set is not answered, and changes no value.

Only a power cycle could show whether the set was saved. One value is changed before, if that is harmless and
allowed, so that a controller that falls back to other values shows. Because the memory wears out, each
channel saves one set once, and a second time to save the current values again. The previously saved values
cannot be read, and are overwritten with the current ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import UNSOLICITED, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.clean import clean
from stagewire_conformance.device.checks.apt.replies import judge_unasked
from stagewire_conformance.device.checks.apt.settings.care import CARE, Care
from stagewire_conformance.device.checks.apt.settings.sets import Neighbours, PlacedSet, placed_sets
from stagewire_conformance.device.checks.apt.settings.variants import first_variant, why_not_now
from stagewire_conformance.device.checks.apt.wording import described, joined
from stagewire_conformance.device.permissions import Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


_FIRST: Final = ("MOT_AVMODES", "PZ_TPZ_DISPSETTINGS", "MOT_JOGPARAMS")
"""Sets to save in preference to others: those with the least effect."""
_QUIET: Final = 0.3
"""Seconds in which a reply would arrive."""


def _saving(declared: Declaration, place: Target) -> list[str]:
    """Return the messages in the list of a target that save settings."""
    entries = declared.registry.messages
    return [name for name in sorted(place.listed) if entries[name]["effect"] == "eeprom"]


def _rank(placed: PlacedSet) -> int:
    return _FIRST.index(placed.set.name) if placed.set.name in _FIRST else len(_FIRST)


KIND = Kind(
    name="eeprom",
    title="Saving parameters gets no reply and changes no values",
    rules=("eeprom-message-id", "piezo-eeprom-message-id", "command-without-acknowledgement"),
)


def _savings(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    chosen: dict[tuple[str, int], PlacedSet] = {}
    for placed in sorted(placed_sets(declared), key=_rank):
        if (
            _saving(declared, placed.place)
            and placed.set.effect == "settings"
            and not placed.set.skip
        ):
            channel = placed.channel or placed.place.channels[0]
            chosen.setdefault((placed.place.name, channel), placed)
    for (name, channel), placed in sorted(chosen.items()):
        saving = _saving(declared, placed.place)[0]
        yield Case(
            name=f"{name}/{saving}/{channel}",
            arguments={"placed": placed, "saving": saving, "channel": channel},
            messages=(saving, *placed.set.messages),
            skip=placed.place.why_not(saving),
        )


@KIND.check(
    "{saving} saves {placed.set.set} at {placed.text} without a reply",
    needs={Need.EEPROM},
    does="saves {placed.set.set} to the EEPROM for each channel, with one value changed for a moment and "
    "then with the current values, and overwrites the saved ones",
    seconds=0.5,
    each=_savings,
)
def _run(trial: Trial, placed: PlacedSet, saving: str, channel: int) -> None:
    before = placed.read(trial)
    others = Neighbours.of(trial, placed)
    id = trial.declared.registry.messages[placed.set.set]["id"]
    has_id = "msg_id" in trial.declared.registry.fields(saving, "data")  # a TTC001 saves everything
    message = trial.declared.make(saving, channel, **({"msg_id": id} if has_id else {}))
    care = CARE.get(placed.set.name, Care())
    saved = dict(before)
    changed = None
    if trial.allowed.settings and not why_not_now(trial, placed, care):
        changed = first_variant(placed.set, care, before, trial.random)
    if changed is not None:
        name, value = changed
        saved[name] = value
        placed.undo(trial, before)  # saving may change the values again
        trial.undo(
            f"saved {placed.set.set} at {placed.text}",
            lambda: trial.line.send(message, placed.place.address),
        )
    placed.undo(trial, before)
    if saved != before:
        placed.write(trial, saved)
    trial.line.send(message, placed.place.address)
    for heard in joined(trial.line.listen(_QUIET)):
        when = f"after {saving} to {placed.text}"
        if heard.raw[:2] == message.pack(placed.place.address, trial.declared.framed.host)[:2]:
            trial.must(
                False,
                f"{when}, the controller sent {described(trial, [heard])}; it should get no reply",
                rule="command-without-acknowledgement",
                cause=Cause(saving, UNSOLICITED),
                came=heard.raw,
            )
        else:
            judge_unasked(trial, heard, when)
    if not clean(trial, f"after {saving}", placed.place):
        return
    came = placed.ask(trial)
    trial.must(
        placed.values(came) == saved,
        f"{placed.text}: {saving} saved {placed.set.set}, but its values changed; they "
        "should stay the same",
        wanted=placed.expected(trial, saved, came),
        came=came.raw,
        rule="piezo-eeprom-message-id" if saving.startswith("PZ_") else "eeprom-message-id",
    )
    others.judge(trial, f"{saving} was sent")
