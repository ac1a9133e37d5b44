"""Options and functions to open a controller, and its parts: bays, channels or axes."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from typing import Annotated, Any

import typer

from stagewire.errors import (
    EncodeError,
    UnknownScaleError,
    UnsupportedError,
)
from stagewire_cli.advice import warnings_printed
from stagewire_cli.completion import units, urls
from stagewire_cli.errors import CalledWronglyError


def _address(text: str | int) -> int:
    """Parse an address; raise :class:`typer.BadParameter` if it is invalid."""
    try:
        address = int(str(text), 0)
    except ValueError:
        address = -1
    if not 0 < address < 0x80:
        raise typer.BadParameter(f"expected a number from 1 to 0x7f, such as 0x11, not {text!r}")
    return address


LinkUrl = Annotated[
    str,
    typer.Argument(
        metavar="URL",
        help="A port, socket://HOST:PORT, virtual://NAME or another URL.",
        autocompletion=urls,
    ),
]
Unit = Annotated[
    str | None,
    typer.Option(
        "--unit",
        metavar="NAME",
        help="Name of the unit, such as TDC001.  [default: detected]",
        autocompletion=units,
    ),
]
Address = Annotated[
    int | None,
    typer.Option(
        "--address",
        parser=_address,
        metavar="NUMBER",
        help="Address of the controller, such as 0x11.  [default: that of its unit]",
    ),
]
Bay = Annotated[
    int | None,
    typer.Option("--bay", min=1, help="Bay of a rack, from 1 (address 0x21)."),
]
ScaleSource = Annotated[
    str | None,
    typer.Option(
        "--scale-source",
        metavar="NAME",
        help="Source of scales on which sources disagree, such as vendor.",
    ),
]


def travel_options(text: str | None) -> dict[str, object]:
    """Return the option of ``open`` for a travel in mm or degrees.

    Raises :class:`CalledWronglyError` if it is invalid.
    """
    if text is None:
        return {}
    unit = "deg" if text.endswith("deg") else "mm"
    try:
        ends = tuple(float(end.strip().removesuffix(unit)) for end in text.split(","))
    except ValueError:
        ends = ()
    if len(ends) not in (1, 2) or not all(map(math.isfinite, ends)):
        raise CalledWronglyError(
            "--travel must be a length such as 12 (mm) or 90deg, or two ends such as -5,5 or -8,8deg, "
            f"not {text!r}"
        )
    return {f"travel_{unit}": ends[0] if len(ends) == 1 else ends}


def seconds_above_0(text: str | float) -> float:
    """Parse a time; raise :class:`typer.BadParameter` if it is invalid."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 < seconds < math.inf:
        raise typer.BadParameter(f"expected a number of seconds above 0, not {text!r}")
    return seconds


@contextmanager
def called_wrongly() -> Iterator[None]:
    """Turn errors of the library about arguments into :class:`CalledWronglyError`."""
    try:
        yield
    except UnknownScaleError as error:
        said = str(error).removesuffix(f"; use {error.instead}=")
        raise CalledWronglyError(f"{said}; use {_way_out(error)}") from None
    except (EncodeError, UnsupportedError) as error:
        raise CalledWronglyError(str(error)) from None


_INSTEAD = {
    "mm": "a number such as 1.5",
    "deg": "a number with its unit, such as 30deg",
    "travel_mm": "--travel LOW,HIGH",
    "travel_deg": "--travel LOW,HIGHdeg",
}
"""Keywords of the library -> how to say them on the command line."""


def _way_out(error: UnknownScaleError) -> str:
    """Return the options that make a scale known."""
    if error.sources:
        return " or ".join(f"--scale-source {source}" for source in error.sources)
    return _INSTEAD.get(error.instead, "--unit, --stage or --counts")


@contextmanager
def opened(
    url: str,
    unit: str | None,
    *,
    bay: int | None = None,
    keeps_outputs: bool = True,
    refusals: bool = True,
    **options: Any,
) -> Iterator[Any]:
    """Open a controller for a block, ready for commands.

    :param unit: its name; None detects it.
    :param bay: its bay in the rack, if it is a module.
    :param keeps_outputs: whether a laser or heater that is on stays on; only a stop switches it off.
    :param refusals: whether to warn of motions that the controller cannot carry out now.
    :param options: options of its class; None means not given.

    Raises :class:`CalledWronglyError` for an unknown unit or stage, and
    :class:`~stagewire.errors.StagewireError` for a line that cannot be opened.
    """
    from stagewire.discovery import device_class, model_option, unit_at

    given = {name: value for name, value in options.items() if value is not None}
    with warnings_printed(refusals=refusals):
        with called_wrongly():
            name = unit or unit_at(url, bay=bay)
            device_type, given = device_class(name), {**model_option(name), **given}
            if bay is not None and device_type.unit.kind == "bay":
                given["bay"] = bay
            if keeps_outputs and device_type.unit.safe_state:
                given["on_close"] = "leave"
            device = device_type.open(url, **given)
        with device, device.low_level() if hasattr(device, "low_level") else nullcontext():
            yield device


def parts_of(device: Any) -> dict[str, Any]:
    """Return the parts of a controller that move independently, by name.

    The only part of a controller has an empty name.
    """
    unit = device.unit
    if unit.kind == "line":
        return {f"axis {name}": device.axis(name) for name in device.facts.protocol.axes}
    places = (
        {f"bay {n}": bay for n, bay in enumerate(device.bays, 1)}
        if unit.kind == "rack"
        else {"": device}
    )
    if unit.channels == 1:
        return places
    return {
        f"{name} channel {number}".strip(): channel
        for name, place in places.items()
        for number, channel in enumerate(place.channels, 1)
    }


def title_of(device: Any) -> str:
    """Return one line that identifies a controller."""
    number = device.serial_number
    name = device.scales.controller
    return f"{name}, serial number {number}" if number else name


def keywords(method: Any) -> Mapping[str, inspect.Parameter]:
    """Return the parameters of a method by name."""
    return inspect.signature(method).parameters
