"""The size byte of commands that read: present, omitted, zero (section 2, group 3).

Three commands have no size, and the examples of two more omit it. The document does not say whether other
commands may omit it, and clients of both kinds exist. So the report states which forms a controller accepts,
without judging them. But any reply must be the right one.

Requests with a wrong size are also sent (section 2, group 3).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis, Clean
from stagewire_conformance.device.checks.ms2000.axis_check import (
    AxisCase,
    axis_check,
    first_place,
    requests_of,
)
from stagewire_conformance.device.checks.ms2000.harmless import END, HARMLESS
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Permissions
from stagewire_ms2000 import messages as m

_FORM_WAIT: Final = 0.2
"""Seconds in which a reply would arrive."""


SIZES: Final = Kind(
    name="sizes",
    title="A request in its other form, with or without its size, is answered correctly or ignored",
    rules=("size-omitted-by-three", "size-of-data", "errors-ignored"),
)


def _requests_in_both_forms(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    for name, request in requests_of(declared).items():
        yield AxisCase(
            place=first_place(declared, name),
            name=name,
            words={
                "form": "with the size 0" if request.layout.size is None else "without its size",
            },
            arguments={"request": request},
            messages=(name,),
        )


@axis_check(
    SIZES,
    "{request.layout.message} {form} is answered with its reply, or ignored",
    seconds=0.25,
    each=_requests_in_both_forms,
)
def _sizes(axis: Axis, request: Command) -> None:
    clean = Clean(axis.trial)
    name = request.layout.message
    usual = request.layout.size is not None
    form = "without its size" if usual else "with the size 0"
    came = axis.line.ask(request, axis.address, _FORM_WAIT, sized=not usual)
    if not came:
        axis.trial.info(f"{name} {form} is ignored")
    else:
        axis.exact(request, came, f"sent {form}")
        axis.trial.info(f"{name} {form} is accepted")
    clean.again(f"after {name} {form}")


_ERROR_WAIT: Final = 0.1
"""Seconds in which a reply would arrive."""
_SUPPORTED: Final = range(7)
"""Sizes that are supported up to firmware 3.3."""
_LARGE: Final = range(7, 0x100)
"""Sizes that are not supported."""
_EXAMPLES: Final = {m.ReadMotorPositionAndStatus.layout.message: (3,)}
"""The sizes in examples that differ from the table."""


def _wrong_sizes(axis: Axis, request: Command) -> list[int]:
    """Return some wrong sizes: one that is supported, one that is not, and that of an example.

    None is a command byte or a terminator.
    """
    own, draw = request.layout.size, axis.trial.random
    small = draw.choice([size for size in _SUPPORTED if size != own])
    example = _EXAMPLES.get(request.layout.message, ())
    return sorted({small, draw.choice([size for size in _LARGE if size in HARMLESS]), *example})


WRONG_SIZE: Final = Kind(
    name="wrong-size",
    title="A request with a wrong size is ignored",
    rules=("size-of-data", "sizes-supported", "errors-ignored"),
)


def _requests_with_a_size(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    for name, request in requests_of(declared).items():
        if request.layout.size is not None:
            yield AxisCase(
                place=first_place(declared, name),
                name=name,
                arguments={"request": request},
                messages=(name,),
            )


@axis_check(
    WRONG_SIZE,
    "{request.layout.message} with a wrong size is ignored",
    seconds=0.6,
    each=_requests_with_a_size,
)
def _wrong_size(axis: Axis, request: Command) -> None:
    trial, name, clean = axis.trial, request.layout.message, Clean(axis.trial)
    assert request.reply is not None
    due = request.reply.layout.length
    for size in _wrong_sizes(axis, request):
        about = f"{name} of axis {axis.name} with the size {size} instead of {request.layout.size}"
        axis.line.send_bytes(bytes((axis.address, request.layout.id, size)) + END, about)
        came = axis.line.collect(1, _ERROR_WAIT)
        if size in _EXAMPLES.get(name, ()):
            trial.info(f"{about}, as in its example, is {'answered' if came else 'ignored'}")
            trial.must(
                len(came) in (0, due),
                f"{about} was answered with {len(came)} bytes; the reply should have {due}",
                came=came,
                rule="size-of-data",
                cause=Cause("wrong sizes", "answered"),
            )
        elif len(came) == due:
            trial.should(
                False,
                f"{about} was answered; a command with an error should be ignored",
                wanted=b"",
                came=came,
                rule="errors-ignored",
                cause=Cause("wrong sizes", "accepted"),
            )
        else:
            trial.must(
                not came,
                f"{about} was answered with {len(came)} bytes; a command with an error "
                "should be ignored",
                came=came,
                rule="errors-ignored",
                cause=Cause("wrong sizes", "answered"),
            )
        clean.again(f"after {about}")
