"""Iterate over all scales of a registry, for targets and lint rules."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from stagewire_generator.diagnostics import Place
from stagewire_generator.model import (
    Json,
    Protocol,
)
from stagewire_generator.model_scales import (
    Conflict,
    Factor,
    Quantity,
    Stage,
)

FACTOR = re.compile(r"(?:counts_per_[a-z0-9_]+|[a-z0-9_]+_per_count)\Z")
"""The key of a factor, which names its unit and its direction."""
RATIONAL = re.compile(r"[1-9][0-9]*(?:/[1-9][0-9]*)?\Z")


class ScaleEntry(NamedTuple):
    """One scale, known or unknown.

    :param words: the parts of its name: quantity and case or unit; or stage, controller and quantity, and the
        source if several contradict each other.
    :param scale: a factor, the rule of a scale that depends on a setting, or the reason why it is unknown.
    :param of: what else it depends on, in words; may be empty.
    :param page: its page, unless the scale has a page itself.
    :param overlay: the overlay whose document the page belongs to.
    :param controller: the stage and controller that it belongs to, in words.
    """

    words: tuple[str, ...]
    quantity: Quantity
    unit: str
    scale: Factor | Json
    of: str
    page: int
    overlay: str
    place: Place
    controller: str = ""

    @property
    def name(self) -> str:
        """The name in generated code, in lower case."""
        return "_".join(self.words).lower()

    @property
    def is_known(self) -> bool:
        """Whether the scale is known; otherwise ``scale`` has the reason."""
        return isinstance(self.scale, Factor) or "unknown" not in self.scale


def scales_of(protocol: Protocol) -> Iterator[ScaleEntry]:
    """Yield all scales of a protocol: those of quantities, sorted by name, then those of stages."""
    quantities = {quantity.name: quantity for quantity in protocol.quantities}
    for name, quantity in sorted(quantities.items()):
        yield from _cases(
            ScaleEntry(
                words=(name,),
                quantity=quantity,
                unit=quantity.unit,
                scale=quantity.factor or quantity.rule,
                of="",
                page=quantity.page,
                overlay=quantity.overlay,
                place=quantity.place,
            )
        )
    units = {controller.name: ", ".join(controller.members) for controller in protocol.controllers}
    for stage in sorted(protocol.stages, key=lambda stage: stage.name):
        called = f"{_called(stage)}: {stage.title}."
        for controller, scales in stage.scales.items():
            if controller not in units:
                continue  # an error in the spec, which is reported elsewhere
            of = f"of {stage.name} on {controller}"
            whole = f"{called} {controller}: {units[controller]}."
            for name, found in scales.items():
                if name not in quantities:
                    continue  # the same
                entry = ScaleEntry(
                    words=(stage.name, controller, name),
                    quantity=quantities[name],
                    unit=quantities[name].unit_on(stage),
                    scale=found if isinstance(found, Factor) else {"unknown": found},
                    of=of,
                    page=stage.page,
                    overlay=stage.overlay,
                    place=stage.place,
                    controller=whole,
                )
                if isinstance(found, Conflict):
                    yield from _by_source(entry, found)
                else:
                    yield entry


def _called(stage: Stage) -> str:
    """Return the name of a stage, and those in the catalogue if they differ."""
    others = ", ".join(name for name in stage.catalogue if name != stage.name)
    return f"{stage.name} ({others})" if others else stage.name


def _by_source(entry: ScaleEntry, conflict: Conflict) -> Iterator[ScaleEntry]:
    """Yield an entry for each source; the user chooses one by its name."""
    for source, factor in conflict.factors.items():
        others = " and ".join(name for name in conflict.factors if name != source)
        of = f"{entry.of} according to {source}, which contradicts {others}"
        yield entry._replace(words=(*entry.words, source), scale=factor, of=of)


def _cases(entry: ScaleEntry) -> Iterator[ScaleEntry]:
    """Yield an entry, or one entry for each case or unit; scales by stage are yielded with the stages."""
    scale = entry.scale
    if isinstance(scale, Factor):
        yield entry
    elif "cases" in scale:
        for name, case in scale["cases"].items():
            of = f"when {scale['setting']} is {name}"
            words = (*entry.words, name)
            yield from _cases(
                entry._replace(words=words, unit=case["unit"], scale=case["scale"], of=of)
            )
    elif "units" in scale:
        for name, factor in scale["units"].items():
            of = ", ".join(filter(None, (entry.of, f"on {name}")))
            yield entry._replace(words=(*entry.words, name), scale=factor, of=of)
    elif scale.get("by") != "stage":
        yield entry
