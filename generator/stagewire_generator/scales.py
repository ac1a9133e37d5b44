"""Every scale of a registry, one by one, wherever it stands there: what targets and lint rules walk over."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from stagewire_generator.diagnostics import Place
from stagewire_generator.model import Factor, Json, Protocol, Quantity


@dataclass(frozen=True, slots=True)
class ScaleEntry:
    """One scale, known or unknown.

    :param words: what it is called after: the quantity and its case or unit, or stage, controller, quantity.
    :param scale: a factor; or the rule of a scale that a setting decides; or why it is unknown.
    :param of: what beside the quantity decides on it, in words; may be empty.
    :param page: where it stands if the scale does not say so itself.
    :param overlay: whose pages these are.
    :param controller: the stage on a controller that it belongs to, in words.
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
        """The name that generated code has for it, in small letters."""
        return "_".join(self.words).lower()

    @property
    def is_known(self) -> bool:
        """Whether there is a scale, rather than the reason why there is none."""
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
        for controller, scales in stage.scales.items():
            for name, found in scales.items():
                if name not in quantities or controller not in units:
                    continue  # a mistake of the spec, which is reported elsewhere
                yield ScaleEntry(
                    words=(stage.name, controller, name),
                    quantity=quantities[name],
                    unit=quantities[name].unit,
                    scale={"unknown": found} if isinstance(found, str) else found,
                    of=f"of {stage.name} on {controller}",
                    page=stage.page,
                    overlay=stage.overlay,
                    place=stage.place,
                    controller=f"{stage.name}: {stage.title}. {controller}: {units[controller]}.",
                )


def _cases(entry: ScaleEntry) -> Iterator[ScaleEntry]:
    """Yield an entry, or one for each case or unit that decides; those of stages stand with these."""
    scale = entry.scale
    if isinstance(scale, Factor):
        yield entry
    elif "cases" in scale:
        for name, case in scale["cases"].items():
            of = f"when {scale['setting']} is {name}"
            words = (*entry.words, name)
            yield from _cases(
                replace(entry, words=words, unit=case["unit"], scale=case["scale"], of=of)
            )
    elif "units" in scale:
        for name, factor in scale["units"].items():
            of = ", ".join(filter(None, (entry.of, f"on {name}")))
            yield replace(entry, words=(*entry.words, name), scale=factor, of=of)
    elif scale.get("by") != "stage":
        yield entry
