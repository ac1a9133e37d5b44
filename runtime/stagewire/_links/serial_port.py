"""The serial ports of this computer: listing, opening, closing, and why one cannot be opened.

Opening a port of pyserial is written as steps, which threads and asyncio share. A step that has to wait
yields how many seconds; :func:`at_once` and :func:`in_loop` wait.
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


def ports_there_are() -> list[PortFacts]:
    """Return every port, by name; nothing where the system does not tell."""
    from serial.tools.list_ports import comports  # type: ignore[import-untyped]

    with contextlib.suppress(
        Exception
    ):  # it asks drivers and registries, and these fail in many ways
        return sorted(comports())
    return []


def port_called(name: str) -> PortFacts | None:
    """Return what is known of a port by its name, or by a link to it."""
    names = {name.casefold(), os.path.realpath(name).casefold()}
    return next((port for port in ports_there_are() if port.device.casefold() in names), None)


_ABSENT = (errno.ENOENT, errno.ENODEV, errno.ENXIO)
_FORBIDDEN = (errno.EACCES, errno.EPERM)
_BUSY = (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK)
_NO_PORT = (errno.ENOTTY, errno.EISDIR)


def refusal(url: str, error: Exception, settings: LinkSettings) -> LinkOpenError:
    """Return what is said when pyserial cannot open a port."""
    if "://" in url:
        return _refusal_of_url(url, error, settings)
    number = _number_of(error)
    if number in _ABSENT:
        why = f"there is no such port{_those_there_are()}"
    elif number in _FORBIDDEN:
        why = f"no permission. {permission_advice(url)}"
    elif number in _BUSY:
        why = f"it is in use by {_holder_of(url)}. Close it there: a port is for one program at a time"
    elif number in _NO_PORT:
        why = f"it is no serial port{_those_there_are()}"
    elif isinstance(error, ValueError) or number == errno.EINVAL:
        why = f"it does not take {settings.baudrate} bits per second ({error}). Give another baudrate="
    else:
        why = f"the system says: {error}"
    return LinkOpenError(f"{url} cannot be opened: {why}")


def permission_advice(name: str) -> str:
    """Return how a user gets the permission to open a port."""
    group = _group_of(name)
    return (
        f'The port belongs to the group {group}: "sudo usermod -aG {group} $USER", then log in again. Or put '
        'this line into /etc/udev/rules.d/70-stagewire.rules, say "sudo udevadm control --reload", and plug '
        f"it in again: {udev_line(name, group)}"
    )


def udev_line(name: str, group: str = "dialout") -> str:
    """Return the rule that lets the group, and whoever sits at the computer, open this port."""
    port = port_called(name)
    if port is None or port.vid is None:
        which = f'KERNEL=="{os.path.basename(os.path.realpath(name))}"'
    else:
        which = f'ATTRS{{idVendor}}=="{port.vid:04x}", ATTRS{{idProduct}}=="{port.pid:04x}"'
    return f'SUBSYSTEM=="tty", {which}, GROUP="{group}", MODE="0660", TAG+="uaccess"'


def _refusal_of_url(url: str, error: Exception, settings: LinkSettings) -> LinkOpenError:
    """Return what is said of a line over a network; the cause is under what pyserial made of it."""
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
        if number is None and type(cause).__name__ == "error":  # that of termios
            number = cause.args[0]
        if isinstance(number, int):
            return number
    text = str(error)
    if (
        sys.platform == "win32"
    ):  # there only the text has it; who may not open a port there is too late
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
        return ". This computer has no serial port; is the controller plugged in, and its driver there?"
    return f"; there are: {', '.join(ports)}"


def _group_of(name: str) -> str:
    with contextlib.suppress(ImportError, OSError, KeyError):
        import grp

        group = grp.getgrgid(os.stat(name).st_gid).gr_name
        if group not in ("root", "wheel"):  # these are nothing to be joined for a port
            return group
    return "dialout"


def _holder_of(name: str) -> str:
    """Return which processes have a port open, as far as Linux tells this user."""
    path = os.path.realpath(name)
    holders = set()
    for link in iglob("/proc/[0-9]*/fd/*"):
        with contextlib.suppress(OSError):
            if os.readlink(link) == path:
                holders.add(link.split("/")[2])
    if str(os.getpid()) in holders:
        return "this program itself"
    found = []
    for process in sorted(holders, key=int):
        with contextlib.suppress(OSError), open(f"/proc/{process}/comm") as comm:
            found.append(f"{comm.read().strip()} (process {process})")
    return ", ".join(found) or "another program"


_T = TypeVar("_T")
Steps: TypeAlias = Generator[float, None, _T]
Port: TypeAlias = Any  # an object of pyserial, which has no types

_FTDI = 0x0403  # the vendor of the USB chip; page 9
_NO_SUCH_LINE = (errno.ENOTTY, errno.EINVAL)  # a pty has no RTS
_LOOKS = 100  # at what is still to be sent, 10 ms apart

_log = logging.getLogger("stagewire")


def opening(url: str, settings: LinkSettings) -> Steps[Port]:
    """Open a port as pages 9 to 11 do, and return it.

    Baud rate, 8 data bits, no parity, 1 stop bit; a pause, purge, a pause; then RTS/CTS, and RTS set. A port
    without flow control, such as one of RS-232, is opened without the pauses.

    Raises :class:`~stagewire.errors.LinkOpenError`.
    """
    port = _made(url, settings)
    native = is_native(port)
    rtscts = _is_ftdi(url) if settings.rtscts is None else settings.rtscts
    if native:
        port.exclusive = True
        port.write_timeout = settings.stall_timeout
    else:
        port.rtscts = rtscts  # over a network each change costs an answer
    try:
        port.open()
    except Exception as error:  # pyserial's own, ValueError, NotImplementedError, termios.error
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
    """Give a port back; wait until everything is sent, but not for a line that takes nothing."""
    try:
        with contextlib.suppress(*_all_that_ports_raise()):
            looks = _LOOKS
            while port.out_waiting and looks:
                looks -= 1
                yield 0.010
            if not looks:  # else the system would wait for half a minute
                port.reset_output_buffer()
    finally:
        port.close()


def at_once(steps: Steps[_T]) -> _T:
    """Take all steps, sleeping."""
    while True:
        try:
            time.sleep(next(steps))
        except StopIteration as end:
            result: _T = end.value
            return result


async def in_loop(steps: Steps[_T]) -> _T:
    """Take all steps; the loop goes on meanwhile."""
    with contextlib.closing(steps):
        while True:
            try:
                pause = next(steps)
            except StopIteration as end:
                result: _T = end.value
                return result
            await asyncio.sleep(pause)


def is_native(port: Port) -> bool:
    """Return whether it is a port of this computer, and nothing that pyserial lays over one."""
    import serial  # type: ignore[import-untyped]

    return type(port) is serial.Serial


def has_descriptor(port: Port) -> bool:
    """Return whether the system can wait for the port as for a socket."""
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
                f"{url} cannot be opened: there are no lines {scheme}://. There are socket://HOST:PORT, "
                "rfc2217://HOST:PORT, loop://, what installed packages bring (stagewire brings "
                "virtual://UNIT), and ports by their name, such as /dev/ttyUSB0 or COM3"
            ) from error
        raise LinkOpenError(f"{url} cannot be opened: {error}") from error


def _is_ftdi(url: str) -> bool:
    found = None if "://" in url else port_called(url)
    return found is not None and found.vid == _FTDI


def _hurry(port: Port) -> None:
    """Ask the driver not to collect bytes for some milliseconds, where it does, and lets us ask."""
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
    """Let a read that finds nothing fail; else it would look like one of a port that is gone."""
    import termios

    attributes = termios.tcgetattr(port.fileno())
    attributes[6][termios.VMIN] = 1
    termios.tcsetattr(port.fileno(), termios.TCSANOW, attributes)


def _all_that_ports_raise() -> tuple[type[Exception], ...]:
    if os.name != "posix":
        return (OSError,)
    import termios

    return OSError, termios.error
