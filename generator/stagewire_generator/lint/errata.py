"""Check that there is an erratum for every difference, and a reason for every erratum.

A difference between witness and registry needs an erratum that states both sides. An erratum needs a
difference, a place that is not compared, or a worked example.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from stagewire_generator.diagnostics import Diagnostics, meant
from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.lint.witness.scales import compare_scales
from stagewire_generator.lint.witness.statements import (
    Facts,
    check_decisions,
    check_witnesses,
    compare_statements,
)
from stagewire_generator.lint.witness.witness import compare_witness
from stagewire_generator.model import Erratum, Protocol, errata_of
from stagewire_generator.strict_yaml import Document

_NOT_PRINTED = (
    "transcribe the document; without a printed document, write `witness: false` in protocol.yaml"
)


def check_errata(
    protocol: Protocol,
    files: Mapping[str, list[Document]],
    diagnostics: Diagnostics,
    overlay: str = "",
    registry: Mapping[str, list[Document]] | None = None,
) -> Comparison:
    """Compare witness, registry, errata and examples with each other.

    :param files: the files of the protocol, or of the overlay.
    :param overlay: the overlay whose document and errata are checked; empty for the protocol itself. A
        witness is optional for an overlay; if it has one, all its messages must be in it.
    :param registry: the files of the protocol with the overlay applied, to which statements refer.
    """
    printed = files.get("printed", [])
    witness = bool(printed) if overlay else files["protocol"][0].data.get("witness", True)
    for document in () if witness else printed:
        what = "a witness is not allowed, because protocol.yaml has `witness: false`"
        diagnostics.add(document.place(), "SW046", what)
    comparison = compare_witness(protocol, printed if witness else [], overlay)
    facts = Facts(protocol, registry or files)
    if witness:
        compare_statements(comparison, facts, files, diagnostics)
    check_decisions(facts, files, diagnostics)
    if witness == "complete":
        check_witnesses(facts, comparison.tables, diagnostics)
    compare_scales(comparison, files)
    errata = [erratum for erratum in protocol.errata if erratum.overlay == overlay]
    claimed: dict[str, str] = {}
    for erratum in errata:
        for place in (*erratum.places, *erratum.not_compared):
            if place in claimed:
                diagnostics.add(
                    erratum.place, "SW045", f"{erratum.id} and {claimed[place]} both claim {place}"
                )
            claimed[place] = erratum.id
            _stated(erratum, place, comparison, diagnostics)
    for place, difference in sorted(comparison.differences.items()):
        if place not in claimed:
            diagnostics.add(
                difference.at,
                "SW040",
                f"{place}: the document has {difference.printed!r}, the registry {difference.encoded!r}",
            )
    for place, at in comparison.not_compared.items():
        if place not in claimed:
            what = f"{place}: the document contradicts itself, and no erratum explains it"
            diagnostics.add(
                at, "SW040", what, "add an erratum with this place under `not_compared`"
            )
    referred = _referred(protocol, files, diagnostics)
    unborne = [e for e in errata if not (e.places or e.not_compared) and e.id not in referred]
    if unborne and not files.get("examples"):
        what = f"{len(unborne)} errata refer to worked examples, but examples.yaml is missing"
        hint = f"add examples.yaml to the directory {protocol.name}"
        if overlay:
            hint = f"add examples.yaml to the directory of the overlay {overlay}"
        diagnostics.add(unborne[0].place, "SW006", what, hint)
        unborne = []
    for erratum in unborne:
        what = f"{erratum.id} names no place, and no worked example refers to it"
        diagnostics.add(erratum.place, "SW041", what)
    _known(protocol, errata, diagnostics)
    _exemplified(protocol, files, diagnostics)
    for at, name in comparison.unknown:
        diagnostics.add(at, "SW044", f"{name} is in the witness but not in the registry")
    for at, part in comparison.misplaced:
        hint = "remove it: with this framing it cannot be compared with anything"
        diagnostics.add(at, "SW038", part, hint)
    for message in protocol.messages if witness else ():
        name = message.twin_of or message.name
        if message.overlay == overlay and name not in comparison.witnessed:
            what = f"{name} does not occur in printed/"
            diagnostics.add(message.place, "SW043", what, "" if printed else _NOT_PRINTED)
    return comparison


def _stated(erratum: Erratum, place: str, comparison: Comparison, diagnostics: Diagnostics) -> None:
    """Check that document and registry differ at a place as the erratum states."""
    if place in erratum.not_compared:
        if place not in comparison.not_compared:
            what = f"{erratum.id}: the witness has no {place} that is not compared"
            diagnostics.add(erratum.place, "SW042", what, "correct the place, or remove it")
        return
    difference = comparison.differences.get(place)
    if difference is None:
        what = f"{erratum.id}: document and registry do not differ at {place}"
        diagnostics.add(erratum.place, "SW042", what)
    elif (difference.printed, difference.encoded) != erratum.places[place]:
        printed, encoded = erratum.places[place]
        what = (
            f"{place}: the document has {difference.printed!r}, the registry "
            f"{difference.encoded!r}; {erratum.id} states {printed!r} and {encoded!r}"
        )
        diagnostics.add(difference.at, "SW047", what)


def _known(protocol: Protocol, errata: Iterable[Erratum], diagnostics: Diagnostics) -> None:
    """Check that the messages and fields named by errata exist."""
    messages = {message.name for message in protocol.messages}
    fields = {
        f"{owner}.{field.name}"
        for message in protocol.messages
        for owner in {message.name, *(message.set or ())}
        for layout in message.layouts
        for field in layout.all_fields
    }
    for erratum in errata:
        for name in erratum.messages:
            if name not in messages:
                what = f"{erratum.id}: unknown message {name}"
                diagnostics.add(erratum.place, "SW021", what, meant(name, messages))
        for name in erratum.fields:
            if name not in fields:
                what = f"{erratum.id}: unknown field {name}"
                diagnostics.add(erratum.place, "SW021", what, meant(name, fields))


def _exemplified(
    protocol: Protocol, files: Mapping[str, list[Document]], diagnostics: Diagnostics
) -> None:
    """Check that the messages and fields named by examples and captures exist."""
    fields = {
        message.name: {field.name for layout in message.layouts for field in layout.all_fields}
        for message in protocol.messages
    }
    for kind in ("examples", "captures"):
        for document in files.get(kind, []):
            for id, entry in document.data[kind].items():
                message = entry.get("message", "")
                if message and message not in fields:
                    what = f"{id}: unknown message {message}"
                    place = document.place(kind, id, "message")
                    diagnostics.add(place, "SW021", what, meant(message, fields))
                for name in entry.get("fields", {}) if message in fields else ():
                    if name not in fields[message]:
                        what = f"{id}: {message} has no field {name}"
                        place = document.place(kind, id, "fields", name)
                        diagnostics.add(place, "SW021", what, meant(name, fields[message]))


def _referred(
    protocol: Protocol, files: Mapping[str, list[Document]], diagnostics: Diagnostics
) -> set[str]:
    """Return the errata that examples and captures refer to."""
    known = {erratum.id for erratum in protocol.errata}
    found: set[str] = set()
    for kind in ("examples", "captures"):
        for document in files.get(kind, []):
            for id, entry in document.data[kind].items():
                for erratum in errata_of(entry):
                    found.add(erratum)
                    if erratum not in known:
                        place = document.place(kind, id, "errata")
                        what = f"{id}: unknown erratum {erratum}"
                        diagnostics.add(place, "SW021", what, meant(erratum, known))
    return found
