"""``vectors/<protocol>.json``: worked examples, captures and cases, for any implementation."""

from __future__ import annotations

from functools import lru_cache

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.templates import canonical
from stagewire_generator.targets.vectors.cases import captures_of, cases_of, examples_of
from stagewire_generator.targets.vectors.subject import Case

__all__ = ["Case", "cases_of", "render", "vectors_text"]

SCHEMA_VERSION = 1


def render(protocol: Protocol) -> dict[str, str]:
    """Return the file of the vectors."""
    return {f"vectors/{protocol.name}.json": vectors_text(protocol)}


@lru_cache(maxsize=1)
def vectors_text(protocol: Protocol) -> str:
    """Return the vectors as canonical JSON, which the Python package also contains."""
    return canonical(
        {
            "schema_version": SCHEMA_VERSION,
            "protocol": protocol.name,
            "examples": examples_of(protocol),
            "captures": captures_of(protocol),
            "cases": [_case_json(case) for case in cases_of(protocol)],
        },
        lines={"cases"},
    )


def _case_json(case: Case) -> Json:
    """Return a case as JSON; many cases need no description."""
    about = {"about": case.about} if case.about else {}
    return {"id": case.id, **about, "request": case.request, "answer": case.answer}
