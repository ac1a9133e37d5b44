"""How soon requests are answered, with the lateness of the computer itself beside it.

The document has no bound; a vendor may promise one in the PICS.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.clean import clean_request
from stagewire_conformance.device.checks.apt.requests import Request
from stagewire_conformance.device.lines.line import jitter_of, percentile

if TYPE_CHECKING:
    from stagewire_conformance.device.declared import Declared
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_REQUESTS: Final = 100
"""Of each place; fewer do not tell the one that is late of a hundred."""


KIND = Kind(
    name="timing",
    title="Requests are answered as soon as the PICS promises",
    rules=(),  # the document has none,
)


def _places(declared: Declared, allowed: Permissions) -> Iterator[Case]:
    found = [clean_request(declared, place) for place in declared.places]
    requests = [request for request in found if request is not None]
    if requests:
        yield Case(
            arguments={"requests": requests},
            messages=[name for each in requests for name in each.messages],
            seconds=1.0 + len(requests),
        )


@KIND.check(
    "Requests are answered as soon as the PICS promises, where it does", name="reply", each=_places
)
def _run(trial: Trial, requests: Sequence[Request]) -> None:
    """Measure each place, and hold the slowest to what is promised."""
    jitter = jitter_of(trial.line)
    took = {request.about: _measure(trial, request) for request in requests}
    slowest = max(took, key=lambda about: percentile(took[about], 99))
    median, late = percentile(took[slowest], 50), percentile(took[slowest], 99)
    trial.figures |= {
        "p50_ms": round(median * 1e3, 3),
        "p99_ms": round(late * 1e3, 3),
        "jitter_ms": round(jitter.late * 1e3, 3),
    }
    said = (
        f"{slowest} was answered within {late * 1e3:.2f} ms (99 of 100 times; half of them within "
        f"{median * 1e3:.2f} ms)"
    )
    promised = trial.declared.pics.timing.reply_p99_ms
    if promised is None:
        trial.inconclusive(f"{said}; {jitter}. The PICS promises nothing (reply_p99_ms)")
    elif jitter.blurs(promised / 1e3):
        trial.inconclusive(
            f"{said}; {jitter}, which is too late to tell whether {promised:g} ms are kept"
        )
    else:
        trial.info(f"{said}; {jitter}")
        trial.must(late <= promised / 1e3, f"{said}; the PICS promises {promised:g} ms")


def _measure(trial: Trial, request: Request) -> list[float]:
    """Return how long each of many answers took, in seconds."""
    took = []
    for _ in range(_REQUESTS):
        began = trial.line.now
        reply = trial.reply(request.message, request.place.address)
        took.append(reply.time - began)
    return took
