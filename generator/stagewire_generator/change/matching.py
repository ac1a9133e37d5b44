"""What each thing of the old registry is called in the new one."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar
from typing import Protocol as Structural

from stagewire_generator import model
from stagewire_generator.change.exact import exact
from stagewire_generator.change.pairing import Pairs, pair

__all__ = ["Matches", "match", "match_fields", "match_layouts"]


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
