"""Opening a port of pyserial, and giving it back; as steps, which threads and asyncio take alike.

A step that has to wait yields how many seconds; :func:`at_once` and :func:`in_loop` wait.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import os
import time
from collections.abc import Generator
from typing import Any, TypeAlias, TypeVar

from stagewire.errors import LinkOpenError
from stagewire.links.ports import port_called
from stagewire.links.refusal import refusal
from stagewire.links.settings import LineSettings

__all__ = ["Port", "at_once", "forgetting", "has_descriptor", "in_loop", "is_native", "opening"]

_T = TypeVar("_T")
Steps: TypeAlias = Generator[float, None, _T]
Port: TypeAlias = Any  # an object of pyserial, which has no types

_FTDI = 0x0403  # the vendor of the USB chip; page 9
_NO_SUCH_LINE = (errno.ENOTTY, errno.EINVAL)  # a pty has no RTS
_LOOKS = 100  # at what is still to be sent, 10 ms apart

_log = logging.getLogger("stagewire")


def opening(url: str, settings: LineSettings) -> Steps[Port]:
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


def _made(url: str, settings: LineSettings) -> Port:
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
