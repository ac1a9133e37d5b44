"""The pipeline: load, validate, resolve and lint a spec with its overlays, then render each target.

It also lists the input files, so that a build system knows when to run the generator again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TypeAlias, overload

from stagewire_generator.diagnostics import Diagnostics, Place, SpecError
from stagewire_generator.lint.devices import check_devices, check_effects
from stagewire_generator.lint.errata import check_errata
from stagewire_generator.lint.layouts import (
    check_contexts,
    check_framing,
    check_layouts,
    check_pages,
)
from stagewire_generator.lint.names import check_names
from stagewire_generator.lint.stages import check_stages
from stagewire_generator.lint.units import check_units
from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.model import Protocol
from stagewire_generator.naming import c_prefix
from stagewire_generator.output import MANIFEST, digest, manifest
from stagewire_generator.overlays.composition import Composition, compose, entries_of
from stagewire_generator.overlays.order import check_order, foundations, in_order
from stagewire_generator.overlays.register import Key
from stagewire_generator.reader import (
    Files,
    SourceFolder,
    SpecFolder,
    find_spec,
    read,
    read_overlay,
)
from stagewire_generator.resolver.protocol import resolve
from stagewire_generator.schemas import schema_folder
from stagewire_generator.targets import c, project, python, registry, vectors
from stagewire_generator.targets.environment import COMPILED
from stagewire_generator.targets.python.devices.attributes_view import check_attributes
from stagewire_generator.targets.templates import Templates, templates_in

Say: TypeAlias = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Checked:
    """A checked protocol, perhaps with an overlay applied, and its files or those of the overlay."""

    protocol: Protocol
    comparison: Comparison
    files: Files


def check_protocol(files: Files, diagnostics: Diagnostics, say: Say) -> Checked:
    """Resolve and check a protocol without its overlays."""
    protocol = _resolved(files, diagnostics, say)
    check_pages(protocol, files, diagnostics)
    say(f"{protocol.name}: witness and errata")
    return Checked(protocol, check_errata(protocol, files, diagnostics), files)


def check_overlays(
    source: SourceFolder,
    base: Checked,
    requested: Sequence[str],
    diagnostics: Diagnostics,
    say: Say,
    *,
    defaults: bool = True,
) -> tuple[Protocol | None, dict[str, Checked]]:
    """Check each overlay of a protocol on what it builds on, then all that apply together.

    The document of the protocol is not compared again: unchanged entries were compared before, and replaced
    entries belong to another document.

    :param base: the protocol, which has no errors.
    :param requested: names of overlays, in the order in which they are applied.
    :param defaults: whether the overlays that are on by default apply, before those that are requested.
    Returns the protocol with the overlays that apply, or None if none applies or one has errors; and the
    protocol with each overlay and those that it builds on, by ``PROTOCOL/OVERLAY``.
    """
    readable: dict[str, Files] = {}
    for overlay in source.overlays:
        before = diagnostics.reported
        files = read_overlay(overlay, diagnostics, say)
        if diagnostics.reported == before:
            readable[overlay.path.name] = files
    known = [overlay.path.name for overlay in source.overlays]
    under = foundations(readable, known, diagnostics)
    layers = _Layers(base, readable, under, diagnostics, say)
    checked: dict[str, Checked] = {}
    right: set[str] = set()
    for name in in_order(list(under), under):
        before = diagnostics.reported
        if not right.issuperset(under[name]):
            continue  # it would repeat the errors
        layer = layers[(*under[name], name)]
        if layer is None:
            continue
        protocol = layer.protocol
        check_pages(
            replace(protocol, document=protocol.document_of(name)), readable[name], diagnostics
        )
        title = f"{protocol.name}/{name}"
        say(f"{title}: witness and errata")
        compared = check_errata(protocol, readable[name], diagnostics, name, layer.files)
        checked[title] = Checked(protocol, compared, readable[name])
        if diagnostics.reported == before:  # otherwise a combination would repeat the errors
            right.add(name)
    on = [
        name for name in readable if defaults and readable[name]["overlay"][0].data.get("default")
    ]
    chosen = [*in_order(on, under), *(name for name in requested if name not in on)]
    found = dict(sorted(checked.items()))
    if not chosen or not right.issuperset(chosen):
        return None, found
    before = diagnostics.reported
    check_order(readable, chosen, source.path.name, diagnostics)
    together = layers[tuple(chosen)] if diagnostics.reported == before else None
    return None if together is None else together.protocol, found


@dataclass(frozen=True, slots=True)
class _Layer:
    """A protocol with overlays, and what the next overlay needs to know.

    :param files: the files, in which each entry of an overlay names it.
    :param sound: whether the model has no errors.
    """

    composition: Composition
    files: Files
    protocol: Protocol
    sound: bool


class _Layers:
    """A protocol with different overlays, by their names in the order of their application.

    Each combination is resolved and checked once, on the one that lacks the last overlay.
    """

    def __init__(
        self,
        base: Checked,
        overlays: Mapping[str, Files],
        under: Mapping[str, Sequence[str]],
        diagnostics: Diagnostics,
        say: Say,
    ) -> None:
        self.overlays = overlays
        self.under = under
        self.diagnostics = diagnostics
        self.say = say
        self.owners: dict[Key, str] = {
            key: name for name, files in overlays.items() for key, _ in entries_of(files)
        }
        self.base = base.protocol
        self.found: dict[tuple[str, ...], _Layer | None] = {
            (): _Layer(Composition(base.files), base.files, base.protocol, sound=True)
        }

    def __getitem__(self, names: tuple[str, ...]) -> _Layer | None:
        """Return the protocol with overlays, or None if they cannot be applied one after the other."""
        if names not in self.found:
            self.found[names] = self._laid(names[-1], self[names[:-1]])
        return self.found[names]

    def _laid(self, name: str, below: _Layer | None) -> _Layer | None:
        """Return the protocol with one more overlay."""
        if below is None or not below.sound:
            return None
        composition = compose(
            below.composition, self.overlays[name], self.diagnostics, self.under[name], self.owners
        )
        if composition is None:
            return None
        files, before = composition.files, self.diagnostics.reported
        protocol = _resolved(files, self.diagnostics, self.say)
        sound = self.diagnostics.reported == before
        if sound:
            protocol = replace(protocol, later_messages=_later_messages(protocol, self.base))
        return _Layer(composition, files, protocol, sound)


def _later_messages(protocol: Protocol, base: Protocol) -> dict[str, tuple[str, ...]]:
    """Return the messages that overlays add to the units of a protocol."""
    units = protocol.units.get("units", {})
    later = {
        name: tuple(sorted(protocol.messages_of(units[name]) - base.messages_of(earlier)))
        for name, earlier in base.units.get("units", {}).items()
        if name in units
    }
    return {name: found for name, found in later.items() if found}


def _resolved(files: Files, diagnostics: Diagnostics, say: Say) -> Protocol:
    """Return the model after all checks that do not need the document."""
    before = diagnostics.reported
    protocol = resolve(files, diagnostics)
    say(f"{'/'.join([protocol.name, *(o.name for o in protocol.overlays)])}: names and layouts")
    units = next(iter(files.get("units", [])), None)
    check_names(protocol, units, diagnostics)
    check_layouts(protocol, diagnostics)
    check_framing(protocol, files["protocol"][0], diagnostics)
    check_devices(protocol, files.get("quantities", ()), diagnostics)
    check_effects(protocol, diagnostics)
    if units is not None and diagnostics.reported == before:  # so all references are valid
        check_units(protocol, units, diagnostics)
        check_stages(protocol, units, diagnostics)
        check_contexts(protocol, files["protocol"][0], diagnostics)
        check_attributes(protocol, diagnostics)
    return protocol


_OF_THE_GENERATOR = ("*.py", "*.j2", "*.[ch]")


def inputs(specs: Sequence[SpecFolder], templates: Path | None = None) -> list[Path]:
    """Return all files that determine the output, valid or not, sorted.

    These are the spec, its worked examples and captures, the user's templates, and the generator itself, so
    that an upgrade also triggers a run. Files that do not exist yet cannot be listed.
    """
    found = {path for spec in specs for path in spec.paths}
    if templates is not None:
        found.update(templates_in(templates))
    here = Path(__file__).parent
    for pattern in _OF_THE_GENERATOR:
        found.update(path for path in here.rglob(pattern) if COMPILED not in path.parents)
    found.update(schema_folder().glob("*.schema.json"))
    return sorted(path for path in found if path.is_file())


TARGETS: dict[str, Callable[[Protocol, Templates], dict[str, str]]] = {
    "c": c.render,
    "c-tests": c.render_tests,
    "python": python.render,
    "registry": lambda protocol, _: registry.render(protocol),  # JSON has no templates
    "vectors": lambda protocol, _: vectors.render(protocol),
}
DEFAULT_TARGETS = ("c", "python")
"""The Python packages contain the JSON. The C tests are generated on request."""


@dataclass(frozen=True, slots=True)
class Counts:
    """The numbers of checked items, for the summary line."""

    messages: int
    layouts: int
    fields: int
    errata: int
    not_compared: int  # errata that no program compares
    places: int
    examples: int


@dataclass(frozen=True, slots=True)
class CheckedSpec(Sequence[Protocol]):
    """A spec without errors: a sequence of its protocols, with everything that was checked.

    :param protocols: the protocols, with the overlays that apply, in the order of their directories.
    :param checked: models and files, by protocol and by ``PROTOCOL/OVERLAY``.
    """

    protocols: tuple[Protocol, ...]
    checked: Mapping[str, Checked]

    @overload
    def __getitem__(self, index: int) -> Protocol: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Protocol, ...]: ...
    def __getitem__(self, index: int | slice) -> Protocol | tuple[Protocol, ...]:
        return self.protocols[index]

    def __len__(self) -> int:
        return len(self.protocols)

    @property
    def counts(self) -> dict[str, Counts]:
        """The size of each checked model, with the same keys as ``checked``."""
        return {name: _counts(checked) for name, checked in self.checked.items()}


def check(
    spec: Path | SpecFolder,
    progress: Callable[[str], None] | None = None,
    overlays: Sequence[str] = (),
    *,
    base: bool = False,
) -> CheckedSpec:
    """Load and check all protocols in ``spec``, and each of their overlays.

    :param spec: the directory, or the files found in it.
    :param progress: called with the name of each file read, and of each check.
    :param overlays: overlays to apply to the returned protocols, as ``PROTOCOL/OVERLAY`` after their
        directories, besides those that are on by default; names that this spec does not have are ignored.
    :param base: leave out the overlays that are on by default.
    Raises :class:`SpecError` with all diagnostics of the run.
    """
    say = progress or (lambda _: None)
    diagnostics = Diagnostics()
    if isinstance(spec, Path):
        spec = find_spec(spec)
    if not spec.protocols:
        what = "no protocol.yaml in this directory or directly below it"
        hint = "give the directory of a spec or of a single protocol"
        diagnostics.add(Place(str(spec.path)), "SW006", what, hint)
    protocols: list[Protocol] = []
    all_checked: dict[str, Checked] = {}
    for source in spec.protocols:
        before = diagnostics.reported
        files = read(source, diagnostics, say)
        if diagnostics.reported > before or "protocol" not in files:
            continue  # a partly read spec would only produce spurious errors
        alone = check_protocol(files, diagnostics, say)
        protocol = alone.protocol
        checked = {protocol.name: alone}
        if diagnostics.reported == before:  # otherwise every overlay would repeat the errors
            wanted = [
                Path(name).name for name in overlays if Path(name).parent.name == source.path.name
            ]
            composed, under = check_overlays(
                source, alone, wanted, diagnostics, say, defaults=not base
            )
            protocol = composed or protocol
            checked |= under
        for other in protocols:
            head = files["protocol"][0]
            if protocol.name == other.name:
                place = head.place("protocol")
                diagnostics.add(place, "SW020", f"the protocol {protocol.name} is defined twice")
            elif protocol.package == other.package:
                place = head.place("python", "package")
                diagnostics.add(place, "SW020", f"the package {protocol.package} is defined twice")
            elif c_prefix(protocol.package) == c_prefix(other.package):
                place = head.place("python", "package")
                what = f"{protocol.package} and {other.package} get the same names in C"
                diagnostics.add(place, "SW022", what)
        protocols.append(protocol)
        all_checked |= checked
    if diagnostics:
        raise SpecError(list(diagnostics))
    return CheckedSpec(tuple(protocols), all_checked)


def _counts(checked: Checked) -> Counts:
    protocol = checked.protocol
    layouts = [layout for message in protocol.messages for layout in message.layouts]
    return Counts(
        messages=len(protocol.messages),
        layouts=len(layouts),
        fields=sum(len(layout.all_fields) for layout in layouts),
        errata=len(protocol.errata),
        not_compared=len(protocol.not_compared),
        places=checked.comparison.compared,
        examples=len(protocol.examples.get("examples", {})),
    )


def render(
    protocols: Sequence[Protocol],
    targets: Sequence[str] | None = None,
    templates: Templates | None = None,
    package: str = "",
) -> dict[str, str]:
    """Return path (relative to the output directory) -> text of every generated file.

    :param targets: names of targets, whose files are returned without a manifest. The default is
        :data:`DEFAULT_TARGETS`, with a manifest.
    :param templates: templates, some of which may be the user's. Raises ``TemplatesError`` if one fails.
    :param package: the name of the Python package of the only protocol. It makes the package a project that
        pip can install.
    """
    templates = templates or _ours()
    files: dict[str, str] = {}
    if package:
        [only] = protocols
        protocols = [replace(only, package=package)]
        if "python" in (targets or DEFAULT_TARGETS):
            files.update(project.render(protocols[0], templates))
    for protocol in protocols:
        for target in targets or DEFAULT_TARGETS:
            files.update(TARGETS[target](protocol, templates))
    if not targets:
        digests = {path: digest(text) for path, text in files.items()}
        files[MANIFEST] = manifest(digests)
    return dict(sorted(files.items()))


@cache
def _ours() -> Templates:
    """Return the built-in templates, cached: compiling them takes longer than rendering a small spec."""
    return Templates()
