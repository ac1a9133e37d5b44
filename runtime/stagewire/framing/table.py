"""What framing has to know of a protocol: which end receives what, ids, forms and addresses."""

from __future__ import annotations

import enum
from collections.abc import Mapping

from stagewire.direction import Direction
from stagewire.header import DATA_FLAG, MAXIMUM_PACKET

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Final

__all__ = ["Direction", "End", "Forms", "FramingTable"]


class End(enum.Enum):
    """Which end of the line a framer sits on, hence which messages reach it.

    ``HOST`` receives what controllers send, ``DEVICE`` what the host sends, ``NONE`` listens to
    both.
    """

    HOST = "host"
    DEVICE = "device"
    NONE = "none"

    @property
    def receives(self) -> Direction:
        """The directions of the messages that reach this end."""
        return _RECEIVES[self]


_RECEIVES: Final = {
    End.HOST: Direction.TO_HOST,
    End.DEVICE: Direction.TO_CONTROLLER,
    End.NONE: Direction.BOTH,
}


class Forms:
    """What framing has to know of one message id. Not to be modified.

    :param name: name of the message, for people.
    :param direction: which way it travels.
    :param header: whether it has a form without a packet.
    :param lengths: packet lengths of its data forms; empty when it has none.
    :param documented: False for an id that is known without a layout.
    :param only_zero_parameters: the header form counts only with both parameter bytes zero.
    """

    __slots__ = ("direction", "documented", "header", "lengths", "name", "only_zero_parameters")

    def __init__(
        self,
        name: str,
        direction: Direction,
        header: bool,
        lengths: frozenset[int],
        documented: bool = True,
        only_zero_parameters: bool = False,
    ) -> None:
        self.name = name
        self.direction = direction
        self.header = header
        self.lengths = lengths
        self.documented = documented
        self.only_zero_parameters = only_zero_parameters


class FramingTable:
    """Everything that framing has to know of a protocol. Not to be modified.

    :param forms: message id -> its forms.
    :param host: address of the host.
    :param devices: addresses that controllers have.

    Raises :class:`ValueError` for numbers that no frame can carry.
    """

    __slots__ = ("devices", "forms", "host")

    def __init__(self, forms: Mapping[int, Forms], host: int, devices: frozenset[int]) -> None:
        for address in (host, *devices):
            if not 0 <= address <= 0xFF or address & DATA_FLAG:
                raise ValueError(f"{address:#x} is no address: it has to leave the data flag free")
        for id, known in forms.items():
            if not 0 <= id <= 0xFFFF:
                raise ValueError(f"{known.name}: a message id has 16 bits, {id:#x} has more")
            for length in known.lengths:
                if not 0 < length <= MAXIMUM_PACKET:
                    raise ValueError(
                        f"{known.name}: a packet has 1 to {MAXIMUM_PACKET} bytes, not {length}"
                    )
        self.forms = forms
        self.host = host
        self.devices = devices
