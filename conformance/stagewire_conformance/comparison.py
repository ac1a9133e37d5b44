"""Compare an answer of a testee with the one that a case expects, and name the difference.

Cases follow from the registry: the boundaries of every field, every name, every refusal. Requests and
answers are those of the testee protocol, so that a testee in any language can be asked; here any
object that answers lines is.
"""

from __future__ import annotations

import enum
import json
import typing
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

Json = Mapping[str, Any]

REFUSALS = (
    "truncated", "trailing", "bad_length", "unknown_message", "unknown_field", "missing_field",
    "out_of_range", "bad_value", "bad_request", "unsupported",
)  # fmt: skip
"""Codes with which a testee refuses."""


class Outcome(enum.StrEnum):
    """What became of a case; its value is how people are told."""

    PASSED = "passed"
    FAILED = "failed"
    """Granted as it should be with something else, or refused as it should be for something else."""
    REFUSED_WRONGLY = "refused wrongly"
    ACCEPTED_WRONGLY = "accepted wrongly"
    RUBBISH = "rubbish"
    """What came is no answer at all, or more came than was asked."""
    OUT_OF_ORDER = "out of order"
    CRASHED = "crashed"
    TIMED_OUT = "timed out"
    SKIPPED = "skipped"
    """Not asked: the testee says that it has not got it."""


def compare(wanted: Json, came: Json, ids: Collection[int | str | None]) -> Outcome:
    """Return whether an answer is what is wanted, and if not, in which way.

    :param wanted: the answer without ``id`` and without ``detail``, which is for people; empty where any
        answer of the right shape will do.
    :param came: the answer as it came.
    :param ids: the ids that it may echo.
    """
    if shape(came) or _text(came.get("id")) not in {_text(id) for id in ids}:
        return Outcome.FAILED
    said = {key: value for key, value in came.items() if key not in ("id", "detail")}
    if not wanted or canonical(said) == canonical(wanted):
        return Outcome.PASSED
    if said["ok"] == wanted["ok"]:
        return Outcome.FAILED
    return Outcome.ACCEPTED_WRONGLY if said["ok"] else Outcome.REFUSED_WRONGLY


def shape(came: Json) -> str:
    """Return what is wrong with the shape of an answer, whatever it answers; empty for nothing."""
    if not isinstance(came.get("ok"), bool):
        return "ok is true or false"
    if came["ok"]:
        return "detail is said of a refusal only" if "detail" in came else ""
    if came.get("error") not in REFUSALS:
        return f"error is one of {', '.join(REFUSALS)}"
    detail = came.get("detail")
    return "" if isinstance(detail, str) and detail else "detail says in words why it is refused"


def canonical(answer: Json) -> str:
    """Return an answer as text that is the same for the same JSON; in Python true is equal to 1."""
    return json.dumps(answer, sort_keys=True, ensure_ascii=False)


def _text(id: object) -> str:
    return json.dumps(id)


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
