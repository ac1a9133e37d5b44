"""The cases of a protocol as vectors, as far as C can say them."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass

from stagewire_generator.model import Protocol
from stagewire_generator.targets.c.testing.values import CannotSayError
from stagewire_generator.targets.c.testing.vector import Content, Vectors, VectorView
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.cases import cases_of

__all__ = ["CasesView", "cases_view"]

_FUNCTIONS = ("refuse_prefix_bytes",)  # asked for in a request, and in C by a call


@dataclass(frozen=True, slots=True)
class CasesView:
    """Vectors of the cases.

    :param held: how many cases these are; one that encodes and one that decodes the same are one vector.
    :param total: how many the protocol has.
    :param left_out: lines that say what is not there, and how often.
    """

    vectors: tuple[VectorView, ...]
    held: int
    total: int
    left_out: tuple[str, ...]


def cases_view(protocol: Protocol) -> CasesView:
    """Make the view of all cases that encode or decode what C has a type for."""
    vectors, cases = Vectors(protocol), cases_of(protocol)
    made: list[VectorView] = []
    held = 0
    reasons: Counter[str] = Counter()
    waiting = deque(cases)
    while waiting:
        case = waiting.popleft()
        following = waiting[0] if waiting else None
        try:
            if following and (both := _pair(vectors, case, following)):
                made.append(both)
                waiting.popleft()
                held += 2
            else:
                made.append(_vector(vectors, case))
                held += 1
        except CannotSayError as error:
            reasons[str(error)] += 1
    left_out = tuple(f"{count} with {reason}" for reason, count in sorted(reasons.items()))
    return CasesView(tuple(made), held, len(cases), left_out)


def _pair(vectors: Vectors, encode: Case, decode: Case) -> VectorView | None:
    """Return one vector for two cases that are the same in both directions; None where they are not."""
    id = encode.id.replace("/encode/", "/encode+decode/")
    if id != decode.id.replace("/decode/", "/encode+decode/") or encode.refusal or decode.refusal:
        return None
    there, back = _encoded(vectors, encode), _decoded(vectors, decode)
    if there != back or encode.raw != decode.raw or encode.raw is None:
        return None
    make = vectors.carried if encode.request.get("allow_dummy") else vectors.both
    return make(id, there, encode.raw)


def _vector(vectors: Vectors, case: Case) -> VectorView:
    """Return a case as a vector. Raises :class:`CannotSayError` for what C has no way to say."""
    operation = case.request.get("op")
    if case.refusal == "bad_request":
        raise CannotSayError("a line that is no request")
    if operation == "encode":
        return _encode(vectors, case)
    if operation == "decode":
        return _decode(vectors, case)
    if operation == "stream":
        raise CannotSayError("a stream, which testees cut")
    raise CannotSayError("another operation of testees")


def _encode(vectors: Vectors, case: Case) -> VectorView:
    if case.refusal not in ("", "out_of_range", "unsupported"):
        raise CannotSayError(f"the refusal {case.refusal} on encode, which the compiler sees")
    content = _encoded(vectors, case)
    if case.refusal:
        return vectors.not_encoded(case.id, content, case.refusal)
    assert case.raw is not None
    if case.request.get("allow_dummy"):
        return vectors.carried(case.id, content, case.raw)
    return vectors.encoded(case.id, content, case.raw)


def _encoded(vectors: Vectors, case: Case) -> Content:
    """Return what a case encodes."""
    if any(case.request.get(key) for key in _FUNCTIONS):
        raise CannotSayError("a check of prefix bytes, which is a function of its own")
    form = case.request.get("form", case.layout.form if case.layout else "")
    return vectors.content({**case.request, "form": form})


def _decode(vectors: Vectors, case: Case) -> VectorView:
    raw = case.raw
    if raw is None:
        raise CannotSayError("bytes that are no hex")
    if case.refusal:
        return vectors.refused(case.id, raw, case.refusal, case.request)
    return vectors.decoded(case.id, _decoded(vectors, case), raw)


def _decoded(vectors: Vectors, case: Case) -> Content:
    """Return what a case decodes to."""
    return vectors.content(dict(case.answer))
