"""The pipeline: strict load, schema, resolve, lint, frozen model; one view and one rendering a target."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from stagewire_generator import manifest
from stagewire_generator.diagnostics import Diagnostics, Place, SpecError
from stagewire_generator.lint import (
    check_errata,
    check_framing,
    check_layouts,
    check_names,
    check_pages,
)
from stagewire_generator.model import Protocol
from stagewire_generator.reader import protocol_folders, read
from stagewire_generator.resolver import resolve
from stagewire_generator.targets import python, registry, vectors

__all__ = ["TARGETS", "Counts", "check", "render"]

TARGETS: dict[str, Callable[[Protocol], dict[str, str]]] = {
    "python": python.render,
    "registry": registry.render,
    "vectors": vectors.render,
}


@dataclass(frozen=True, slots=True)
class Counts:
    """What a check looked at, for the summary line."""

    messages: int
    layouts: int
    fields: int
    errata: int
    places: int
    examples: int


def check(
    spec: Path,
    progress: Callable[[str], None] | None = None,
    counts: dict[str, Counts] | None = None,
) -> list[Protocol]:
    """Load and check all protocols in ``spec``.

    :param progress: called with the name of what is being read or checked.
    :param counts: filled with what was looked at, by protocol.
    Raises :class:`SpecError` with every diagnostic of the run.
    """
    say = progress or (lambda _: None)
    diagnostics = Diagnostics()
    folders = protocol_folders(spec)
    if not folders:
        what = "no folder with a protocol.yaml in it"
        hint = "give the folder that holds one or more protocols, or one of these"
        diagnostics.add(Place(str(spec)), "SW006", what, hint)
    protocols: list[Protocol] = []
    for folder in folders:
        before = len(diagnostics.found)
        files = read(folder, diagnostics, say)
        if len(diagnostics.found) > before or "protocol" not in files:
            continue  # a model of half a spec would only bring errors that are none
        protocol = resolve(files, diagnostics)
        say(f"{protocol.name}: names and layouts")
        check_names(protocol, next(iter(files.get("units", [])), None), diagnostics)
        check_layouts(protocol, diagnostics)
        check_framing(protocol, files["protocol"][0], diagnostics)
        check_pages(protocol, files, diagnostics)
        say(f"{protocol.name}: witness and errata")
        comparison = check_errata(protocol, files, diagnostics)
        for other in protocols:
            head = files["protocol"][0]
            if protocol.name == other.name:
                place = head.place("protocol")
                diagnostics.add(place, "SW020", f"the protocol {protocol.name} is defined twice")
            elif protocol.package == other.package:
                place = head.place("python", "package")
                diagnostics.add(place, "SW020", f"the package {protocol.package} is defined twice")
        protocols.append(protocol)
        if counts is not None:
            layouts = [layout for message in protocol.messages for layout in message.layouts]
            counts[protocol.name] = Counts(
                messages=len(protocol.messages),
                layouts=len(layouts),
                fields=sum(len(layout.all_fields) for layout in layouts),
                errata=len(protocol.errata),
                places=comparison.compared,
                examples=len(protocol.examples.get("examples", {})),
            )
    if diagnostics:
        raise SpecError(list(diagnostics))
    return protocols


def render(protocols: Sequence[Protocol], targets: Sequence[str] | None = None) -> dict[str, str]:
    """Return path (below the output folder) -> text of everything that is generated."""
    files: dict[str, str] = {}
    for protocol in protocols:
        for target in targets or TARGETS:
            files.update(TARGETS[target](protocol))
    if not targets:
        digests = {path: manifest.digest(text) for path, text in files.items()}
        files[manifest.MANIFEST] = manifest.render(digests)
    return dict(sorted(files.items()))
