"""Run the worked examples of a document, and the captures, against a protocol.

The examples are transcribed from the document, never generated from the registry. Each is tried in both
directions: the stated values must encode to the bytes, and the bytes must decode to the stated values. If the
document is wrong (verdict ``erratum``), the printed bytes must behave exactly as the example describes; an
erratum that passes is a failure. The coverage states which messages have examples.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stagewire.protocols import Protocol
from stagewire_conformance.arithmetic import check_number, check_scaling, check_stated
from stagewire_conformance.claims import check_claim
from stagewire_conformance.frames import check_capture, check_frame
from stagewire_conformance.keyboard import check_keyboard
from stagewire_conformance.registry import Registry, registry_of
from stagewire_conformance.verdict import Findings, Verdict


@dataclass(frozen=True, slots=True)
class Coverage:
    """The coverage of a message.

    :param pages: where the document describes it.
    :param layouts: the number of its forms on the wire; 0 if no layout is documented.
    :param examples: the number of worked examples about it.
    :param example_pages: the pages of these examples.
    :param captures: the number of captured frames from third parties.
    """

    message: str
    pages: tuple[int, ...]
    layouts: int
    examples: int
    example_pages: tuple[int, ...]
    captures: int


def coverage(protocol: Protocol) -> list[Coverage]:
    """Return one row for every message of the protocol, in the order of the registry."""
    vectors = protocol.vectors()
    pages: dict[str, list[int]] = {}
    for entry in vectors["examples"]:
        if entry.get("message"):
            pages.setdefault(entry["message"], []).append(entry["page"])
    captured = [entry.get("message") for entry in vectors["captures"]]
    return [
        Coverage(
            message=name,
            pages=tuple(message["pages"]),
            layouts=len(message["layouts"]),
            examples=len(pages.get(name, ())),
            example_pages=tuple(sorted(set(pages.get(name, ())))),
            captures=captured.count(name),
        )
        for name, message in registry_of(protocol).messages.items()
    ]


FRAMES = ("tx", "rx", "lost")
NUMBERS = ("stream", "number_format")


def run(protocol: Protocol) -> list[Verdict]:
    """Run every worked example and every capture of the protocol, in the order of the document."""
    vectors = protocol.vectors()
    return [
        *(run_example(protocol, entry) for entry in vectors["examples"]),
        *(run_capture(protocol, entry) for entry in vectors["captures"]),
    ]


def run_example(protocol: Protocol, entry: Mapping[str, Any]) -> Verdict:
    """Run one worked example."""
    registry = registry_of(protocol)
    findings = Findings()
    _known_errata(registry, entry, findings)
    kind = entry["kind"]
    if kind in FRAMES:
        check_frame(protocol, entry, findings)
        for name, item in entry.get("stated", {}).items():
            check_stated(registry, name, item, entry, findings)
    elif kind == "keyboard":
        check_keyboard(protocol, entry, findings)
    elif kind in NUMBERS:
        check_number(registry, entry, findings)
    elif kind == "scaling":
        check_scaling(registry, entry, findings)
    elif kind == "statement":
        check_claim(protocol, entry, findings)
    else:
        findings.problems.append(f"unknown kind of example {kind}")
    return _verdict(entry, findings)


def run_capture(protocol: Protocol, entry: Mapping[str, Any]) -> Verdict:
    """Run one capture: a frame that a third party sent or published."""
    findings = Findings()
    _known_errata(registry_of(protocol), entry, findings)
    check_capture(protocol, entry, findings)
    return _verdict(entry, findings)


def _verdict(entry: Mapping[str, Any], findings: Findings) -> Verdict:
    return Verdict(
        id=entry["id"],
        page=entry.get("page"),
        line=entry.get("line"),
        kind=entry["kind"],
        message=entry.get("message") or "",
        title=entry.get("title") or entry.get("says") or entry.get("note") or "",
        expected=entry["verdict"],
        outcome=findings.outcome,
        detail=findings.detail,
    )


def _known_errata(registry: Registry, entry: Mapping[str, Any], findings: Findings) -> None:
    named = [*entry.get("errata", []), *entry.get("breakdown", {}).get("errata", [])]
    known = registry.table("errata")
    for slug in named:
        findings.expect(slug in known, f"unknown erratum {slug}")
