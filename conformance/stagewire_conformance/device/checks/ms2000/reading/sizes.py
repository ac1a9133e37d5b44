"""The size slot of commands that read: there, left out, zero (section 2, group 3).

Three commands are without it, and the examples of two more leave it out. Whether any other may, the document
leaves open, and clients of both kinds exist: which form a controller understands is told, not judged. But
what it answers has to be the reply.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.axis_check import (
    AxisCase,
    axis_check,
    first_place,
    requests_of,
)
from stagewire_conformance.device.checks.ms2000.clean import Clean
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.permissions import Permissions

_WAIT: Final = 0.2
"""Seconds in which an answer would have come."""


KIND: Final = Kind(
    name="sizes",
    title="A request in its other form, with or without its size, is answered rightly or ignored",
    rules=("size-omitted-by-three", "size-of-data", "errors-ignored"),
)


def _requests(declared: Declared, allowed: Permissions) -> Iterator[AxisCase]:
    for name, request in requests_of(declared).items():
        yield AxisCase(
            place=first_place(declared, name),
            name=name,
            words={
                "request": name,
                "form": "with the size 0" if request.layout.size is None else "without its size",
            },
            arguments={"request": request},
            messages=(name,),
        )


@axis_check(
    KIND, "{request} {form} is answered by the reply, or not at all", seconds=0.4, each=_requests
)
def _look(axis: Axis, request: Command) -> None:
    clean = Clean(axis.trial)
    name = request.layout.message
    usual = request.layout.size is not None
    form = "without its size" if usual else "with the size 0"
    came = axis.line.ask(request, axis.address, _WAIT, sized=not usual)
    if not came:
        axis.trial.info(f"{name} {form} is ignored")
    else:
        axis.exact(request, came, f"sent {form}")
        axis.trial.info(f"{name} {form} is understood")
    clean.again(f"after {name} {form}")
