"""Pair the entries of the old registry with those of the new one, even if they were renamed.

Entries are paired by name, or by content if the name changed. Scales are compared by their exact effect on
counts, whatever their notation.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar
from typing import Protocol as Structural

from stagewire_generator import model, model_fields, model_scales
from stagewire_generator.model import (
    Json,
)
from stagewire_generator.model_scales import (
    Factor,
    Quantity,
)

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Pairs(Generic[T]):
    """Things that are on both sides or on one side only, each in the order of its side."""

    kept: tuple[tuple[T, T], ...]
    renamed: Mapping[str, str]  # old name -> new name
    added: tuple[T, ...]
    removed: tuple[T, ...]
    reordered: bool  # whether the order of the kept things changed


def pair(
    old: Mapping[str, T], new: Mapping[str, T], signature: Callable[[T], Hashable | None]
) -> Pairs[T]:
    """Pair the things of both sides.

    An old name and a new name belong to the same thing if they have the same ``signature`` and no others do.
    A signature of None matches nothing.
    """
    gone = _by_signature({name: t for name, t in old.items() if name not in new}, signature)
    come = _by_signature({name: t for name, t in new.items() if name not in old}, signature)
    renamed = {
        names[0]: come[key][0]
        for key, names in gone.items()
        if len(names) == 1 and len(come.get(key, ())) == 1
    }
    names = [renamed.get(name, name) for name in old if name in new or name in renamed]
    found = set(names)
    return Pairs(
        kept=tuple(
            (t, new[renamed.get(n, n)]) for n, t in old.items() if renamed.get(n, n) in found
        ),
        renamed=renamed,
        added=tuple(thing for name, thing in new.items() if name not in found),
        removed=tuple(t for name, t in old.items() if name not in new and name not in renamed),
        reordered=names != [name for name in new if name in found],
    )


def _by_signature(
    things: Mapping[str, T], signature: Callable[[T], Hashable | None]
) -> dict[Hashable, list[str]]:
    found: dict[Hashable, list[str]] = {}
    for name, thing in things.items():
        key = signature(thing)
        if key is not None:
            found.setdefault(key, []).append(name)
    return found


Scale = Factor | Json | str | None
"""A factor; a rule (``{"by": …}``, ``{"unknown": why}``); the reason why it is unknown; or nothing."""

_NOTES = ("printed", "source", "page")


class ScaleKey(NamedTuple):
    """The key of a scale of a stage; the source is empty unless several contradict each other."""

    controller: str
    quantity: str
    source: str = ""


def scales_on(stage: model_scales.Stage) -> Iterator[tuple[ScaleKey, Factor | str]]:
    """Yield the scales of a stage; for a conflict, first the refusal, then the factor of each source."""
    for controller, scales in stage.scales.items():
        for quantity, scale in scales.items():
            if isinstance(scale, model_scales.Conflict):
                yield ScaleKey(controller, quantity), "its sources contradict each other"
                for source, factor in scale.factors.items():
                    yield ScaleKey(controller, quantity, source), factor
            else:
                yield ScaleKey(controller, quantity), scale


def known(scale: Scale) -> bool:
    """Whether the scale can convert counts, given the values that it depends on."""
    return isinstance(scale, Factor) or (isinstance(scale, dict) and "by" in scale)


def exact(scale: Scale) -> Hashable:
    """Return a value that is equal for two scales if they convert in the same way."""
    if isinstance(scale, Factor):
        return scale.counts_per_unit
    if not isinstance(scale, dict) or not known(scale):
        return None
    facts: dict[str, Hashable] = {key: v for key, v in scale.items() if key not in _NOTES}
    if "units" in scale:
        facts["units"] = frozenset((unit, exact(factor)) for unit, factor in scale["units"].items())
    if "cases" in scale:
        cases = scale["cases"].items()
        facts["cases"] = frozenset((name, c["unit"], exact(c["scale"])) for name, c in cases)
    return frozenset(facts.items())


def same_scale(old: Quantity, new: Quantity) -> bool:
    """Whether fields of both quantities are converted in the same way.

    Two quantities whose scale depends on the stage never are: each has its own factors in the stages.
    """
    one, other = (quantity.factor or quantity.rule for quantity in (old, new))
    if isinstance(one, dict) and one.get("by") == "stage":
        return False
    return old.unit == new.unit and exact(one) == exact(other)


class _Named(Structural):
    @property
    def name(self) -> str: ...


N = TypeVar("N", bound=_Named)


@dataclass(frozen=True, slots=True)
class Matches:
    """The pairs of all things that are referred to by name."""

    chapter: Pairs[model.Chapter]
    message: Pairs[model.Message]
    set: Pairs[model.ParameterSet]
    enumeration: Pairs[model_fields.Enumeration]
    flags: Pairs[model_fields.FlagTable]
    quantity: Pairs[model_scales.Quantity]
    controller: Pairs[model_scales.Controller]
    stage: Pairs[model_scales.Stage]

    def renamed(self, kind: str) -> Mapping[str, str]:
        """Return old name -> new name of the renamed things of a kind."""
        pairs: Pairs[Any] = getattr(self, kind)
        return pairs.renamed


def match(old: model.Protocol, new: model.Protocol) -> Matches:
    """Pair the named things in two registries of one protocol."""
    messages = pair(_named(old.messages), _named(new.messages), _message)
    quantities = pair(_named(old.quantities), _named(new.quantities), _quantity)
    controllers = pair(
        _named(old.controllers), _named(new.controllers), lambda c: frozenset(c.members)
    )

    # The old name of a renamed thing is not in the new registry, so new names pass through unchanged.
    def members(found: model.ParameterSet) -> Hashable:
        return frozenset((r, messages.renamed.get(m, m)) for r, m in found.members.items())

    def scales(stage: model_scales.Stage) -> Hashable:
        return stage.title, frozenset(
            (controllers.renamed.get(c, c), quantities.renamed.get(q, q), source, exact(scale))
            for (c, q, source), scale in scales_on(stage)
        )

    return Matches(
        chapter=pair(_named(old.chapters), _named(new.chapters), lambda c: (c.title, c.page)),
        message=messages,
        set=pair(_named(old.sets), _named(new.sets), members),
        enumeration=pair(
            _named(old.enumerations),
            _named(new.enumerations),
            lambda e: frozenset((v.name, v.value) for v in e.values),
        ),
        flags=pair(
            _named(old.flags),
            _named(new.flags),
            lambda t: frozenset((b.name, b.bit) for b in t.bits),
        ),
        quantity=quantities,
        controller=controllers,
        stage=pair(_named(old.stages), _named(new.stages), scales),
    )


def match_layouts(old: model.Message, new: model.Message) -> Pairs[model.Layout]:
    """Pair the layouts of a message by form, or else by their bytes.

    The context does not matter: a layout that is split in two gets a context and another name together.
    """
    return pair({x.form: x for x in old.layouts}, {x.form: x for x in new.layouts}, _layout)


def match_fields(old: model.Layout, new: model.Layout) -> Pairs[model_fields.Field]:
    """Pair the fields of a packet by name, or else by their bytes."""
    return pair(_named(old.fields), _named(new.fields), _field)


def _named(things: Iterable[N]) -> dict[str, N]:
    return {thing.name: thing for thing in things}


def _message(message: model.Message) -> Hashable | None:
    if message.id is None:
        return None
    layouts = frozenset((_layout(x), frozenset(x.when.items())) for x in message.layouts)
    return message.kind, message.id, message.sub_message, message.size, layouts


def _layout(layout: model.Layout) -> Hashable:
    params = (layout.param1, layout.param2)
    return (
        layout.form.partition(":")[0],  # header, data, request or reply
        layout.length,
        layout.only_zero,
        tuple(p and (p.role, p.constant) for p in params),
        tuple((_field(f), f.role, f.constant) for f in layout.fields),
    )


def _field(field: model_fields.Field) -> Hashable:
    return field.offset, field.format.size, field.format.signed, field.format.kind


def _quantity(quantity: model_scales.Quantity) -> Hashable:
    return quantity.unit, exact(quantity.factor or quantity.rule)
