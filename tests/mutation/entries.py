"""Registries with a fact too many, an entry with another name, or one entry less: each must be refused.

An *addition* is an optional key that the schema allows, with a value that such a key has elsewhere, or
another item of a list. An *orphan* is a copy of an entry with another name and other numbers, to which
nothing refers. A *rename* gives an entry another name, either alone or with all references to it. A *removal*
removes an entry, a mapping or a list. ``survivors.yaml`` lists those that neither ``check`` nor a worked
example contradicts, with the reasons. As a program, this module tries them, and prints survivors and totals:

    python tests/mutation/entries.py [--seed N] [--number N] [TEXT ...]
"""

from __future__ import annotations

import argparse
import json
import random
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from leaves import PROSE, REMOVED, Leaf, Mutation, refused_by
from mutants import PROTOCOLS, Proof, proof_of

from stagewire_generator.formatting.rules import Shape, shape
from stagewire_generator.lint.witness.statements import OF_REGISTRY

_NUMBERS = {
    "value": 1 << 16,
    "bit": 32,
    "byte": 256,
    "id": 1 << 16,
    "set": 1 << 16,
    "req": 1 << 16,
    "get": 1 << 16,
}
"""Keys whose numbers differ between entries, and how many numbers they can have."""
_NAMES = ("EXTRA", "extra", "Extra", "999")
_TEXTS = ("x", "X", "1", "1.0", "1/2", "none")


@dataclass(frozen=True)
class Addition(Mutation):
    """A key or an item that the registry does not have."""

    def __str__(self) -> str:
        return f"{self.leaf}: added {json.dumps(self.value)}"[:160]


@dataclass(frozen=True)
class Removal(Mutation):
    """The registry without an entry, a mapping or a list."""

    value: Any = REMOVED

    def __str__(self) -> str:
        return f"{self.leaf}: removed"


@dataclass(frozen=True)
class Rename(Mutation):
    """An entry with another name.

    :param roots: all files, if all references are also renamed; otherwise empty.
    """

    roots: tuple[Leaf, ...] = ()

    def __str__(self) -> str:
        return f"{self.leaf}: renamed {self.value}{' everywhere' if self.roots else ''}"

    def changed(self) -> list[tuple[Leaf, Any]]:
        """Return the files with the new name."""
        old = self.leaf.path[-1]
        if not self.roots:
            return _renamed_in(self.leaf, old, self.value)
        return [(root, _renamed(root.document.data, old, self.value)) for root in self.roots]


def _renamed_in(leaf: Leaf, old: Any, new: str) -> list[tuple[Leaf, Any]]:
    """Return the file of an entry, with the new name only there."""
    entries = {new if key == old else key: inner for key, inner in leaf.holder.items()}
    return Mutation(Leaf(leaf.document, leaf.path[:-1], leaf.kind), entries).changed()


def _renamed(node: Any, old: Any, new: str) -> Any:
    """Return a copy in which each key and each text that is the old name is the new one."""
    if isinstance(node, dict):
        return {_renamed(key, old, new): _renamed(inner, old, new) for key, inner in node.items()}
    if isinstance(node, list):
        return [_renamed(inner, old, new) for inner in node]
    return new if node == old else node


Node = tuple[Leaf, Any, Shape]  # a place, the value there, and its schema


def _nodes(proof: Proof) -> Iterator[Node]:
    """Yield every value of the files, apart from prose."""
    for kind in OF_REGISTRY:
        for document in proof.files.get(kind, []):
            yield from _below(Leaf(document, (), kind), document.data, shape(kind))


def _below(leaf: Leaf, node: Any, form: Shape) -> Iterator[Node]:
    yield leaf, node, form
    for key, inner in _items(node):
        at = Leaf(leaf.document, (*leaf.path, key), leaf.kind)
        yield from _below(at, inner, form.inside(key if isinstance(key, str) else None))


def _items(node: Any) -> list[tuple[str | int, Any]]:
    if isinstance(node, dict):
        return [(key, inner) for key, inner in node.items() if key not in PROSE]
    return [*enumerate(node)] if isinstance(node, list) else []


def additions(proof: Proof, chance: random.Random) -> Iterator[Mutation]:
    """Yield an addition for each optional key and for each list."""
    alike: defaultdict[Any, list[Any]] = defaultdict(list)
    for leaf, node, _ in _nodes(proof):
        if leaf.path and node not in (known := alike[_like(leaf)]):
            known.append(node)
    for leaf, node, form in _nodes(proof):
        if isinstance(node, dict):
            for key in form.order:
                if key not in node and key not in PROSE:
                    at = Leaf(leaf.document, (*leaf.path, key), leaf.kind)
                    found = alike[_like(at)] or [_simplest(form.inside(key))]
                    yield Addition(at, chance.choice(found))
        elif isinstance(node, list):
            at = Leaf(leaf.document, (*leaf.path, len(node)), leaf.kind)
            if found := [value for value in alike[_like(at)] if value not in node]:
                yield Addition(at, chance.choice(found))


def _like(leaf: Leaf) -> tuple[Any, ...]:
    """Return what values that can replace each other have in common."""
    key = leaf.path[-1]
    return (leaf.kind, key) if isinstance(key, str) else (leaf.kind, leaf.path[-2], "item")


def _simplest(form: Shape) -> Any:
    """Return a value that fits a schema, for a key that the registry has nowhere."""
    for schema in form.schemas:
        if "const" in schema or "enum" in schema:
            return schema.get("const", schema.get("enum", [None])[0])
        if "required" in schema:
            return {key: _simplest(form.inside(key)) for key in schema["required"]}
        kinds = schema.get("type", [])
        kind = kinds if isinstance(kinds, str) else next(iter(kinds), "")
        if kind == "array":
            return [_simplest(form.inside(None))]
        if kind == "object":
            return {name: _simplest(form.inside(name)) for name in _names("", form)[:1]}
        if kind in ("integer", "boolean"):
            return kind == "boolean" or max(1, schema.get("minimum", 1))
    patterns = [schema["pattern"] for schema in form.schemas if "pattern" in schema]
    return next((t for t in _TEXTS if all(re.search(p, t) for p in patterns)), "x")


def _entries(proof: Proof) -> Iterator[Node]:
    """Yield every entry: a value under a name that the schema leaves open, and the schema of its holder."""
    for leaf, node, form in _nodes(proof):
        for key, inner in node.items() if isinstance(node, dict) else ():
            if key not in form.order:
                yield Leaf(leaf.document, (*leaf.path, key), leaf.kind), inner, form


def _names(old: str, form: Shape) -> list[str]:
    """Return new names for an entry that the schema allows."""
    patterns = [p for schema in form.schemas for p in schema.get("patternProperties", ())]
    new = [f"{old}{link}{word}" for link in ("_", "") for word in _NAMES]
    new += [*_NAMES, f"extra_{old}"]
    return [name for name in new if any(re.search(pattern, name) for pattern in patterns)]


def orphans(proof: Proof, chance: random.Random) -> Iterator[Mutation]:
    """Yield a copy of each entry with another name and other numbers."""
    for leaf, node, form in _entries(proof):
        name = _names(str(leaf.path[-1]), form)[0]
        at = Leaf(leaf.document, (*leaf.path[:-1], name), leaf.kind)
        yield Addition(at, _with_other_numbers(node, {*_numbers(leaf.holder)}, chance))


def _numbers(node: Any) -> Iterator[int]:
    """Yield the numbers that differ between entries."""
    for key, inner in node.items() if isinstance(node, dict) else ():
        if key in _NUMBERS and isinstance(inner, int):
            yield inner
        yield from _numbers(inner)


def _with_other_numbers(node: Any, taken: set[int], chance: random.Random) -> Any:
    if not isinstance(node, dict):
        return node
    new = {key: _with_other_numbers(inner, taken, chance) for key, inner in node.items()}
    for key, count in _NUMBERS.items():
        while isinstance(new.get(key), int) and new[key] in taken:
            new[key] = chance.randrange(count)
    return new


def renames(proof: Proof, _: random.Random) -> Iterator[Mutation]:
    """Yield each entry with another name, alone, and with all references to it if there are any."""
    roots = tuple(leaf for leaf, _, _ in _nodes(proof) if not leaf.path)
    texts = {node for _, node, _ in _nodes(proof) if isinstance(node, str)}
    for leaf, _node, form in _entries(proof):
        name = _names(str(leaf.path[-1]), form)[0]
        yield Rename(leaf, name)
        if leaf.path[-1] in texts:
            yield Rename(leaf, name, roots)


def removals(proof: Proof, _: random.Random) -> Iterator[Mutation]:
    """Yield the registry without each of its entries, mappings and lists; an empty list states nothing."""
    for leaf, node, _form in _nodes(proof):
        if leaf.path and node != [] and isinstance(node, dict | list):
            yield Removal(leaf)


KINDS: dict[str, Callable[[Proof, random.Random], Iterator[Mutation]]] = {
    "additions": additions,
    "orphans": orphans,
    "renames": renames,
    "removals": removals,
}


def mutations(proof: Proof, seed: int) -> Iterator[tuple[str, Mutation]]:
    """Yield all mutations with their kinds; the seed draws the values."""
    chance = random.Random(seed)
    for kind, made in KINDS.items():
        for mutation in made(proof, chance):
            yield kind, mutation


def main() -> int:
    """Try mutations, and print the survivors and the totals for each kind."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, help="try only so many of them")
    parser.add_argument(
        "text", nargs="*", help="try only mutations with a text in their description"
    )
    options = parser.parse_args()
    for name in PROTOCOLS:
        proof = proof_of(name)
        found = [
            (kind, mutation)
            for kind, mutation in mutations(proof, options.seed)
            if not options.text or any(text in f"{kind} {mutation}" for text in options.text)
        ]
        if options.number and options.number < len(found):
            found = random.Random(options.seed).sample(found, options.number)
        totals: defaultdict[str, Counter[str]] = defaultdict(Counter)
        for kind, mutation in found:
            by = refused_by(proof, mutation)
            totals[kind][by or "survives"] += 1
            if not by:
                print(f"survives: {kind}: {mutation}", flush=True)
        for kind, by_what in totals.items():
            counts = ", ".join(f"{number} {what}" for what, number in sorted(by_what.items()))
            print(f"{name}: {by_what.total()} {kind}: {counts}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
