"""Diagnosis: why no controller is found, and how to fix it.

A problem of the computer is a missing port, permission or driver. A problem of a line is that it cannot be
opened, that no controller answers, or that the baud rate is wrong.
"""

from __future__ import annotations

import enum
import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass

from stagewire._codec.protocol import usable_protocols
from stagewire._discovery import ports as system
from stagewire._discovery.identification import can_identify
from stagewire._discovery.opening import device_class, known_by_name, virtual_unit
from stagewire._discovery.ports import Port, port_of
from stagewire._discovery.products import Known
from stagewire._discovery.search import ASK_TIMEOUT, NO_FRAME, Found, discover, look_at, recognise
from stagewire._links.serial_port import permission_advice
from stagewire.errors import StagewireError, TransportError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from stagewire._framings.header.protocol import FramedProtocol


class Verdict(enum.Enum):
    """The severity of a diagnosis."""

    FINE = "fine"
    NOTE = "note"
    WRONG = "wrong"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """One finding about a port, a line or a controller.

    :param verdict: severity.
    :param about: subject, such as a port or a URL.
    :param text: finding.
    :param advice: what to do; empty if nothing needs to be done.
    """

    verdict: Verdict
    about: str
    text: str
    advice: str = ""


_RATELESS = ("socket://", "virtual://", "loop://")
_OTHER_RATE_TIMEOUT = 0.5
_SILENCE = (
    "check that it is switched on, that its front panel is not in a menu, and that no other program uses "
    "the port; unplug the USB cable and plug it in again; for RS-232, use the cable that the manual of the "
    "controller describes (crossed or straight)"
)
_GARBAGE = (
    "a device is connected but uses another protocol or baud rate: check that this is the port of the "
    "controller, and that the line has its baud rate"
)


def diagnose_line(url: str, unit: str | None = None) -> list[Diagnosis]:
    """Open a line, identify the controller, and return the result; without an answer, try other baud rates.

    Only requests are sent, and nothing moves. However, a controller of commands is switched to its low-level
    format, and to lines of text afterwards.

    :param url: URL or port, such as ``/dev/ttyUSB0`` or ``socket://10.0.0.5:4001``.
    :param unit: name of the expected unit.

    Raise :class:`~stagewire.errors.BadValueError` for an unknown unit.
    """
    unit = unit or virtual_unit(url)
    known = None if unit is None else known_by_name(unit)
    try:
        port = port_of(url)
    except TransportError as error:
        return [_failed(url, error)]
    found = look_at(port) if port else Found(Port(url))
    if known is not None and not can_identify(known.protocol):
        return _commands(url, known)
    return [
        _framed(Found(found.port, (known,) if known else found.known), protocol)
        for protocol in ([known.protocol] if known else usable_protocols())
        if can_identify(protocol)
    ]


def _framed(found: Found, protocol: FramedProtocol) -> Diagnosis:
    """Diagnose the line to a controller whose protocol has an identity request."""
    first = _asked(found, protocol, None, ASK_TIMEOUT)
    if isinstance(first, Diagnosis):
        return first
    if first.identity is None and not found.url.startswith(_RATELESS):
        for rate in _rates():
            other = _asked(found, protocol, rate, _OTHER_RATE_TIMEOUT)
            if isinstance(other, Found) and other.identity is not None:
                return Diagnosis(
                    Verdict.WRONG,
                    found.url,
                    f"wrong baud rate: the controller answers at {rate} baud: {other.what}",
                    f"open it with baudrate={rate}, or set the line to the documented rate",
                )
    wanted = found.unit
    possible = {known.name for known in first.known}
    if first.identity is not None and wanted is not None and wanted not in possible:
        return Diagnosis(
            Verdict.WRONG,
            found.url,
            f"the wrong unit answers: {first.what}; expected {wanted}",
            "use the name of this unit, or the port of the expected one; `stagewire list` shows all ports",
        )
    return _heard(first)


def _heard(found: Found) -> Diagnosis:
    """Return the diagnosis for a controller after its identity request."""
    if found.identity is None:
        return Diagnosis(
            Verdict.WRONG,
            found.url,
            found.problem,
            (_GARBAGE if NO_FRAME in found.problem else _SILENCE)
            + ("" if found.known else _unasked_units()),
        )
    told = f"{found.what}; serial number {found.serial_number}, firmware {found.identity.firmware}"
    if found.bays is not None:
        listed = ", ".join(map(str, found.bays)) or "none"
        told += f"; bays with a module: {listed}"
    if found.known and all(one.unit is None for one in found.known):
        return Diagnosis(
            Verdict.WRONG,
            found.url,
            f"answers: {told}",
            "stagewire has no class for it; use sessions and messages, or the software of the vendor",
        )
    return Diagnosis(Verdict.FINE, found.url, f"answers: {told}", _next_step(found))


def _next_step(found: Found) -> str:
    """Return how to use a controller: the class to import, and a command; empty if the unit is unknown."""
    unit = found.unit or next((known.unit for known in found.known if known.unit), None)
    if unit is None:
        return ""
    return _use(known_by_name(unit), found.url, f" --unit {unit}" if found.unit is None else "")


def _use(known: Known, url: str, options: str = "") -> str:
    """Return how to use a unit at a URL."""
    quoted = f'"{url}"' if set(url) & set("?*&#") else url
    package, name = known.protocol.package, known.unit
    return f"from {package} import {name}; next: stagewire monitor {quoted}{options}"


def _unasked_units() -> str:
    """Return advice on units that are only asked by name, because nothing is sent to an unknown device."""
    names = sorted(
        facts["name"]
        for protocol in usable_protocols()
        if not can_identify(protocol)
        for facts in protocol.registry().get("units", ())
    )
    listed = " or ".join(f"--unit {name}" for name in names)
    return f"; if it is one of the units that are only asked by name, add {listed}" if names else ""


def _asked(
    found: Found, protocol: FramedProtocol, rate: int | None, timeout: float
) -> Found | Diagnosis:
    """Return the answer at a baud rate (None: that of the line), or why the line cannot be opened."""
    from stagewire._links.opening import open_link

    try:
        link = open_link(found.url, **({} if rate is None else {"baudrate": rate}))
        try:
            return recognise(found, link, protocol, timeout)
        finally:
            link.close()
    except TransportError as error:
        return _failed(found.url, error)


def _commands(url: str, known: Known) -> list[Diagnosis]:
    """Diagnose the line to a controller whose commands have no frame, at each of its baud rates."""
    device = device_class(known.name)
    rates = _rates([known])
    for rate in (None,) if url.startswith(_RATELESS) else rates:
        try:
            with device.open(url, **({} if rate is None else {"baudrate": rate})) as opened:
                said = _identification(opened)
        except TransportError as error:
            return [_failed(url, error)]
        except StagewireError:  # no reply, or an invalid one
            continue
        at = "" if rate is None else f" at {rate} baud: open it with baudrate={rate}"
        return [
            Diagnosis(
                Verdict.FINE,
                url,
                f"answers: {known.name}, axis {said}{at}",
                _use(known, url, f" --unit {known.name}"),
            )
        ]
    tried = ", ".join(map(str, rates))
    return [
        Diagnosis(
            Verdict.WRONG,
            url,
            f"no {known.name} answers in its low-level format (tried: {tried} baud)",
            "check that it is switched on, and which baud rate its switches select; if it is in its "
            "high-level format, which expects lines of text, switch it to the low-level format first",
        )
    ]


def _identification(device: Any) -> str:
    """Return the identification of the first axis, read in the low-level format."""
    axis = next(iter(device.facts.protocol.axes))
    with device.low_level():
        said = device.axis(axis).read_identification(timeout=_OTHER_RATE_TIMEOUT)
    return f"{axis}: {said.identification.rstrip(' :')}"


def _failed(url: str, error: TransportError) -> Diagnosis:
    """Return the diagnosis for a line that cannot be used; the error itself says what to do."""
    return Diagnosis(Verdict.WRONG, url, str(error).removeprefix(url).lstrip(": "))


def _rates(known: Iterable[Known] = ()) -> list[int]:
    """Return the baud rates in the registries for these units, or for all units."""
    units = [one.facts for one in known] or [
        facts for protocol in usable_protocols() for facts in protocol.registry().get("units", ())
    ]
    return sorted({rate for facts in units if facts for rate in _values(facts.get("baud_rates"))})


def _values(rates: object) -> list[int]:
    return list(rates["values"]) if isinstance(rates, dict) else []


def diagnose_computer(ask: bool = False) -> list[Diagnosis]:
    """Diagnose all ports, and controllers without a port.

    :param ask: open the ports that are controllers by their USB ids, and request their identity.
    """
    found = discover()
    told = [*map(_port, found), *_without_port(found)]
    if not any(one.is_controller for one in found) and not _wrong(told):
        told.append(_nothing())
    if ask:
        asked = [one.url for one in found if one.port.plug and _may_open(one.url)]
        told += [told for url in asked for told in diagnose_line(url)]
    return told


def _port(found: Found) -> Diagnosis:
    """Return what a port is, and whether this user may open it."""
    if not found.is_controller:
        return Diagnosis(
            Verdict.NOTE,
            found.url,
            found.what,
            f"if it is a controller, run: stagewire doctor {found.url}",
        )
    if not _may_open(found.url):
        return Diagnosis(
            Verdict.WRONG,
            found.url,
            f"{found.what}; permission denied for this user",
            permission_advice(found.url),
        )
    return Diagnosis(Verdict.FINE, found.url, found.what, _next_step(found))


def _may_open(device: str) -> bool:
    """Return whether this user may open a port; True on systems without such permissions."""
    return not os.path.exists(device) or os.access(device, os.R_OK | os.W_OK)


def _without_port(found: Iterable[Found]) -> list[Diagnosis]:
    """Return diagnoses for the controllers on USB that have no serial port."""
    ports = [one.port for one in found]
    lacking = [_windows(number) for number in system.without_port(system.present(), ports)]
    if sys.platform.startswith("linux"):
        lacking += [_linux(device) for device in system.usb_devices() if not device.has_port]
    return lacking


def _windows(serial_number: str) -> Diagnosis:
    return Diagnosis(
        Verdict.WRONG,
        f"controller {serial_number}",
        "plugged in, but its driver does not create a COM port",
        "in the Device Manager, under “Universal Serial Bus controllers”, open the properties of the "
        "device (“APT USB Device” or “USB Serial Converter”), tick “Load VCP” on the page “Advanced”, "
        "and plug the controller in again; a COM port then appears under “Ports (COM & LPT)”",
    )


def _linux(device: system.UsbDevice) -> Diagnosis:
    about = f"controller {device.serial_number or 'without a serial number'}"
    vid, pid = f"{device.plug.vid:04x}", f"{device.pid:04x}"
    if device.driver == "usbfs":
        return Diagnosis(
            Verdict.WRONG,
            about,
            "plugged in, but a program controls its USB chip directly, so it has no serial port",
            "close the program that uses libftdi or the D2XX library, and plug the controller in again",
        )
    if device.driver:
        return Diagnosis(
            Verdict.WRONG,
            about,
            f"plugged in, but the driver {device.driver} has not created a serial port for it",
            "plug it in again; if that does not help, check the output of dmesg",
        )
    return Diagnosis(
        Verdict.WRONG,
        about,
        f"plugged in ({vid}:{pid}), but no driver is bound to it, so it has no serial port",
        f"run sudo modprobe ftdi_sio; if that is not enough, run "
        f"echo {vid} {pid} | sudo tee /sys/bus/usb-serial/drivers/ftdi_sio/new_id",
    )


def _nothing() -> Diagnosis:
    """Return the diagnosis that no controller was found, and where to look on this system."""
    where = {
        "linux": "lsusb lists the connected devices, and dmesg shows why one was rejected; a container or a "
        "virtual machine needs the device passed through",
        "win32": "the Device Manager shows it under “Universal Serial Bus controllers” or “Other devices”; "
        "if it has no driver, install the VCP driver of FTDI, and tick “Load VCP” in its properties",
        "darwin": "System Information lists it under USB; if /dev/cu.usbserial… is missing, install FTDI's "
        "VCP driver and allow it under Privacy & Security",
    }
    return Diagnosis(
        Verdict.WRONG,
        "USB",
        "no controller found",
        "check that it is switched on and that the USB cable carries data; "
        + where.get(sys.platform, "check whether the system lists it as a USB device"),
    )


def _wrong(told: Iterable[Diagnosis]) -> bool:
    return any(one.verdict is Verdict.WRONG for one in told)
