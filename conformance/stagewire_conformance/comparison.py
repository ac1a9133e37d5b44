"""Compare the answer of a testee with the expected one, and name the difference.

Cases follow from the registry: the boundaries of every field, every name, every refusal. Requests and answers
are those of the testee protocol, so that codecs in any language can be tested. Any object that answers lines
can be a testee.
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
"""Codes of refusals."""


class Outcome(enum.StrEnum):
    """The result of a case. The values are shown to users."""

    PASSED = "passed"
    FAILED = "failed"
    """Granted with a wrong answer, or refused with a wrong code."""
    REFUSED_WRONGLY = "refused wrongly"
    ACCEPTED_WRONGLY = "accepted wrongly"
    RUBBISH = "rubbish"
    """The answer is not a JSON object of the right shape, or there is more than one line."""
    OUT_OF_ORDER = "out of order"
    CRASHED = "crashed"
    TIMED_OUT = "timed out"
    SKIPPED = "skipped"
    """Not run: the testee does not support its protocol or operation."""
    NOT_IMPLEMENTED = "not implemented"
    """Not run: the testee does not implement its message."""


def compare(wanted: Json, came: Json, ids: Collection[int | str | None]) -> Outcome:
    """Compare an answer with the expected one, and return the kind of difference.

    :param wanted: the expected answer without ``id`` and ``detail``; empty if any answer of the right shape
        is accepted.
    :param came: the actual answer.
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
    """Return what is wrong with the shape of an answer, or an empty string."""
    if not isinstance(came.get("ok"), bool):
        return "ok must be true or false"
    if came["ok"]:
        return "only a refusal has detail" if "detail" in came else ""
    if came.get("error") not in REFUSALS:
        return f"error must be one of {', '.join(REFUSALS)}"
    detail = came.get("detail")
    return "" if isinstance(detail, str) and detail else "detail must be a text with the reason"


def canonical(answer: Json) -> str:
    """Return an answer as text that is equal for equal JSON. In Python ``True == 1``, in JSON they differ."""
    return json.dumps(answer, sort_keys=True, ensure_ascii=False)


def _text(id: object) -> str:
    return json.dumps(id)


class Answering(typing.Protocol):
    """An object that answers lines: the Python testee, or a running process."""

    def answer(self, line: bytes) -> Json:
        """Return the answer to one line."""
        ...


@dataclass(frozen=True, slots=True)
class Mismatch:
    """A case with a wrong answer.

    :param id: of the case.
    :param request: the request.
    :param wanted: the expected answer.
    :param came: the actual answer, without ``id``.
    """

    id: str
    request: Json
    wanted: Json
    came: Json

    def __str__(self) -> str:
        asked, wanted, came = map(canonical, (self.request, self.wanted, self.came))
        return f"{self.id}: the answer to {asked} is {came}, expected {wanted}"


def mismatches(testee: Answering, protocol: str, cases: Iterable[Json]) -> Iterator[Mismatch]:
    """Run all cases, and yield those with a wrong answer.

    :param protocol: its name in the registry.
    :param cases: as in the vectors of the protocol.

    A refusal must have a ``detail``, but its text is not compared.
    """
    for number, case in enumerate(cases):
        request = {"id": number, "protocol": protocol, **case["request"]}
        came = dict(testee.answer(json.dumps(request).encode("utf-8")))
        if compare(case["answer"], came, (number,)) is not Outcome.PASSED:
            yield Mismatch(case["id"], request, case["answer"], came)
