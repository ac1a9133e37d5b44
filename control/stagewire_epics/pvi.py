"""PVI: structures that list records, from which ophyd-async fills devices.

The structures follow from the names: ``LAB:PVI`` lists the motors, ``LAB:x:PVI`` the fields of ``LAB:x`` and
its sets of parameters, and ``LAB:x:VEL_PARAMS:PVI`` their values. A record that clients may put has the mode
``rw``, every other one ``r``.

An entry is the last part of a name in lower case, with ASCII letters, digits and underscores. It begins with
an underscore if the part begins with a digit. It ends with an underscore, as ``stop_``, if ophyd-async or
Python reserves the name, or another entry has it.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from keyword import iskeyword
from typing import Final

from p4p import Type, Value

from stagewire_epics.records import Record

_RESERVED: Final = frozenset(
    {
        # attributes of devices
        *("children", "connect", "log", "name", "parent", "set_name"),
        # methods of bluesky's protocols
        *("check_value", "clear_sub", "collect", "collect_asset_docs", "collect_pages", "complete"),
        *(
            "describe",
            "describe_collect",
            "describe_configuration",
            "get_index",
            "hints",
            "kickoff",
        ),
        *("locate", "pause", "prepare", "read", "read_configuration", "resume", "set", "stage"),
        *("stop", "subscribe", "trigger", "unstage"),
    }
)
_Node = tuple[str, ...]


def structures(records: Iterable[Record]) -> Iterator[tuple[str, Value]]:
    """Yield the name and the value of each PVI structure.

    :param records: the records that the structures list, under their own names.
    """
    nodes: dict[_Node, dict[str, tuple[str, str]]] = {}
    for record in records:
        *path, last = re.split("[:.]", record.name)
        for length, part in enumerate(path):
            below = ":".join((*path[: length + 1], "PVI"))
            nodes.setdefault(tuple(path[:length]), {})[below] = ("d", part)
        mode = "rw" if record.writable else "r"
        nodes.setdefault(tuple(path), {})[record.name] = (mode, last)
    for node, listed in nodes.items():
        if node:
            entries: dict[str, dict[str, str]] = {}
            for name, (mode, part) in listed.items():
                entries[_entry(part, entries)] = {mode: name}
            yield ":".join((*node, "PVI")), _structure(":".join(node), entries)


def _structure(node: str, entries: dict[str, dict[str, str]]) -> Value:
    shape = [
        (name, ("S", None, [(mode, "s") for mode in entry])) for name, entry in entries.items()
    ]
    kind = Type(
        [
            ("display", ("S", None, [("description", "s")])),
            ("value", ("S", None, shape)),
        ],
        id="epics:nt/NTPVI:1.0",
    )
    return Value(kind, {"display": {"description": f"records of {node}"}, "value": entries})


def _entry(part: str, used: Collection[str]) -> str:
    entry = re.sub(r"\W", "_", part.lower(), flags=re.ASCII)
    if entry[:1].isdigit():
        entry = f"_{entry}"
    while entry in _RESERVED or iskeyword(entry) or entry in used:
        entry += "_"
    return entry
