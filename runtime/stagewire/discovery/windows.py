"""Windows: controllers whose driver was not told to give them a COM port."""

from __future__ import annotations

import re
import sys

from stagewire.discovery.ports import Port
from stagewire.discovery.usb import plug_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["present", "without_port"]

_DRIVER = r"SYSTEM\CurrentControlSet\Services\FTDIBUS\Enum"
"""Where Windows lists what is plugged in now and held by the driver of the USB chip."""
_INSTANCE = re.compile(r"USB\\VID_([0-9A-F]{4})&PID_([0-9A-F]{4})\\([0-9A-Z]+)", re.IGNORECASE)


def present() -> list[str]:
    """Return the instances that the driver of the USB chip holds; none elsewhere than on Windows."""
    if sys.platform != "win32":
        return []
    import winreg

    try:
        with winreg.OpenKey(winreg.HKEY_LOCAL_MACHINE, _DRIVER) as key:
            number = winreg.QueryInfoKey(key)[1]
            values = [winreg.EnumValue(key, index) for index in range(number)]
    except OSError:  # the driver was never installed, or holds nothing
        return []
    return [value for name, value, _ in values if name.isdigit() and isinstance(value, str)]


def without_port(instances: Iterable[str], ports: Iterable[Port]) -> list[str]:
    r"""Return the serial numbers of controllers that are plugged in and have no COM port.

    :param instances: what the driver holds, such as ``USB\VID_0403&PID_FAF0\83828433``.
    :param ports: the serial ports there are.
    """
    served = {port.serial_number for port in ports}
    found = []
    for instance in instances:
        match = _INSTANCE.match(instance)
        if match and plug_of(int(match[1], 16), int(match[2], 16)) and match[3] not in served:
            found.append(match[3])
    return found
