"""Two registries against each other: every difference, typed."""

from __future__ import annotations

from collections.abc import Sequence

from stagewire_generator.change.change import Change
from stagewire_generator.change.comparison import NOWHERE, Comparison, change
from stagewire_generator.change.matching import match
from stagewire_generator.change.messages import (
    compare_chapters,
    compare_firmware,
    compare_messages,
    compare_sets,
)
from stagewire_generator.change.pairing import pair
from stagewire_generator.change.proofs import compare_proofs
from stagewire_generator.change.scales import compare_scales
from stagewire_generator.change.tables import compare_tables
from stagewire_generator.model import Protocol

__all__ = ["compare"]


def compare(old: Sequence[Protocol], new: Sequence[Protocol]) -> list[Change]:
    """Return what changed from the checked models ``old`` to ``new``, the gravest first.

    Within a class the changes stand in the order of the registry. Nothing changed if the list is empty.
    """
    pairs = pair({p.name: p for p in old}, {p.name: p for p in new}, _messages)
    changes: list[Change] = []
    changes += [change("protocol-removed", p.name, old=p.name) for p in pairs.removed]
    changes += [change("protocol-added", p.name, new=p.name) for p in pairs.added]
    for before, after in pairs.kept:
        if before.name != after.name:
            changes.append(change("protocol-renamed", after.name, NOWHERE, before.name, after.name))
        changes += _protocol(before, after)
    return sorted(changes, key=lambda change: -change.level)


def _messages(protocol: Protocol) -> frozenset[tuple[str, int | None]]:
    return frozenset((message.name, message.id) for message in protocol.messages)


def _protocol(old: Protocol, new: Protocol) -> list[Change]:
    comparison = Comparison(new.name, match(old, new))
    comparison.attributes(NOWHERE, old, new)
    compare_firmware(comparison, NOWHERE, old.firmware, new.firmware)
    compare_chapters(comparison, old, new)
    compare_messages(comparison, old, new)
    compare_sets(comparison)
    compare_tables(comparison)
    compare_scales(comparison)
    compare_proofs(comparison, old, new)
    return comparison.changes
