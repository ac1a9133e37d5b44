"""Named values and named bits. Values and bits without a name are kept.

A class of flag bits is an integer class that names its bits, so creating a value costs no more than creating
an integer. An enumeration names values; a value without a name stays an integer.
"""

from __future__ import annotations

from enum import IntEnum

from stagewire.errors import UnknownFieldError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import ClassVar, Self, overload


class Bit:
    """One named bit of a :class:`Flags` class: on the class its mask, on a value a bool."""

    __slots__ = ("mask", "note")

    def __init__(self, mask: int, note: str = "") -> None:
        self.mask = mask
        self.note = note

    if TYPE_CHECKING:

        @overload
        def __get__(self, value: None, owner: type) -> int: ...

        @overload
        def __get__(self, value: Flags, owner: type) -> bool: ...

    def __get__(self, value: Flags | None, owner: type) -> int | bool:
        """Return the mask, or whether the bit is set."""
        return self.mask if value is None else bool(value & self.mask)


class Flags(int):
    """An integer whose bits have names. Bits without a name are kept as received."""

    __slots__ = ()
    bits: ClassVar[dict[str, int]] = {}

    def __init_subclass__(cls) -> None:
        cls.bits = {name: bit.mask for name, bit in vars(cls).items() if isinstance(bit, Bit)}

    @classmethod
    def of(cls, **bits: bool) -> Self:
        """Return a value with the given bits set: ``DcStatusBits.of(settled=True)``.

        Raises :class:`~stagewire.errors.UnknownFieldError` for an unknown bit name.
        """
        value = 0
        for name, on in bits.items():
            if name not in cls.bits:
                raise UnknownFieldError(
                    f"{cls.__name__} has no bit {name} (it has: {', '.join(cls.bits)})"
                )
            value |= cls.bits[name] if on else 0
        return cls(value)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the bits that are set, lowest first."""
        return tuple(name for name, mask in self.bits.items() if self & mask)

    @property
    def unnamed(self) -> int:
        """The bits that are set but have no name."""
        rest = int(self)
        for mask in self.bits.values():
            rest &= ~mask
        return rest

    def __repr__(self) -> str:
        parts = [*self.names, *([hex(self.unnamed)] if self.unnamed else [])]
        return f"<{type(self).__name__} {'|'.join(parts) or '0'}>"


class Enumeration(IntEnum):
    """Named values of a field. The field itself stays a raw integer."""

    @classmethod
    def of(cls, value: int) -> Self | int:
        """Return the member for ``value``, or ``value`` itself if it has no name."""
        try:
            return cls(value)
        except ValueError:
            return value
