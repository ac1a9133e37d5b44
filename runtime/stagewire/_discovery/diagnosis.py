"""Why no controller is found: problems of this computer, and of one line, each with what to do about it.

On the computer: no port, no permission, no driver. On a line: it cannot be opened, no controller answers, or
the baud rate is another one.
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
from stagewire._discovery.opening import device_class, known_by_name
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
    """How grave a diagnosis is."""

    FINE = "fine"
    NOTE = "note"
    WRONG = "wrong"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """One thing that was looked at.

    :param verdict: how grave it is.
    :param about: a port, a URL, or what else it is about.
    :param text: what is so.
    :param advice: what to do; empty where nothing is to be done.
    """

    verdict: Verdict
    about: str
    text: str
    advice: str = ""


_RATELESS = ("socket://", "virtual://", "loop://")
_OTHER_RATE_TIMEOUT = 0.5
_SILENCE = (
    "see that it is switched on, that its own panel is not in a menu, and that no other program has the "
    "port; unplug the USB cable and plug it in again; a controller on RS-232 needs its cable crossed as its "
    "manual says"
)
_GARBAGE = (
    "something is there, and speaks otherwise: see that this is the port of the controller, and that the "
    "line has its baud rate"
)


def diagnose_line(url: str, unit: str | None = None) -> list[Diagnosis]:
    """Open a line, ask who is there, and say what came of it; where nobody answers, at other rates, too.

    Only questions are sent, and nothing moves; but a controller of commands is brought to take them, and
    lines of text afterwards.

    :param url: what a link opens, such as ``/dev/ttyUSB0`` or ``socket://10.0.0.5:4001``.
    :param unit: name of the unit that should be there.

    Raises :class:`~stagewire.errors.BadValueError` for a name that no unit has.
    """
    known = None if unit is None else known_by_name(unit)
    port = port_of(url)
    found = look_at(port) if port else Found(Port(url))
    if known is not None and not can_identify(known.protocol):
        return _commands(url, known)
    return [
        _framed(Found(found.port, (known,) if known else found.known), protocol)
        for protocol in ([known.protocol] if known else usable_protocols())
        if can_identify(protocol)
    ]


def _framed(found: Found, protocol: FramedProtocol) -> Diagnosis:
    """Ask a controller whose protocol has a question for it."""
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
                    f"wrong baud rate: at {rate} it answers: {other.what}",
                    f"open it with baudrate={rate}, or set the line to the rate of the document",
                )
    wanted = found.unit
    possible = {known.name for known in first.known}
    if first.identity is not None and wanted is not None and wanted not in possible:
        return Diagnosis(
            Verdict.WRONG,
            found.url,
            f"another unit answers: {first.what}; expected was {wanted}",
            "name the unit that is there, or the port of the one that is meant: stagewire list",
        )
    return _heard(first)


def _heard(found: Found) -> Diagnosis:
    """Say what came of asking a controller."""
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
    return Diagnosis(Verdict.FINE, found.url, f"answers: {told}")


def _unasked_units() -> str:
    """Name the units that are not asked unless somebody names them: nothing is sent on suspicion."""
    names = sorted(
        facts["name"]
        for protocol in usable_protocols()
        if not can_identify(protocol)
        for facts in protocol.registry().get("units", ())
    )
    listed = " or ".join(f"--unit {name}" for name in names)
    return f"; if it is a controller that is asked only by name, give {listed}" if names else ""


def _asked(
    found: Found, protocol: FramedProtocol, rate: int | None, timeout: float
) -> Found | Diagnosis:
    """Return what is known after asking at a rate (None: that of the line), or why it cannot be opened."""
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
    """Ask a controller whose commands have no frame, at each rate that its switches choose."""
    device = device_class(known.name)
    rates = _rates([known])
    for rate in (None,) if url.startswith(_RATELESS) else rates:
        try:
            with device.open(url, **({} if rate is None else {"baudrate": rate})) as opened:
                said = _identification(opened)
        except TransportError as error:
            return [_failed(url, error)]
        except StagewireError:  # no answer, or one that is none
            continue
        at = "" if rate is None else f" at {rate} baud: open it with baudrate={rate}"
        return [Diagnosis(Verdict.FINE, url, f"answers: {known.name}, axis {said}{at}")]
    tried = ", ".join(map(str, rates))
    return [
        Diagnosis(
            Verdict.WRONG,
            url,
            f"no {known.name} answers in its low-level format (tried: {tried} baud)",
            "see that it is switched on, and what its switches say of the rate; in the high-level format it "
            "takes lines of text, and has to be switched to the low-level one first",
        )
    ]


def _identification(device: Any) -> str:
    """Let the first axis say what it is, in the format that takes commands."""
    axis = next(iter(device.facts.protocol.axes))
    with device.low_level():
        said = device.axis(axis).read_identification(timeout=_OTHER_RATE_TIMEOUT)
    return f"{axis}: {said.identification.rstrip(' :')}"


def _failed(url: str, error: TransportError) -> Diagnosis:
    """Say why a line cannot be used, which the error itself says, with what to do."""
    return Diagnosis(Verdict.WRONG, url, str(error).removeprefix(url).lstrip(": "))


def _rates(known: Iterable[Known] = ()) -> list[int]:
    """Return the baud rates that registries name for these units, or for any."""
    units = [one.facts for one in known] or [
        facts for protocol in usable_protocols() for facts in protocol.registry().get("units", ())
    ]
    return sorted({rate for facts in units if facts for rate in _values(facts.get("baud_rates"))})


def _values(rates: object) -> list[int]:
    return list(rates["values"]) if isinstance(rates, dict) else []


def diagnose_computer(ask: bool = False) -> list[Diagnosis]:
    """Look at all ports, and at controllers that have none.

    :param ask: open the ports that are controllers by their USB plug, and ask them who they are.
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
    """Say what a port is, and whether this user may open it."""
    if not found.is_controller:
        return Diagnosis(
            Verdict.NOTE,
            found.url,
            found.what,
            f"if it is a controller, ask it: stagewire doctor {found.url}",
        )
    if not _may_open(found.url):
        return Diagnosis(
            Verdict.WRONG,
            found.url,
            f"{found.what}; but this user may not open the port",
            permission_advice(found.url),
        )
    return Diagnosis(Verdict.FINE, found.url, found.what)


def _may_open(device: str) -> bool:
    """Whether the permissions of a port let this user open it; systems without such say yes."""
    return not os.path.exists(device) or os.access(device, os.R_OK | os.W_OK)


def _without_port(found: Iterable[Found]) -> list[Diagnosis]:
    """Say which controllers are on USB and have no serial port."""
    ports = [one.port for one in found]
    lacking = [_windows(number) for number in system.without_port(system.present(), ports)]
    if sys.platform.startswith("linux"):
        lacking += [_linux(device) for device in system.usb_devices() if not device.has_port]
    return lacking


def _windows(serial_number: str) -> Diagnosis:
    return Diagnosis(
        Verdict.WRONG,
        f"controller {serial_number}",
        "it is plugged in, and its driver gives it no COM port",
        "in the Device Manager, under “Universal Serial Bus controllers”, open the properties of the "
        "device (“APT USB Device” or “USB Serial Converter”), tick “Load VCP” on the page “Advanced”, "
        "and plug the controller in again; a COM port then stands under “Ports (COM & LPT)”",
    )


def _linux(device: system.UsbDevice) -> Diagnosis:
    about = f"controller {device.serial_number or 'without a serial number'}"
    vid, pid = f"{device.plug.vid:04x}", f"{device.pid:04x}"
    if device.driver == "usbfs":
        return Diagnosis(
            Verdict.WRONG,
            about,
            "it is plugged in, but a program drives its USB chip itself, so that there is no serial port",
            "end the program that uses libftdi or the D2XX library, and plug the controller in again",
        )
    if device.driver:
        return Diagnosis(
            Verdict.WRONG,
            about,
            f"it is plugged in, but held by the driver {device.driver}, which gives it no serial port",
            "plug it in again; if that does not help, see what dmesg says of it",
        )
    return Diagnosis(
        Verdict.WRONG,
        about,
        f"it is plugged in ({vid}:{pid}), and no driver is bound to it, so that there is no serial port",
        f"sudo modprobe ftdi_sio; where that is not enough: "
        f"echo {vid} {pid} | sudo tee /sys/bus/usb-serial/drivers/ftdi_sio/new_id",
    )


def _nothing() -> Diagnosis:
    """Say that there is no controller, and where to look on this system."""
    where = {
        "linux": "lsusb lists what is plugged in, dmesg says why a device was refused; in a container or a "
        "virtual machine the device has to be passed on",
        "win32": "the Device Manager shows it under “Universal Serial Bus controllers” or “Other devices”; "
        "without a driver, install that of FTDI (VCP), and tick “Load VCP” in its properties",
        "darwin": "System Information lists it under USB; without a /dev/cu.usbserial… it needs FTDI's VCP "
        "driver, which has to be allowed under Privacy & Security",
    }
    return Diagnosis(
        Verdict.WRONG,
        "USB",
        "no controller is plugged in, as far as this computer knows",
        "see that it is switched on and that the USB cable carries data; "
        + where.get(sys.platform, "see what the system says of its USB devices"),
    )


def _wrong(told: Iterable[Diagnosis]) -> bool:
    return any(one.verdict is Verdict.WRONG for one in told)
