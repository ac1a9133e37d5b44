"""The serial ports of this computer: listing, opening, closing, and the reasons if one cannot be opened.

Opening a port of pyserial is a generator of steps that threads and asyncio share. A step that has to wait
yields the number of seconds; :func:`at_once` and :func:`in_loop` wait.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import os
import socket
import sys
import time
from collections.abc import Generator, Iterator
from glob import iglob
from typing import Any, TypeAlias, TypeVar

from stagewire._links.link import LinkSettings
from stagewire._links.tcp import connect_refusal, unknown_host
from stagewire.errors import LinkOpenError

PortFacts: TypeAlias = Any  # pyserial's ListPortInfo: device, vid, pid, serial_number, description
_DIGITS = 8  # of a serial number, at least


def ports_there_are() -> list[PortFacts]:
    """Return all ports, by name; an empty list if the system cannot list them."""
    from serial.tools.list_ports import comports  # type: ignore[import-untyped]

    with contextlib.suppress(
        Exception
    ):  # it queries drivers and registries, which fail in many ways
        return sorted(comports())
    return []


def port_called(name: str) -> PortFacts | None:
    """Return the facts of a port by its name, or by a symbolic link to it."""
    names = {name.casefold(), os.path.realpath(name).casefold()}
    return next((port for port in ports_there_are() if port.device.casefold() in names), None)


_ABSENT = (errno.ENOENT, errno.ENODEV, errno.ENXIO)
_FORBIDDEN = (errno.EACCES, errno.EPERM)
_BUSY = (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK)
_NO_PORT = (errno.ENOTTY, errno.EISDIR)


def refusal(url: str, error: Exception, settings: LinkSettings) -> LinkOpenError:
    """Return the error for a port that pyserial cannot open."""
    if "://" in url:
        return _refusal_of_url(url, error, settings)
    number = _number_of(error)
    if number in _ABSENT:
        why = f"no such port{_those_there_are()}{_as_number(url)}"
    elif number in _FORBIDDEN:
        why = f"no permission. {permission_advice(url)}"
    elif number in _BUSY:
        why = (
            f"it is in use by {_holder_of(url)}. Close it there, or let it share the port: start "
            f"stagewire serve {url} --tcp 4001, and open socket://127.0.0.1:4001 in all programs"
        )
    elif number in _NO_PORT:
        why = f"it is not a serial port{_those_there_are()}"
    elif isinstance(error, ValueError) or number == errno.EINVAL:
        why = f"it does not support {settings.baudrate} bits per second ({error}). Try another baudrate"
    else:
        why = f"the system says: {error}"
    return LinkOpenError(f"{url} cannot be opened: {why}")


def _as_number(name: str) -> str:
    """Return the hint for a serial number in place of a port; empty for any other name."""
    if not (name.isascii() and name.isdigit() and len(name) >= _DIGITS):
        return ""
    return f". If {name} is a serial number, open usb://{name}"


def permission_advice(name: str) -> str:
    """Return how a user gets permission to open a port."""
    group = _group_of(name)
    return (
        f'The port belongs to the group {group}: run "sudo usermod -aG {group} $USER", then log in again. Or '
        'add this line to /etc/udev/rules.d/70-stagewire.rules, run "sudo udevadm control --reload", and '
        f"plug the device in again: {udev_line(name, group)}"
    )


def udev_line(name: str, group: str = "dialout") -> str:
    """Return the udev rule that lets the group, and the user at the computer, open this port."""
    port = port_called(name)
    if port is None or port.vid is None:
        which = f'KERNEL=="{os.path.basename(os.path.realpath(name))}"'
    else:
        which = f'ATTRS{{idVendor}}=="{port.vid:04x}", ATTRS{{idProduct}}=="{port.pid:04x}"'
    return f'SUBSYSTEM=="tty", {which}, GROUP="{group}", MODE="0660", TAG+="uaccess"'


def _refusal_of_url(url: str, error: Exception, settings: LinkSettings) -> LinkOpenError:
    """Return the error for a network port; its cause is hidden in pyserial's error."""
    for cause in _causes(error):
        if isinstance(cause, socket.gaierror):
            host = url.partition("://")[2].rpartition(":")[0]
            return unknown_host(url, host, cause)
        if isinstance(cause, (ConnectionError, TimeoutError)):
            return connect_refusal(url, cause, settings.open_timeout)
    return LinkOpenError(f"{url} cannot be opened: {error}")


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


def _number_of(error: Exception) -> int | None:
    """Return the system's number of an error, which pyserial hides in three ways."""
    for cause in _causes(error):
        number = getattr(cause, "errno", None)
        if number is None and type(cause).__name__ == "error":  # an error of termios
            number = cause.args[0]
        if isinstance(number, int):
            return number
    text = str(error)
    if sys.platform == "win32":  # only the text has it; no permission means that it is in use
        if "FileNotFoundError" in text:
            return errno.ENOENT
        if "PermissionError" in text:
            return errno.EBUSY
    return None


def _those_there_are() -> str:
    ports = [
        port.device if port.description in (None, "n/a") else f"{port.device} ({port.description})"
        for port in ports_there_are()
    ]
    if not ports:
        return ". This computer has no serial port: is the controller plugged in and its driver installed?"
    return f" (available: {', '.join(ports)})"


def _group_of(name: str) -> str:
    with contextlib.suppress(ImportError, OSError, KeyError):
        import grp

        group = grp.getgrgid(os.stat(name).st_gid).gr_name
        if group not in ("root", "wheel"):  # users should not join these for a port
            return group
    return "dialout"


def _holder_of(name: str) -> str:
    """Return the processes that have a port open, as far as Linux shows them to this user."""
    path = os.path.realpath(name)
    holders = set()
    for link in iglob("/proc/[0-9]*/fd/*"):
        with contextlib.suppress(OSError):
            if os.readlink(link) == path:
                holders.add(link.split("/")[2])
    own = str(os.getpid())
    found = ["this program itself"] if own in holders else []
    for process in sorted(holders - {own}, key=int):
        with contextlib.suppress(OSError), open(f"/proc/{process}/comm") as comm:
            found.append(f"{comm.read().strip()} (process {process})")
    return ", ".join(found) or "another program"


_T = TypeVar("_T")
Steps: TypeAlias = Generator[float, None, _T]
Port: TypeAlias = Any  # an object of pyserial, which has no types

_FTDI = 0x0403  # the vendor of the USB chip; page 9
_NO_SUCH_LINE = (errno.ENOTTY, errno.EINVAL)  # a pty has no RTS line
_LOOKS = 100  # checks for unsent bytes, 10 ms apart

_log = logging.getLogger("stagewire")


def opening(url: str, settings: LinkSettings) -> Steps[Port]:
    """Open a port as pages 9 to 11 describe, and return it.

    Set the baud rate, 8 data bits, no parity and 1 stop bit; pause, purge, pause; then enable RTS/CTS and set
    RTS. A port without flow control, such as RS-232, is opened without the pauses.

    Raises :class:`~stagewire.errors.LinkOpenError`.
    """
    port = _made(url, settings)
    native = is_native(port)
    rtscts = _is_ftdi(url) if settings.rtscts is None else settings.rtscts
    if native:
        port.exclusive = True
        port.write_timeout = settings.stall_timeout
    else:
        port.rtscts = rtscts  # over a network, each change costs a round trip
    try:
        port.open()
    except Exception as error:  # of pyserial, ValueError, NotImplementedError, termios.error
        raise refusal(url, error, settings) from error
    try:
        if rtscts if settings.purge is None else settings.purge:
            yield settings.purge_dwell
            port.reset_input_buffer()
            port.reset_output_buffer()
            yield settings.purge_dwell
        if native:
            _hurry(port)
            if rtscts:
                _control_flow(port)
        if has_descriptor(port):
            _tell_nothing_from_the_end(port)
    except Exception as error:
        port.close()
        raise refusal(url, error, settings) from error
    except BaseException:
        port.close()
        raise
    return port


def forgetting(port: Port) -> Steps[None]:
    """Close a port after everything is sent; give up on a port that does not send."""
    try:
        with contextlib.suppress(*_all_that_ports_raise()):
            looks = _LOOKS
            while port.out_waiting and looks:
                looks -= 1
                yield 0.010
            if not looks:  # otherwise the system would wait for half a minute
                port.reset_output_buffer()
    finally:
        port.close()


def at_once(steps: Steps[_T]) -> _T:
    """Run all steps, sleeping in between."""
    while True:
        try:
            time.sleep(next(steps))
        except StopIteration as end:
            result: _T = end.value
            return result


async def in_loop(steps: Steps[_T]) -> _T:
    """Run all steps without blocking the loop."""
    with contextlib.closing(steps):
        while True:
            try:
                pause = next(steps)
            except StopIteration as end:
                result: _T = end.value
                return result
            await asyncio.sleep(pause)


def is_native(port: Port) -> bool:
    """Return whether it is a port of this computer, not one of pyserial's wrappers."""
    import serial  # type: ignore[import-untyped]

    return type(port) is serial.Serial


def has_descriptor(port: Port) -> bool:
    """Return whether the system can wait for the port like for a socket."""
    return os.name == "posix" and is_native(port)


def _made(url: str, settings: LinkSettings) -> Port:
    import serial

    try:
        return serial.serial_for_url(
            url,
            baudrate=settings.baudrate,
            bytesize=serial.EIGHTBITS,
            parity=serial.PARITY_NONE,
            stopbits=serial.STOPBITS_ONE,
            xonxoff=False,
            timeout=None,
            do_not_open=True,
        )
    except (ValueError, OSError) as error:
        scheme, colon, _ = url.partition("://")
        if colon and "not known" in str(error):
            raise LinkOpenError(
                f"{url} cannot be opened: unknown scheme {scheme}://. Available are socket://HOST:PORT, "
                "rfc2217://HOST:PORT, loop://, the schemes of installed packages (stagewire has "
                "virtual://UNIT), and ports by name, such as /dev/ttyUSB0 or COM3"
            ) from error
        raise LinkOpenError(f"{url} cannot be opened: {error}") from error


def _is_ftdi(url: str) -> bool:
    found = None if "://" in url else port_called(url)
    return found is not None and found.vid == _FTDI


def _hurry(port: Port) -> None:
    """Ask the driver not to collect bytes for some milliseconds, if it supports that."""
    if hasattr(port, "set_low_latency_mode"):
        try:
            port.set_low_latency_mode(True)
        except (ValueError, OSError) as error:
            _log.debug("%s: no low latency: %s", port.port, error)


def _control_flow(port: Port) -> None:
    port.rtscts = True
    try:
        port.rts = True
    except OSError as error:
        if error.errno not in _NO_SUCH_LINE:
            raise
        _log.debug("%s: no RTS to set: %s", port.port, error)


def _tell_nothing_from_the_end(port: Port) -> None:
    """Make a read that finds nothing fail; otherwise it would look like a read from a lost port."""
    import termios

    attributes = termios.tcgetattr(port.fileno())
    attributes[6][termios.VMIN] = 1
    termios.tcsetattr(port.fileno(), termios.TCSANOW, attributes)


def _all_that_ports_raise() -> tuple[type[Exception], ...]:
    if os.name != "posix":
        return (OSError,)
    import termios

    return OSError, termios.error
