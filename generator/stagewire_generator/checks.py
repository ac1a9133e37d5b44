"""The checks of one protocol, and of each of its overlays laid over it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.lint.devices import check_devices, check_effects
from stagewire_generator.lint.errata import check_errata
from stagewire_generator.lint.layouts import check_framing, check_layouts, check_pages
from stagewire_generator.lint.names import check_names
from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.model import Protocol
from stagewire_generator.overlays.composition import compose
from stagewire_generator.reader import Files, SourceFolder, read_overlay
from stagewire_generator.resolver.protocol import resolve

Say: TypeAlias = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Checked:
    """A protocol that was checked, perhaps under an overlay; its files, or the overlay's own."""

    protocol: Protocol
    comparison: Comparison
    files: Files


def check_protocol(files: Files, diagnostics: Diagnostics, say: Say) -> Checked:
    """Resolve and check a protocol by itself, without its overlays."""
    protocol = _resolved(files, diagnostics, say)
    check_pages(protocol, files, diagnostics)
    say(f"{protocol.name}: witness and errata")
    return Checked(protocol, check_errata(protocol, files, diagnostics), files)


def check_overlays(
    source: SourceFolder, base: Files, chosen: Sequence[str], diagnostics: Diagnostics, say: Say
) -> tuple[Protocol | None, dict[str, Checked]]:
    """Check every overlay of a protocol, each by itself, then those that are chosen together.

    The document of the protocol is not compared again. What an overlay leaves as it is was compared without
    it; what it replaces is another document's.

    :param base: the files of the protocol, in which nothing is wrong.
    :param chosen: names of overlays, in the order in which they are laid over.
    Returns the protocol under the chosen ones, None where none is chosen or something is wrong; and by
    ``PROTOCOL/OVERLAY`` the protocol under each.
    """
    right: dict[str, tuple[Files, Protocol]] = {}
    checked: dict[str, Checked] = {}
    for overlay in source.overlays:
        before = len(diagnostics.found)
        files = read_overlay(overlay, diagnostics, say)
        if len(diagnostics.found) > before:
            continue
        protocol = _laid_over(base, [files], diagnostics, say)
        if protocol is None:
            continue
        name = overlay.path.name
        view = replace(protocol, document=protocol.document_of(name))
        check_pages(view, files, diagnostics)
        title = f"{protocol.name}/{name}"
        say(f"{title}: witness and errata")
        compared = check_errata(protocol, files, diagnostics, name)
        checked[title] = Checked(protocol, compared, files)
        right[name] = files, protocol
    if not chosen or not right.keys() >= set(chosen):
        return None, checked
    if len(chosen) == 1:
        return right[chosen[0]][1], checked
    return _laid_over(base, [right[name][0] for name in chosen], diagnostics, say), checked


def _laid_over(
    base: Files, overlays: Sequence[Files], diagnostics: Diagnostics, say: Say
) -> Protocol | None:
    """Return the protocol under overlays; None, and diagnostics, where they do not fit."""
    files = compose(base, overlays, diagnostics)
    return None if files is None else _resolved(files, diagnostics, say)


def _resolved(files: Files, diagnostics: Diagnostics, say: Say) -> Protocol:
    """Return the model, with everything checked that needs no document."""
    protocol = resolve(files, diagnostics)
    say(f"{'/'.join([protocol.name, *(o.name for o in protocol.overlays)])}: names and layouts")
    check_names(protocol, next(iter(files.get("units", [])), None), diagnostics)
    check_layouts(protocol, diagnostics)
    check_framing(protocol, files["protocol"][0], diagnostics)
    check_devices(protocol, files.get("quantities", ()), diagnostics)
    check_effects(protocol, diagnostics)
    return protocol
