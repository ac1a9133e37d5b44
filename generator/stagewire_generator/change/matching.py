"""Pair the entries of the old registry with those of the new one, also under other names.

Entries are paired by name, or by content where the name changed. Scales are compared by their exact
effect on counts, however they are written.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar
from typing import Protocol as Structural

from stagewire_generator import model
from stagewire_generator.model import Factor, Json, Quantity

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Pairs(Generic[T]):
    """Things that are on both sides, and on one only; each in the order of its side."""

    kept: tuple[tuple[T, T], ...]
    renamed: Mapping[str, str]  # old name -> new name
    added: tuple[T, ...]
    removed: tuple[T, ...]
    reordered: bool  # whether those that are kept follow one another otherwise


def pair(
    old: Mapping[str, T], new: Mapping[str, T], signature: Callable[[T], Hashable | None]
) -> Pairs[T]:
    """Pair the things of both sides.

    A thing whose name is gone is the one with the same ``signature`` whose name is new, when there is exactly
    one of each; a signature of None is like no other.
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
"""A factor; a rule (``{"by": …}``, ``{"unknown": why}``); why there is none; nothing at all."""

_NOTES = ("printed", "source", "page")


def known(scale: Scale) -> bool:
    """Whether counts can be converted by the scale, given what it depends on."""
    return isinstance(scale, Factor) or (isinstance(scale, dict) and "by" in scale)


def exact(scale: Scale) -> Hashable:
    """Return what decides a conversion: two scales that convert alike give the same."""
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
    """Whether fields of the one quantity convert as fields of the other.

    Two quantities by stage do not: each has factors of its own in the stages.
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
    """The pairs of everything that others refer to by name."""

    chapter: Pairs[model.Chapter]
    message: Pairs[model.Message]
    set: Pairs[model.ParameterSet]
    enumeration: Pairs[model.Enumeration]
    flags: Pairs[model.FlagTable]
    quantity: Pairs[model.Quantity]
    controller: Pairs[model.Controller]
    stage: Pairs[model.Stage]

    def renamed(self, kind: str) -> Mapping[str, str]:
        """Return old name -> new name of what was renamed among the things of a kind."""
        pairs: Pairs[Any] = getattr(self, kind)
        return pairs.renamed


def match(old: model.Protocol, new: model.Protocol) -> Matches:
    """Pair what has names in two registries of one protocol."""
    messages = pair(_named(old.messages), _named(new.messages), _message)
    quantities = pair(_named(old.quantities), _named(new.quantities), _quantity)
    controllers = pair(
        _named(old.controllers), _named(new.controllers), lambda c: frozenset(c.members)
    )

    # What is renamed is not in the new registry, so that new names pass through these unchanged.
    def members(found: model.ParameterSet) -> Hashable:
        return frozenset((r, messages.renamed.get(m, m)) for r, m in found.members.items())

    def scales(stage: model.Stage) -> Hashable:
        return stage.title, frozenset(
            (controllers.renamed.get(c, c), quantities.renamed.get(q, q), exact(factor))
            for c, factors in stage.scales.items()
            for q, factor in factors.items()
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
    """Pair the layouts of a message; under another form it is the one with the same bytes.

    The context is not asked for: a layout that is split in two gets a context and a name at once.
    """
    return pair({x.form: x for x in old.layouts}, {x.form: x for x in new.layouts}, _layout)


def match_fields(old: model.Layout, new: model.Layout) -> Pairs[model.Field]:
    """Pair the fields of a packet; under another name it is the one in the same bytes."""
    return pair(_named(old.fields), _named(new.fields), _field)


def _named(things: Iterable[N]) -> dict[str, N]:
    return {thing.name: thing for thing in things}


def _message(message: model.Message) -> Hashable | None:
    if message.id is None:
        return None
    layouts = frozenset((_layout(x), frozenset(x.when.items())) for x in message.layouts)
    return message.kind, message.id, message.size, layouts


def _layout(layout: model.Layout) -> Hashable:
    params = (layout.param1, layout.param2)
    return (
        layout.form.partition(":")[0],  # header, data, request or reply
        layout.length,
        layout.only_zero,
        tuple(p and (p.role, p.constant) for p in params),
        tuple((_field(f), f.role, f.constant) for f in layout.fields),
    )


def _field(field: model.Field) -> Hashable:
    return field.offset, field.format.size, field.format.signed, field.format.kind


def _quantity(quantity: model.Quantity) -> Hashable:
    return quantity.unit, exact(quantity.factor or quantity.rule)
