"""Requests without a pause between them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle, islice
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis, line_of
from stagewire_conformance.device.checks.ms2000.axis_check import SETTINGS_READ, requests_of
from stagewire_conformance.device.checks.ms2000.clean import Clean
from stagewire_conformance.device.checks.ms2000.harmless import END
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.lines.command_line import QUIET
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.places import Target
from stagewire_conformance.device.trial import Trial

_REQUESTS: Final = 200
_BURSTS: Final = 10
_BURST: Final = 8


def _claimed(declared: Declared) -> list[tuple[Target, Command]]:
    """Return what can be asked whom; all axes are asked one thing, then the next."""
    return [
        (place, request)
        for name, request in requests_of(declared).items()
        for place in declared.places
        if name in place.messages
    ]


KIND: Final = Kind(
    name="back-to-back",
    title="Requests without a pause are answered",
    rules=("no-blanks-in-replies", "commands-processed-at-colon"),
)


def _all(declared: Declared, allowed: Permissions) -> Iterator[Case]:
    yield Case(messages=[request.layout.message for _, request in _claimed(declared)])


@KIND.check(
    f"Each of {_REQUESTS} requests, sent as soon as the reply before is there, is answered",
    name="one-by-one",
    seconds=2.0,
    each=_all,
)
def _one_by_one(trial: Trial) -> None:
    first: dict[tuple[int, str], bytes] = {}
    for number, (place, request) in enumerate(
        islice(cycle(_claimed(trial.declared)), _REQUESTS), 1
    ):
        axis, name = Axis(trial, place), request.layout.message
        came = axis.ask(request, quiet=0.0, after=f"request {number} of {_REQUESTS}").pack()
        if name in SETTINGS_READ:
            was = first.setdefault((place.address, name), came)
            trial.must(
                came == was,
                f"request {number} of {_REQUESTS}, {name} of axis {place.name}, was answered otherwise than "
                "before, and nothing was set",
                wanted=was,
                came=came,
            )
    behind = line_of(trial).listen(QUIET)
    trial.must(not behind, f"{len(behind)} bytes came behind the last reply", came=behind)


@KIND.check(
    f"{_BURST} requests at once are answered by nothing but their replies",
    name="bursts",
    seconds=1.5,
    each=_all,
)
def _bursts(trial: Trial) -> None:
    """Several at once; the document, which says that a colon clears the buffers, promises nothing of it."""
    line, clean = line_of(trial), Clean(trial)
    requests = cycle(_claimed(trial.declared))
    missing = 0
    for _ in range(_BURSTS):
        due = 0
        for place, request in islice(requests, _BURST):
            line.send(request, place.address)
            assert request.reply is not None
            due += request.reply.layout.length
        came = line.collect(due, about="replies to all of them")
        trial.must(
            len(came) <= due,
            f"{_BURST} requests at once ask for {due} bytes, {len(came)} came",
            came=came,
        )
        missing += max(0, due - len(came))
    trial.info(
        f"of {_BURSTS} bursts of {_BURST} requests "
        + (f"{missing} bytes are missing" if missing else "all were answered"),
        missing_bytes=missing,
    )
    if missing:  # what was lost may have left half a request
        line.send_bytes(END, "ends what may be open")
        line.listen(QUIET)
    clean.again(f"after {_BURSTS} bursts of requests")
