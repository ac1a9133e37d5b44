"""What frames and their like have in common: equal by their parts, hashable, picklable, never changed.

Attributes of a frozen object can only be set in a roundabout and slow way, so a frame is filled as a
*draft*: an object of a class with the same base and slots and without the lock, whose class is then
changed. Both methods of the lock share one C slot: a draft needs object's own of both, or setting stays
slow.
"""

from __future__ import annotations

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Any

__all__ = ["Frozen"]


class Frozen:
    """Base of frames; a class says what its parts are."""

    __slots__ = ()

    def _key(self) -> tuple[Any, ...]:
        """Return the parts."""
        raise NotImplementedError

    def __setattr__(self, name: str, value: Any, /) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable; make a new one to change {name}")

    def __delattr__(self, name: str, /) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable; {name} cannot be deleted")

    def __eq__(self, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return isinstance(other, Frozen) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())
