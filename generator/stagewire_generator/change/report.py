"""The changes as plain data, as ``spec/schema/changes.schema.json`` describes them."""

from __future__ import annotations

from collections.abc import Sequence

from stagewire_generator.change.change import Change, ChangeClass
from stagewire_generator.model import Json

__all__ = ["SCHEMA_VERSION", "counts", "report"]

SCHEMA_VERSION = 1


def counts(changes: Sequence[Change]) -> dict[ChangeClass, int]:
    """Return how many changes each class has, the gravest first."""
    levels = [change.level for change in changes]
    return {level: levels.count(level) for level in sorted(ChangeClass, reverse=True)}


def report(old: str, new: str, changes: Sequence[Change]) -> Json:
    """Return the changes from ``old`` to ``new``, which are named as the user named them."""
    return {
        "schema_version": SCHEMA_VERSION,
        "old": old,
        "new": new,
        "counts": {level.name: number for level, number in counts(changes).items()},
        "changes": [
            {
                "class": change.level.name,
                "kind": change.kind,
                "protocol": change.protocol,
                **({"overlay": change.overlay} if change.overlay else {}),
                "where": dict(change.where),
                "old": change.old,
                "new": change.new,
                "text": change.text,
            }
            for change in changes
        ],
    }
