"""``stagewire.open``: open a controller by its URL, without naming its class."""

from __future__ import annotations

import difflib
import re
from importlib import import_module

from stagewire._codec.protocol import usable_protocols
from stagewire._discovery.identification import can_identify, identify
from stagewire._discovery.ports import Port, port_of
from stagewire._discovery.products import (
    Known,
    by_identity,
    by_name,
    by_serial_number,
    card_of,
    every_unit,
)
from stagewire._discovery.search import ASK_TIMEOUT, Found, addresses_of, look_at, recognise
from stagewire._links.usb import number_in, usb_url
from stagewire.errors import BadValueError, TransportLostError, UnsupportedError, WrongUnitError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Unpack

    from stagewire._devices.options import OpenOptions
    from stagewire._framings.header.protocol import FramedProtocol


_VIRTUAL = re.compile(r"virtual://([^?#/]*)", re.IGNORECASE)
_LINK_OPTIONS = ("baudrate", "rtscts")


def open(
    url: str | None = None,
    unit: str | None = None,
    *,
    bay: int | None = None,
    **options: Unpack[OpenOptions],
) -> Any:
    """Open a controller and return its device, like ``TDC001.open(url, **options)`` of its class.

    The unit is given by ``unit``, by the name in ``virtual://NAME`` or by the serial number: that of
    ``serial_number=`` or of the USB port. If its prefix belongs to several units, or is unknown, the identity
    is requested from the controller (HW_REQ_INFO), which changes nothing. Only one address is asked. A rack
    is asked only if the serial number, ``unit`` or ``bay`` says that there is one. A controller
    newer than the document is opened as the unit whose messages it supports, if the registry names one, and
    uses its own scales (``model=``).

    :param url: a serial port, ``usb://SERIAL_NUMBER``, ``socket://HOST:PORT``, ``virtual://NAME`` or any
        other URL of a link. If it is left out, the USB port of ``serial_number=`` is opened.
    :param unit: name of the unit, such as ``TDC001``.
    :param bay: bay of a module in its rack, counted from 1.
    :param options: options of the class, such as ``stage=`` or ``travel_mm=``.

    Raise :class:`~stagewire.errors.BadValueError` for an unknown unit,
    :class:`~stagewire.errors.WrongUnitError` if the unit cannot be determined,
    :class:`~stagewire.errors.UnsupportedError` for a unit without a class, and the errors of ``open`` of the
    class.
    """
    if url is None:
        url = usb_url(options.get("serial_number"))
    name = unit or unit_at(url, bay=bay, **options)
    return device_class(name).open(url, bay=bay, **{**model_option(name), **options})


def model_option(name: str) -> dict[str, str]:
    """Return the option ``model=`` for a unit that is newer than the document; empty for other units."""
    known = known_by_name(name)
    return {} if known.documented else {"model": known.name}


def device_class(name: str) -> Any:
    """Return the class of a unit, or of the unit whose messages it supports; the name may be in any case.

    Raise :class:`~stagewire.errors.BadValueError` for an unknown unit, and
    :class:`~stagewire.errors.UnsupportedError` for a unit without a class.
    """
    known = known_by_name(name)
    if known.unit is None:
        raise UnsupportedError(str(known))
    package = known.protocol.package
    try:
        devices = import_module(f"{package}.devices")
    except ModuleNotFoundError as error:
        if error.name != f"{package}.devices":
            raise
        raise UnsupportedError(
            f"{known.unit}: the package {package} has no device classes; generate it again"
        ) from None
    return getattr(devices, known.unit)


def known_by_name(name: str) -> Known:
    """Return the unit with a name in any case; raise the errors of :func:`device_class`."""
    known = _by_any(name)
    if known is None:
        units = sorted(every_unit())
        near = difflib.get_close_matches(name.upper()[:80], units)
        meant = f"did you mean {' or '.join(near)}?" if near else f"choose {', '.join(units)}"
        raise BadValueError(f"unknown unit {name}; {meant}")
    return known


def virtual_unit(url: str) -> str | None:
    """Return the name of the unit in ``virtual://NAME``; None for any other URL."""
    virtual = _VIRTUAL.match(url)
    return virtual[1].upper() if virtual and _by_any(virtual[1]) is not None else None


def unit_at(url: str, **options: Any) -> str:
    """Return the name of the unit at a URL; see :func:`open`.

    Raise :class:`~stagewire.errors.WrongUnitError` if it cannot be determined.
    """
    if (name := virtual_unit(url)) is not None:
        return name
    number = options.get("serial_number") or number_in(url)
    found = _numbered(url, str(number)) if number else _plugged(url)
    if found.unit is None:
        found = _asked(found, **options)
    units = {known.unit for known in found.known}
    if found.unit is None and found.identity is not None and len(units) == 1 and None not in units:
        return str(units.pop())  # the device determines its scales
    if found.unit is None:
        advice = "give the name of its unit (unit='TDC001', or --unit TDC001 on the command line)"
        if found.bays:
            advice = (
                f"choose a bay with a module (bay= or --bay): {', '.join(map(str, found.bays))}"
            )
        raise WrongUnitError(f"{url}: {found.what}; {advice}")
    return found.unit


def _numbered(url: str, number: str) -> Found:
    """Return the units with a serial number; raise an error for that of a card."""
    named: list[Known] = []
    for protocol in usable_protocols():
        if (why := card_of(protocol, number)) is not None:
            raise WrongUnitError(f"{url}: {why}")
        named += by_serial_number(protocol, number)
    return Found(Port(url), tuple(named))


def _plugged(url: str) -> Found:
    """Return the units that the USB plug of a port shows."""
    port = port_of(url)
    return look_at(port) if port else Found(Port(url))


def _by_any(name: str) -> Known | None:
    """Return the unit with a name in any protocol, or None."""
    found = (by_name(protocol, name) for protocol in usable_protocols())
    return next((known for known in found if known is not None), None)


def _asked(found: Found, bay: int | None = None, **options: Any) -> Found:
    """Request the identity of the controller, or of the module in ``bay`` of a rack.

    Only one address is asked, because a request to a wrong one can freeze a controller: that of the known
    units, of the motherboard if there is a ``bay``, or else that of a controller with its own USB plug.
    """
    from stagewire._links.opening import open_link

    settings = {name: options[name] for name in _LINK_OPTIONS if name in options}
    link = open_link(found.url, **settings)
    try:
        for protocol in usable_protocols():
            if not can_identify(protocol):
                continue
            addresses = addresses_of(protocol, found.known)
            found = recognise(
                found, link, protocol, ASK_TIMEOUT, addresses[-1:] if bay else addresses[:1]
            )
            if found.unit is None and found.identity is not None and bay is not None:
                module, _ = identify(link, protocol, (_bay(protocol, bay),), ASK_TIMEOUT)
                known = (
                    by_identity(protocol, int(module.serial_number), module.model) if module else ()
                )
                return Found(found.port, tuple(known), module)
            if found.identity is not None:
                return found
    except TransportLostError as error:
        raise error.turned_away or error from None
    finally:
        link.close()
    raise WrongUnitError(
        f"{found.url}: {found.problem or 'no installed protocol has an identity request'}; give the name of "
        "its unit (unit='TDC001', or --unit TDC001 on the command line; a rack is asked only by its name or "
        "with bay=), or run stagewire doctor"
    )


def _bay(protocol: FramedProtocol, bay: int) -> int:
    first: int = protocol.registry()["addresses"]["bays"]["first"]
    return first + bay - 1
