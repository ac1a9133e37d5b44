"""How a line is opened, as far as its URL does not say it."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from stagewire.errors import BadValueError, OutOfRangeError

__all__ = ["LineSettings"]


@dataclass(frozen=True, kw_only=True)
class LineSettings:
    """How a line is opened. What a kind of line does not have is not looked at, such as a baud rate of TCP.

    Every line has 8 data bits, no parity, 1 stop bit, and no XON/XOFF: the bytes 0x11 and 0x13 are data.

    :param baudrate: bits per second. Thorlabs APT has 115,200 (page 11), an ASI MS-2000 what its switches
        say.
    :param rtscts: whether RTS and CTS control the flow. None: as the port asks, on for a USB chip of FTDI
        (vendor 0x0403; page 10), off for every other.
    :param purge: whether to forget what the port holds, with a pause before and after, as page 10 does on
        USB. None: where ``rtscts`` is on.
    :param purge_dwell: each of these pauses, in seconds; 0 to 10.
    :param open_timeout: how long opening may take, in seconds, where somebody has to answer; over 0 to 3600.
    :param stall_timeout: when a line that takes no byte of what is to be sent is gone, in seconds; over 0 to
        3600. RTS and CTS, and the other end of TCP, can stop a line for as long as they like.

    Raises :class:`~stagewire.errors.BadValueError` and :class:`~stagewire.errors.OutOfRangeError` for a value
    that is none.
    """

    baudrate: int = 115200
    rtscts: bool | None = None
    purge: bool | None = None
    purge_dwell: float = 0.050
    open_timeout: float = 5.0
    stall_timeout: float = 5.0

    def __post_init__(self) -> None:
        if not isinstance(self.baudrate, int) or isinstance(self.baudrate, bool):
            raise BadValueError(
                f"baudrate takes a whole number of bits per second, not {self.baudrate!r}"
            )
        if not 50 <= self.baudrate <= 12_000_000:
            raise OutOfRangeError(
                f"baudrate {self.baudrate} is outside 50 to 12000000 bits per second"
            )
        for name in ("rtscts", "purge"):
            value = getattr(self, name)
            if value is not None and not isinstance(value, bool):
                raise BadValueError(
                    f"{name} takes True, False, or None for as the port asks, not {value!r}"
                )
        if not 0 <= self._seconds("purge_dwell") <= 10:
            raise OutOfRangeError(f"purge_dwell {self.purge_dwell} is outside 0 to 10 seconds")
        for name in ("open_timeout", "stall_timeout"):
            if not 0 < (value := self._seconds(name)) <= 3600:
                raise OutOfRangeError(f"{name} {value} has to be over 0 and at most 3600 seconds")

    @classmethod
    def of(cls, options: dict[str, object]) -> LineSettings:
        """Return the settings that options say.

        Raises :class:`~stagewire.errors.BadValueError` for one that there is not, too.
        """
        known = [field.name for field in fields(cls)]
        if unknown := [name for name in options if name not in known]:
            raise BadValueError(
                f"a line has no option {', '.join(unknown)} (it has {', '.join(known)})"
            )
        return cls(**options)  # type: ignore[arg-type]  # checked when it is made

    def _seconds(self, name: str) -> float:
        value = getattr(self, name)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
            raise BadValueError(f"{name} takes seconds, not {value!r}")
        return value
