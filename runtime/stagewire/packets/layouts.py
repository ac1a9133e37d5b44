"""Which class a payload belongs to: by the id of its packet, then by its length."""

from __future__ import annotations

from collections.abc import Iterable

from stagewire.packets.message import PacketMessage
from stagewire.packets.shape import Shape

__all__ = ["Layouts", "layouts_by_id"]


class Layouts:
    """The layouts of one message id.

    :param name: of the message.
    """

    __slots__ = ("_by_length", "name")

    def __init__(self, name: str) -> None:
        self.name = name
        self._by_length: list[tuple[int, type[PacketMessage]]] = []  # the longest first

    def add(self, cls: type[PacketMessage]) -> None:
        """Add a class; raise :class:`ValueError` where nothing would tell it from another one."""
        length = cls.layout.length
        if length in dict(self._by_length):
            raise ValueError(f"{self.name} has two layouts of {length} bytes")
        self._by_length.append((length, cls))
        self._by_length.sort(key=lambda entry: -entry[0])

    def of(self, length: int) -> type[PacketMessage] | None:
        """Return the class of a payload of ``length`` bytes: the longest layout that it fills.

        A message without payload is sent with none: bytes are no extra of it.
        """
        for size, cls in self._by_length:
            if size <= length:
                return cls if size or not length else None
        return None

    def lengths(self) -> str:
        """Return the lengths that a payload may have, for people."""
        return " or ".join(str(size) for size, _ in reversed(self._by_length))


def layouts_by_id(shape: Shape, classes: Iterable[type[PacketMessage]]) -> dict[int, Layouts]:
    """Return the layouts of every message by its id.

    Raises :class:`ValueError` for classes that packets of this shape cannot carry or tell apart.
    """
    known: dict[int, Layouts] = {}
    for cls in classes:
        layout = cls.layout
        if not 0 <= layout.id < 1 << 8 * shape.id:
            raise ValueError(f"{layout.message}: no packet holds the id {layout.id:#x}")
        if layout.length > shape.maximum:
            raise ValueError(
                f"{layout.message}: a payload has at most {shape.maximum} bytes, not {layout.length}"
            )
        layouts = known.setdefault(layout.id, Layouts(layout.message))
        if layouts.name != layout.message:
            raise ValueError(
                f"{layout.message} and {layouts.name} have the same id {layout.id:#04x}"
            )
        layouts.add(cls)
    return known
