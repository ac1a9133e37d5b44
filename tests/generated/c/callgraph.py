"""Call graphs and stack usage of functions, as written by gcc (``-fcallgraph-info=su``)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

OPTION = "-fcallgraph-info=su"
"""Makes gcc write the graph next to the object file, with the suffix ``.ci``."""

INDIRECT = "__indirect_call"

_NODE = re.compile(r'^node: { title: "([^"]+)" label: "([^"]*)"', re.MULTILINE)
_EDGE = re.compile(r'^edge: { sourcename: "([^"]+)" targetname: "([^"]+)"', re.MULTILINE)
_STACK = re.compile(r"(\d+) bytes \((\w[\w,]*)\)")


class CallGraph(NamedTuple):
    """The functions of some objects; functions of other objects have no stack usage."""

    calls: Mapping[str, frozenset[str]]
    stack: Mapping[str, int]
    unbounded: frozenset[str]

    def cycle(self) -> list[str]:
        """Return functions that call each other recursively, if there are any."""
        done: set[str] = set()

        def walk(name: str, path: list[str]) -> list[str]:
            if name in path:
                return path[path.index(name) :]
            if name in done:
                return []
            for called in sorted(self.calls.get(name, ())):
                found = walk(called, [*path, name])
                if found:
                    return found
            done.add(name)
            return []

        return next((found for name in sorted(self.calls) if (found := walk(name, []))), [])

    def deepest(self, name: str) -> int:
        """Return the stack usage of a function including all functions that it calls."""
        below = max(map(self.deepest, self.calls.get(name, ())), default=0)
        return self.stack.get(name, 0) + below

    def reached(self, names: Iterable[str]) -> set[str]:
        """Return these functions and all functions that they call."""
        found: set[str] = set()
        waiting = list(names)
        while waiting:
            name = waiting.pop()
            if name not in found:
                found.add(name)
                waiting.extend(self.calls.get(name, ()))
        return found

    def indirect(self) -> list[str]:
        """Return the functions that call through a pointer; the graph does not contain the callees."""
        return sorted(name for name, called in self.calls.items() if INDIRECT in called)


def read(paths: Iterable[Path]) -> CallGraph:
    """Read the output of gcc for some objects."""
    calls: dict[str, set[str]] = {}
    stack: dict[str, int] = {}
    unbounded: set[str] = set()
    for path in paths:
        text = path.read_text(encoding="utf-8")
        for title, label in _NODE.findall(text):
            name = _plain(title)
            if used := _STACK.search(label):
                calls.setdefault(name, set())
                stack[name] = int(used[1])
                if used[2] != "static":
                    unbounded.add(name)
        for caller, called in _EDGE.findall(text):
            calls.setdefault(_plain(caller), set()).add(_plain(called))
    frozen = {name: frozenset(called) for name, called in calls.items()}
    return CallGraph(frozen, stack, frozenset(unbounded))


def _plain(title: str) -> str:
    """Return the name of a function; gcc prefixes static functions with their file."""
    return title.rpartition(":")[2]
