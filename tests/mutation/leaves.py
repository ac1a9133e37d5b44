"""Every leaf of the registry, with wrong values: each must contradict ``check`` or a worked example.

A leaf is a value in a file of messages, units, quantities, stages or of the protocol itself, apart from
prose: pages, titles, notes, sources and texts for people. Each leaf is changed once, to a value that is wrong
but likely, and removed once. ``survivors.yaml`` lists the mutations that may survive, with the reasons. As a
program, this module tries leaves and prints those that survive:

    python tests/mutation/leaves.py [--seed N] [--number N] [TEXT ...]
"""

from __future__ import annotations

import argparse
import random
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

import yaml
from mutants import PROTOCOLS, Proof, proof_of
from registry_values import RegistryValue

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint.witness.statements import OF_REGISTRY, Facts
from stagewire_generator.pipeline import check_protocol
from stagewire_generator.schemas import fits_schema
from stagewire_generator.strict_yaml import KeyPath
from stagewire_generator.targets import python
from stagewire_generator.targets.templates import Templates

SURVIVORS = Path(__file__).with_name("survivors.yaml")
PROSE = frozenset(
    {"page", "pages", "more_pages", "title", "summary", "note", "source", "printed", "document", "unknown",
     "chapter", "order", "witness"}
)  # fmt: skip
_NUMBER = re.compile(r"(\d+)(/\d+)?\Z")
REMOVED = object()
_EXAMPLES = """
import sys
from importlib import import_module
from stagewire_conformance.examples import run
sys.exit(any(verdict.failed for verdict in run(import_module(sys.argv[1]).PROTOCOL)))
"""


@dataclass(frozen=True)
class Leaf(RegistryValue):
    """A place in a file of the registry, with or without a value.

    :param kind: kind of the file.
    """

    kind: str

    @property
    def fact(self) -> str:
        """The kind of fact: the kind of file, and the key of the value or of the list that holds it."""
        key = next(step for step in reversed(self.path) if isinstance(step, str))
        return f"{self.kind}: {'values' if key.isupper() else key}"

    @property
    def value(self) -> Any:
        return self.holder[self.path[-1]]


@dataclass(frozen=True)
class Mutation:
    """One wrong value of a leaf, or its removal."""

    leaf: Leaf
    value: Any

    def __str__(self) -> str:
        to = "removed" if self.value is REMOVED else repr(self.value)
        return f"{self.leaf}: {self.leaf.value!r} -> {to}"[:160]

    def changed(self) -> list[tuple[Leaf, Any]]:
        """Return the files that change, as their roots, each with its new contents."""
        root = Leaf(self.leaf.document, (), self.leaf.kind)
        return [(root, replaced(root.document.data, self.leaf.path, self.value))]

    @contextmanager
    def applied(self) -> Iterator[None]:
        """Change the files while the context lasts."""
        changed = self.changed()
        before = [root.document.data for root, _ in changed]
        for root, data in changed:
            root.document.data = data
        try:
            yield
        finally:
            for (root, _), data in zip(changed, before, strict=True):
                root.document.data = data


def replaced(node: Any, path: KeyPath, value: Any) -> Any:
    """Return a copy of a node with another value at a path, or with a new key or item there."""
    step, *rest = path
    inner = replaced(node[step], tuple(rest), value) if rest else value
    if isinstance(node, list):
        return [*node[:step], *([] if inner is REMOVED else [inner]), *node[step + 1 :]]
    if inner is REMOVED:
        return {key: old for key, old in node.items() if key != step}
    return {**node, step: inner}


def leaves(proof: Proof) -> list[Leaf]:
    """Return the leaves of a protocol, without its overlays."""
    return [
        Leaf(document, path, kind)
        for kind in OF_REGISTRY
        for document in proof.files.get(kind, [])
        for path in _paths(document.data, ())
    ]


def _paths(node: Any, path: KeyPath) -> Iterator[KeyPath]:
    if isinstance(node, dict):
        for key, inner in node.items():
            if key not in PROSE:
                yield from _paths(inner, (*path, key))
    elif isinstance(node, list):
        for index, inner in enumerate(node):
            yield from _paths(inner, (*path, index))
    else:
        yield path


def mutations(proof: Proof, seed: int) -> Iterator[Mutation]:
    """Yield the mutations of all leaves; the seed draws the wrong values."""
    chance = random.Random(seed)
    found = leaves(proof)
    alike: defaultdict[str, set[Any]] = defaultdict(set)
    for leaf in found:
        alike[leaf.fact].add(leaf.value)
    for leaf in found:
        if " " not in str(leaf.value) or leaf.path[-1] == "spelling":  # otherwise it is prose
            yield Mutation(leaf, _wrong(leaf.value, alike[leaf.fact], chance))
        if (
            leaf.path[-1] != "spelling"
        ):  # without it, the words of a name are those between underscores
            yield Mutation(leaf, REMOVED)


def _wrong(value: Any, alike: set[Any], chance: random.Random) -> Any:
    """Return another value: a name that another fact of the kind has, or a number close by."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        near = {value + 1, value - 1, value + 2, value + 16, 2 * value}
        return chance.choice(
            sorted(number for number in near - {value} if (number < 0) == (value < 0))
        )
    number = _NUMBER.match(value)
    if number:
        return f"{int(number[1]) + chance.choice([1, 2, 10])}{number[2] or ''}"
    others = sorted(other for other in alike if isinstance(other, str) and other != value)
    return chance.choice(others) if others else f"{value}x"


def refused_by(proof: Proof, mutation: Mutation) -> str:
    """Return what contradicts a mutation: ``schema``, ``check`` or ``example``; empty if nothing does."""
    with mutation.applied():
        diagnostics = Diagnostics()
        if not all(fits_schema(x.document, x.kind, diagnostics) for x, _ in mutation.changed()):
            return "schema"
        checked = check_protocol(proof.files, diagnostics, lambda _: None)
        if diagnostics.found:
            return "check"
        rendered = python.render(checked.protocol, Templates())
    survives = rendered == _rendered(proof) or _examples_pass(proof, rendered)
    return "" if survives else "example"


def survives(proof: Proof, mutation: Mutation) -> bool:
    """Whether nothing contradicts a mutation."""
    return not refused_by(proof, mutation)


@cache
def _rendered(proof: Proof) -> dict[str, str]:
    """Return the Python package of the registry as it is."""
    return python.render(proof.protocol, Templates())


def _examples_pass(proof: Proof, rendered: dict[str, str]) -> bool:
    """Whether all worked examples and captures pass with a generated package."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in rendered.items():
            path = Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        command = [sys.executable, "-c", _EXAMPLES, proof.protocol.package]
        here = Path(folder, "python")  # searched before the installed package
        run = subprocess.run(command, cwd=here, capture_output=True, check=False)
        return run.returncode == 0


def decided(proof: Proof) -> set[str]:
    """Return the leaves that a decision states."""
    facts = Facts(proof.protocol, proof.files)
    every = [str(leaf) for leaf in leaves(proof)]
    found: set[str] = set()
    for document in proof.files.get("decisions", []):
        for entry in document.data["decisions"].values():
            for pattern in entry["states"]:
                for at, key, _ in facts.at(pattern, document, ("decisions",), Diagnostics()):
                    path = f"{at}/{key}".lstrip("/")
                    found.update(leaf for leaf in every if f"{leaf}/".startswith(f"{path}/"))
    return found


@cache
def _survivors() -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load(SURVIVORS.read_text(encoding="utf-8"))
    return found


def listed(name: str) -> dict[str, str]:
    """Return patterns of the mutations of a protocol that may survive, each with the reason."""
    groups = _survivors()[name]
    return {pattern: group["reason"] for group in groups for pattern in group["mutations"]}


def excused(name: str, mutation: Mutation) -> bool:
    """Whether a mutation may survive."""
    return any(fnmatchcase(str(mutation), pattern) for pattern in listed(name))


def main() -> int:
    """Try leaves and print those that survive, with the totals for each kind of fact."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int, help="try only so many of them")
    parser.add_argument("text", nargs="*", help="try only leaves with a text in their path")
    options = parser.parse_args()
    for name in PROTOCOLS:
        proof = proof_of(name)
        tried = [
            mutation
            for mutation in mutations(proof, options.seed)
            if not options.text or any(text in str(mutation.leaf) for text in options.text)
        ]
        if options.number and options.number < len(tried):
            tried = random.Random(options.seed).sample(tried, options.number)
        groups: defaultdict[str, set[str]] = defaultdict(set)
        for mutation in tried:
            groups[mutation.leaf.fact].add(str(mutation.leaf))
        survivors = [mutation for mutation in tried if survives(proof, mutation)]
        for mutation in survivors:
            print(f"survives: {mutation}")
        left, by_decision = {str(mutation.leaf) for mutation in survivors}, decided(proof)
        print(f"{name}: kind of fact | leaves | two witnesses | decisions | survivors")
        for fact, found in sorted(groups.items()):
            unproved, own = len(found & left), len((found & by_decision) - left)
            print(f"{fact} | {len(found)} | {len(found) - own - unproved} | {own} | {unproved}")
        print(f"{name}: {len(tried)} mutations, {len(survivors)} survive")
    return 0


if __name__ == "__main__":
    sys.exit(main())
