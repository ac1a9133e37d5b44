"""The order in which overlays are applied, and which others each of them builds on."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from stagewire_generator.diagnostics import Diagnostics, Place, meant
from stagewire_generator.reader import Files


def foundations(
    overlays: Mapping[str, Files], known: Collection[str], diagnostics: Diagnostics
) -> dict[str, tuple[str, ...]]:
    """Return what each overlay builds on, directly or not, in the order in which it is applied.

    Left out are overlays that build on an unknown one or on themselves, with diagnostics, and those that
    build on an overlay that was left out or cannot be read.

    :param known: the names of all overlays of the protocol, valid or not.
    """
    named = {name: [other for other, _ in _named(files)] for name, files in overlays.items()}
    under = {name: tuple(_under(name, named)) for name in overlays}
    usable = set(overlays)
    for name, files in overlays.items():
        for other, place in _named(files):
            if other not in known:
                what, hint = f"{name} builds on an unknown overlay, {other}", meant(other, known)
            elif name == other:
                what, hint = f"{name} builds on itself", "remove it"
            elif name in under.get(other, ()):
                what = f"{name} builds on {other}, which builds on {name}"
                hint = "remove it from one of the two"
            else:
                continue
            diagnostics.add(place, "SW064", what, hint)
            usable.discard(name)
    return {name: found for name, found in under.items() if usable.issuperset({name, *found})}


def _named(overlay: Files) -> Iterator[tuple[str, Place]]:
    """Yield the names in ``builds_on`` of an overlay, each with its position."""
    head = overlay["overlay"][0]
    for index, name in enumerate(head.data.get("builds_on", ())):
        yield name, head.place("builds_on", index)


def _under(name: str, named: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the overlays under one: each after those that it builds on."""
    found: list[str] = []
    entered: set[str] = set()

    def enter(names: Iterable[str]) -> None:
        for other in names:
            if other not in entered:
                entered.add(other)
                enter(named.get(other, ()))
                found.append(other)

    enter(named[name])
    return found


def in_order(names: Collection[str], under: Mapping[str, Sequence[str]]) -> list[str]:
    """Return overlays in the given order, but each after those of them that it builds on."""
    whole = (other for name in names for other in (*under.get(name, ()), name))
    return [name for name in dict.fromkeys(whole) if name in names]


def check_order(
    overlays: Mapping[str, Files],
    chosen: Sequence[str],
    protocol: str,
    diagnostics: Diagnostics,
) -> None:
    """Check that each overlay is applied after those that it builds on.

    :param chosen: the overlays in the order of their application.
    :param protocol: the name of the directory of the protocol, for hints.
    """
    for index, name in enumerate(chosen):
        for other, place in _named(overlays[name]):
            if other not in chosen[:index]:
                what = f"{name} builds on {other}, which is not applied before it"
                hint = f"apply it first: `--overlay {protocol}/{other} --overlay {protocol}/{name}`"
                if overlays[other]["overlay"][0].data.get("default"):
                    hint += ", or leave out --base"
                diagnostics.add(place, "SW064", what, hint)
