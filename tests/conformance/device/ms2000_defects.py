"""Descriptions of defective MS-2000 controllers: the defect, and the check that must find it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from faulty_ms2000_link import FaultyMs2000Link, Make

from stagewire.protocols import CommandFrame
from stagewire_conformance.device.results import Result
from stagewire_ms2000 import messages as m

X, Y = 0x18, 0x19
POSITIONS = (m.ReadMotorPosition, m.ReadMotorPositionAndStatus)
STATUSES = (m.ReadStatusByte, m.ReadMotorPositionAndStatus)
MOVES = (m.WriteTargetPosition, m.IncrementMoveUp, m.IncrementMoveDown, m.WriteVectorSpeed)
ACK = b":A"


@dataclass
class Defect:
    """A defect, the check that must find it, and a part of the finding."""

    make: Make
    check: str
    says: str
    result: Result = Result.FAIL
    pics: Mapping[str, Any] = field(default_factory=dict)
    strategies: Mapping[str, str] = field(default_factory=dict)
    hides: bool = False
    """Whether it has an effect that is not readable, so that it cannot be restored."""


def bits(set_: int = 0, clear: int = 0) -> Callable[[bytes, CommandFrame], bytes]:
    """Return a change that sets and clears bits of a status byte, the last byte of its replies."""
    return lambda raw, frame: raw[:-1] + bytes((raw[-1] & ~clear | set_,))


def named(**defects: Defect) -> dict[str, Defect]:
    return defects


class Stateful(FaultyMs2000Link):
    """A line with state."""

    def __init__(self, controller: Any) -> None:
        super().__init__(controller)
        self.memory: dict[Any, Any] = {}


def changed(
    command: type, change: Callable[[bytes], bytes]
) -> Callable[[CommandFrame, bytes], list[bytes]]:
    """Return a function that changes the data of a command on its way."""

    def instead(frame: CommandFrame, raw: bytes) -> list[bytes]:
        hit = isinstance(frame.message, command)
        return [raw[:3] + change(raw[3:-1]) + raw[-1:] if hit else raw]

    return instead
