"""Why a port cannot be opened, and what to do; for people."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import sys
from collections.abc import Iterator
from glob import iglob

from stagewire.errors import LinkOpenError
from stagewire.links.ports import port_called, ports_there_are
from stagewire.links.settings import LineSettings
from stagewire.links.tcp_address import connect_refusal, unknown_host

__all__ = ["permission_advice", "refusal", "udev_line"]

_ABSENT = (errno.ENOENT, errno.ENODEV, errno.ENXIO)
_FORBIDDEN = (errno.EACCES, errno.EPERM)
_BUSY = (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK)
_NO_PORT = (errno.ENOTTY, errno.EISDIR)


def refusal(url: str, error: Exception, settings: LineSettings) -> LinkOpenError:
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


def _refusal_of_url(url: str, error: Exception, settings: LineSettings) -> LinkOpenError:
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
