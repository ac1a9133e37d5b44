"""Asks a testee the cases of a protocol, and compares what it answers.

Cases follow from the registry: the boundaries of every field, every name, every refusal. Requests and
answers are those of the testee protocol, so that a testee in any language can be asked them; this asks any
object that answers lines.
"""

from __future__ import annotations

import json
import typing
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from stagewire_conformance.comparison import Outcome, canonical, compare

__all__ = ["Answering", "Mismatch", "mismatches"]

Json = Mapping[str, Any]


class Answering(typing.Protocol):
    """What can be asked: the Python testee, or what stands for a process that is one."""

    def answer(self, line: bytes) -> Json:
        """Return the answer to one line."""
        ...


@dataclass(frozen=True, slots=True)
class Mismatch:
    """A case that was answered in another way.

    :param id: of the case.
    :param request: what was asked.
    :param wanted: what the case has for an answer.
    :param came: what came, without ``id``.
    """

    id: str
    request: Json
    wanted: Json
    came: Json

    def __str__(self) -> str:
        asked, wanted, came = map(canonical, (self.request, self.wanted, self.came))
        return f"{self.id}: {asked} is answered with {came}; it should be {wanted}"


def mismatches(testee: Answering, protocol: str, cases: Iterable[Json]) -> Iterator[Mismatch]:
    """Ask every case, and yield those that are answered in another way.

    :param protocol: its name in the registry.
    :param cases: as the vectors of the protocol have them.

    The ``detail`` of a refusal is for people: it has to be there, and is not compared.
    """
    for number, case in enumerate(cases):
        request = {"id": number, "protocol": protocol, **case["request"]}
        came = dict(testee.answer(json.dumps(request).encode("utf-8")))
        if compare(case["answer"], came, (number,)) is not Outcome.PASSED:
            yield Mismatch(case["id"], request, case["answer"], came)
