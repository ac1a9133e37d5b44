"""Registry mutants: every layout with data, with one field swapped, re-signed or shifted.

A mutant is detected if it contradicts the witness, a worked example, a capture, or the size that the document
prints for a command. Round trips detect no mutant, because a codec that is wrong in both directions is
consistent. As a program, this module tries all mutants of both protocols, and prints each survivor with the
reason why the document cannot contradict it:

    python tests/mutation/mutants.py
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from stagewire_conformance.notation import octets
from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.framing import part
from stagewire_generator.lint.witness.comparison import NOTHING, Comparison
from stagewire_generator.lint.witness.witness import Witness, compare_section, compare_witness
from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.model_fields import Field, Format
from stagewire_generator.reader import find_spec, read
from stagewire_generator.resolver.protocol import resolve
from stagewire_generator.strict_yaml import Document

ROOT = Path(__file__).parents[2]
PROTOCOLS = ("thorlabs_apt", "asi_ms2000")
FRAMES = ("tx", "rx", "lost")

Json = dict[str, Any]


@dataclass(frozen=True)
class Mutant:
    """A wrong registry: the messages that share the wrong layout, and the change."""

    messages: tuple[Message, ...]
    layout: str
    change: str

    def __str__(self) -> str:
        return f"{self.messages[0].name} ({self.layout}): {self.change}"


class Proof:
    """The real registry, and the evidence that can contradict a mutant."""

    def __init__(self, name: str) -> None:
        diagnostics = Diagnostics()
        [source] = find_spec(ROOT / "spec" / name).protocols
        self.files = read(source, diagnostics, lambda _: None)
        self.protocol: Protocol = resolve(self.files, diagnostics)
        assert not diagnostics.found
        self.witness: list[Document] = self.files["printed"]
        self.frames: dict[str, list[Json]] = {}
        self.formats: dict[str, list[Json]] = {}  # claims on size and sign, by message
        for entry in self.protocol.examples["examples"].values():
            if entry["kind"] in FRAMES:
                self.frames.setdefault(entry["message"], []).append(entry)
            elif "format" in entry.get("claim", ()):
                message = entry["claim"]["format"].partition(".")[0]
                self.formats.setdefault(message, []).append(entry["claim"])
        for entry in self.protocol.captures.get("captures", {}).values():
            if "fields" in entry:
                self.frames.setdefault(entry["message"], []).append(entry)

    def mutants(self) -> Iterator[Mutant]:
        """Yield every mutant. Messages that share a field list share its mutation."""
        done: set[Place] = set()
        for message in self.protocol.messages:
            for layout in message.layouts:
                if not layout.fields or layout.fields[0].place in done:
                    continue
                place = layout.fields[0].place
                done.add(place)
                sharing = [
                    m
                    for m in self.protocol.messages
                    if any(x.fields and x.fields[0].place == place for x in m.layouts)
                ]
                for change, fields in mutations(layout):
                    changed = tuple(with_fields(m, place, fields) for m in sharing)
                    yield Mutant(changed, layout.form, change)

    def found_by(self, mutant: Mutant) -> str:
        """Return the kind of evidence that contradicts the mutant, or an empty string."""
        if self.differences(mutant.messages) != self.differences(
            tuple(m for m in self.protocol.messages if m.name in {x.name for x in mutant.messages})
        ):
            return "witness"
        for message in mutant.messages:
            if message.kind == "command" and message.size not in lengths(message):
                return "size"
            for entry in self.frames.get(message.name, []):
                if contradicts(entry, message):
                    return "example" if "page" in entry else "capture"
            if any(denies(claim, message) for claim in self.formats.get(message.name, [])):
                return "statement"
        return ""

    def differences(self, messages: tuple[Message, ...]) -> dict[str, tuple[str, str]]:
        """Return the differences between the witness and these messages.

        If the document prints no value, the encoded value is ignored.
        """
        names = {message.name: message for message in messages}
        whole = replace(
            self.protocol, messages=tuple(names.get(m.name, m) for m in self.protocol.messages)
        )
        if self.protocol.framing["kind"] == "slots":
            comparisons = [compare_witness(whole, self.witness)]
        else:  # skip the lists of all messages, which are long and have no fields
            witness: Witness = part(whole.framing["kind"], "witness")
            comparisons = [Comparison(whole, document) for document in self.witness]
            for comparison in comparisons:
                for name, entry in comparison.document.data.get("messages", {}).items():
                    if name in names:
                        compare_section(comparison, name, entry, witness.tables)
        return {
            place: (difference.printed, "" if difference.printed == NOTHING else difference.encoded)
            for comparison in comparisons
            for place, difference in comparison.differences.items()
        }

    def reason(self, mutant: Mutant) -> str:
        """Return the reason why the document cannot contradict the mutant."""
        if mutant.change.startswith("swapped"):
            names = mutant.change.removeprefix("swapped ").split(" and ")
            fields = [f for m in mutant.messages for x in m.layouts for f in x.fields]
            if all(f.role == "reserved" for f in fields if f.name in names):
                return "both fields are unused and have the same width and printed name"
        if mutant.change.startswith("re-signed"):
            return "the document prints no format with a sign for it, and no example is negative"
        return "no field table and no example shows this layout"


@cache
def proof_of(name: str) -> Proof:
    """Return the proof of a protocol. It is read only once."""
    return Proof(name)


OTHER_SIGN = {"word": "short", "long": "dword", "u16": "s16", "u24": "s24"}
OTHER_SIGN |= {other: name for name, other in OTHER_SIGN.items()}


def mutations(layout: Layout) -> Iterator[tuple[str, tuple[Field, ...]]]:
    """Yield each wrong field list with a description of the change."""
    fields = layout.fields
    for index, (one, other) in enumerate(pairwise(fields)):
        swapped = (
            replace(other, offset=one.offset),
            replace(one, offset=one.offset + other.format.size),
        )
        yield (
            f"swapped {one.name} and {other.name}",
            (*fields[:index], *swapped, *fields[index + 2 :]),
        )
    for index, field in enumerate(fields):
        if field.format.kind == "integer" and field.format.size > 1:
            size, signed = field.format.size, not field.format.signed
            format = Format(OTHER_SIGN[field.format.name], size, signed, "integer")
            yield f"re-signed {field.name}", (
                *fields[:index], replace(field, format=format), *fields[index + 1 :]
            )  # fmt: skip
        shifted = tuple(replace(f, offset=f.offset + 1) for f in fields[index:])
        yield f"shifted {field.name} and later fields by one byte", (*fields[:index], *shifted)


def with_fields(message: Message, place: Place, fields: tuple[Field, ...]) -> Message:
    """Return the message with another field list in the layout at that place."""
    end = fields[-1].offset + fields[-1].format.size
    layouts = tuple(
        replace(layout, fields=fields, length=end)
        if layout.fields and layout.fields[0].place == place
        else layout
        for layout in message.layouts
    )
    return replace(message, layouts=layouts)


def lengths(message: Message) -> set[int | None]:
    """Return the valid sizes of a command: the length of its request, or else of its reply."""
    length = {layout.form: layout.length for layout in message.layouts}
    return {length["request"] or length.get("reply", 0), *([] if length["request"] else [None])}


def contradicts(entry: Json, message: Message) -> bool:
    """Return whether a worked frame contradicts the layouts of the message."""
    layout = next((x for x in message.layouts if x.form == entry.get("form")), None)
    if layout is None or not layout.fields:
        return False
    raw = octets(entry, "encoded" if "encoded" in entry else "printed")
    payload = raw if layout.form == "reply" else raw[3:-1] if message.kind == "command" else raw[6:]
    if len(payload) < layout.length:
        return True
    for field in layout.fields:
        if field.name not in entry["fields"]:
            continue
        piece = payload[field.offset : field.offset + field.format.size]
        if decoded(piece, field.format) != entry["fields"][field.name]:
            return True
    return False


def denies(claim: Json, message: Message) -> bool:
    """Return whether a statement contradicts the size or sign of a field."""
    name = claim["format"].partition(".")[2]
    fields = [f for layout in message.layouts for f in layout.fields if f.name == name]
    said = (claim["size"], claim["signed"])
    return any((f.format.size, f.format.signed) != said for f in fields)


def decoded(piece: bytes, format: Format) -> Any:
    """Decode one field without the generated code."""
    if format.kind == "text":
        return piece.rstrip(b"\0").decode("latin-1")
    if format.kind == "bytes":
        return piece.hex()
    return int.from_bytes(piece, "little", signed=format.signed)


def main() -> int:
    """Try all mutants and print the survivors."""
    for name in PROTOCOLS:
        proof = proof_of(name)
        found: Counter[str] = Counter()
        for mutant in proof.mutants():
            by = proof.found_by(mutant)
            found[f"by {by}" if by else "survived"] += 1
            if not by:
                print(f"survives: {mutant}: {proof.reason(mutant)}")
        print(f"{name}: {', '.join(f'{found[by]} {by}' for by in sorted(found))}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
