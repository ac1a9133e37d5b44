"""Checks of the identity of a controller (pages 7, 21 and 22), and of a command without a reply.

The command must be carried out without acknowledgement (pages 11 and 16).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.clean import clean, identity_of
from stagewire_conformance.device.checks.apt.replies import (
    Request,
    ask_all,
    judge_answer,
    requests_of,
    with_value,
)
from stagewire_conformance.device.checks.apt.streams import unstopped
from stagewire_conformance.device.checks.apt.undocumented import is_readable
from stagewire_conformance.device.checks.apt.wording import described, raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_DIGITS: Final = 8
"""Digits of a serial number; the first two are the prefix (Issue 3, pages 7 and 22)."""

_AFTER_THE_PREFIX: Final = 6
"""Digits after the prefix. Units of Issue 37 with a prefix of three digits have nine digits in all."""

_MOTHERBOARD: Final = "MULTI_CHANNEL_MOTHERBOARD"
"""The hardware type of a motherboard (page 22)."""


IDENTIFICATION = Kind(
    name="identification",
    title="The controller identifies itself",
    rules=(
        "info-answer",
        "info-length",
        "info-serial-number",
        "info-model",
        "info-type",
        "info-version-unused",
        "info-notes",
        "info-channels",
        "serial-number-eight-digits",
        "serial-number-prefix",
    ),
)


def _identified_places(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        for request in requests_of(declared, place):
            if request.name in identity_of(declared):
                yield Case(
                    name=place.name,
                    arguments={"request": request},
                    messages=request.messages,
                    skip=request.skip,
                )


@IDENTIFICATION.check(
    "{request.place.name} identifies itself twice with the same reply", each=_identified_places
)
def _identify_twice(trial: Trial, request: Request) -> None:
    address = request.place.address
    first = judge_answer(trial, request, ask_all(trial, request))
    if first is None:
        if request.place.is_motherboard:
            trial.info("for bays without a motherboard, state motherboard = false in a PICS")
        return
    _judge_serial_number(trial, request.place, first)
    _judge_texts(trial, first)
    _judge_hardware(trial, request.place, first)
    again: Incoming = trial.reply(request.message, address)
    trial.must(
        again.message == first.message,
        f"{request.about} was answered with two different replies in a row; the identity of "
        "a unit does not change",
        wanted=first.raw,
        came=again.raw,
        rule="info-answer",
        cause=Cause(first.name, "values"),
    )


def _judge_serial_number(trial: Trial, place: Target, heard: Incoming) -> None:
    """Check for eight digits. Units that are newer than the document are known to have nine."""
    number = heard.message.serial_number
    digits = str(number)
    if not trial.must(
        number > 0 and len(digits) in (_DIGITS, _DIGITS + 1),
        f"{heard.name}: the serial number is {number}; it should have {_DIGITS} digits, and the "
        "first two give the type of the controller",
        came=heard.raw,
        rule="info-serial-number",
    ):
        return
    unit = place.unit
    due = {len(str(prefix)) + _AFTER_THE_PREFIX for prefix in unit.prefixes} or {_DIGITS}
    trial.should(
        len(digits) in {_DIGITS, *due},
        f"{heard.name}: the serial number {number} has {len(digits)} digits; the document "
        f"states {_DIGITS}",
        came=heard.raw,
        rule="serial-number-eight-digits",
    )
    if place.is_motherboard and unit.kind == "bay":
        return  # a rack of modules has its own serial number, and no documented prefix
    prefix = unit.card_usb_prefix if place.bay else unit.usb_prefix
    if prefix is not None and len(digits) == _DIGITS:
        trial.should(
            digits.startswith(str(prefix)),
            f"{heard.name}: the serial number {number} begins with {digits[:2]}; the serial "
            f"number of a {unit.name}{' card' if place.bay else ''} should begin with {prefix}",
            came=heard.raw,
            rule="serial-number-prefix",
        )


def _judge_texts(trial: Trial, heard: Incoming) -> None:
    """Check that texts are readable up to their first NUL."""
    model, notes = heard.message.model_number, heard.message.notes
    trial.must(
        is_readable(model) and bool(model.partition("\0")[0].strip()),
        f"{heard.name}: the model number is {model!r}; it should be letters and digits",
        came=heard.raw,
        rule="info-model",
    )
    trial.must(
        is_readable(notes),
        f"{heard.name}: the notes are {notes!r}; they should be text",
        came=heard.raw,
        rule="info-notes",
    )


def _judge_hardware(trial: Trial, place: Target, heard: Incoming) -> None:
    message = heard.message
    fields = trial.declared.registry.fields(heard.name, message.layout.form)
    motherboard = fields["type"]["enum"][_MOTHERBOARD]
    trial.must(
        (message.type == motherboard) == place.is_motherboard,
        f"{heard.name}: the hardware type is {message.type}; {place.name} "
        f"{'is' if place.is_motherboard else 'is not'} a motherboard, which has the type "
        f"{motherboard}",
        came=heard.raw,
        rule="info-type",
        cause=Cause(heard.name, "type"),
    )
    version = message.software_version
    trial.should(
        version[-1] == 0,
        f"{heard.name}: the last byte of the software version is {version[-1]:#04x}; it is "
        "unused and should be 0",
        came=heard.raw,
        rule="info-version-unused",
    )
    if not place.is_motherboard:  # the document does not define the channels of a motherboard
        channels = len(place.channels)
        trial.must(
            message.nchs == channels,
            f"{heard.name}: the number of channels is {message.nchs}; {place.unit.name} "
            f"{f'in bay {place.bay} ' if place.bay else ''}should have {channels}",
            wanted=with_value(heard, "nchs", channels),
            came=heard.raw,
            rule="info-channels",
        )


_IDENTIFY: Final = "MOD_IDENTIFY"
_SILENCE: Final = 0.1


IDENTIFY = Kind(
    name="identify",
    title="A command is carried out without acknowledgement",
    rules=("command-without-acknowledgement",),
)


def _flashing_places(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        if _IDENTIFY in place.listed:
            yield Case(
                name=place.name,
                arguments={"place": place},
                skip=place.why_not(_IDENTIFY),
            )


@IDENTIFY.check(
    "{place.name} accepts the command to flash its front panel, and sends nothing",
    messages=(_IDENTIFY,),
    seconds=0.15,
    each=_flashing_places,
)
def _flash(trial: Trial, place: Target) -> None:
    channel = 1 if place.is_motherboard else None  # Issue 37, page 46: it flashes a channel
    trial.line.send(trial.declared.make(_IDENTIFY, channel), place.address)
    came = trial.line.listen(_SILENCE)
    trial.must(
        not came,
        f"{_IDENTIFY} to {place.name} was answered with {described(trial, came)}; it should be "
        "carried out without acknowledgement",
        came=raw_of(came),
        rule="command-without-acknowledgement",
        because=unstopped(trial.declared),
    )
    clean(trial, f"after {_IDENTIFY}", place)
