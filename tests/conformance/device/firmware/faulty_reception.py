"""Firmware that fails on garbage, unknown ids, wrong lengths or fast messages."""

from __future__ import annotations

from collections.abc import Callable

from firmware_defects import Defect, Draw, NotHereError, of
from firmware_frames import HOST, ID, Frame, is_whole
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

_DOCUMENTED = frozenset({HOST, 0x11, 0x50, *range(0x21, 0x2B)})
_DEAF = 5.0
"""Seconds for which the firmware is upset."""


class _Upset(Firmware):
    """Ignores everything for a while after it was upset.

    :param by: returns whether bytes upset it.
    """

    def __init__(self, by: Callable[[bytes], bool]) -> None:
        self._by = by
        self._until = 0.0

    def takes(self, frame: Frame) -> None:
        if self.now() >= self._until:
            self.pass_on(frame.raw)

    def takes_odd(self, raw: bytes) -> None:
        if self.now() >= self._until:
            self.pass_on(raw)
        if self._by(raw):
            self._until = self.now() + _DEAF


def _is_unknown(raw: bytes) -> bool:
    """Return whether bytes are a whole frame with an unknown id."""
    return is_whole(raw) and int.from_bytes(raw[:2], "little") not in ID.values()


def _has_odd_length(raw: bytes) -> bool:
    """Return whether bytes are a whole frame of a known message with a packet that it does not have."""
    return is_whole(raw) and int.from_bytes(raw[:2], "little") in ID.values()


def _is_cut_short(raw: bytes) -> bool:
    return 1 < len(raw) < 6 or (len(raw) > 6 and not is_whole(raw) and bool(raw[4] & 0x80))


def _is_rubbish(raw: bytes) -> bool:
    return not is_whole(raw)


def _made(firmware: Callable[[], Firmware]) -> Callable[[Draw], tuple[Firmware, str]]:
    """Return a defect that any unit can have."""
    return lambda draw: (firmware(), "")


def _upset(by: Callable[[bytes], bool]) -> Callable[[Draw], tuple[Firmware, str]]:
    return _made(lambda: _Upset(by))


class _WaitsForTheRest(Firmware):
    """Waits for ever for the rest of a truncated frame, and reads later bytes as the rest."""

    def __init__(self) -> None:
        self._missing = 0

    def takes(self, frame: Frame) -> None:
        self._take(frame.raw)

    def takes_odd(self, raw: bytes) -> None:
        self._take(raw)

    def _take(self, raw: bytes) -> None:
        eaten = min(self._missing, len(raw))
        self._missing -= eaten
        raw = raw[eaten:]
        if not raw:
            return
        if is_whole(raw):
            self.pass_on(raw)
            return
        due = 6 + int.from_bytes(raw[2:4], "little") if len(raw) >= 6 and raw[4] & 0x80 else 6
        self._missing = max(0, due - len(raw)) if len(raw) < due else (6 - len(raw) % 6) % 6


class _FillsUp(Firmware):
    """Completes a truncated frame with the next messages, and is in step after that."""

    def __init__(self) -> None:
        self._missing = 0

    def takes(self, frame: Frame) -> None:
        if self._missing > 0:
            self._missing -= len(frame.raw)
        else:
            self.pass_on(frame.raw)

    def takes_odd(self, raw: bytes) -> None:
        if _is_cut_short(raw) and len(raw) < 32:
            due = 6 + (int.from_bytes(raw[2:4], "little") if len(raw) >= 6 else 0)
            self._missing = due - len(raw)
        else:
            self.pass_on(raw)


class _ReadsPackets(Firmware):
    """Reads an unknown frame as a header, and its packet as messages."""

    def takes_odd(self, raw: bytes) -> None:
        if _is_unknown(raw) and len(raw) > 6:
            self.pass_on(raw[6:])
        else:
            self.pass_on(raw)


class _Parrot(Firmware):
    """Returns unknown messages to the host."""

    def takes_odd(self, raw: bytes) -> None:
        self.pass_on(raw)
        if is_whole(raw):
            self.say(Frame(raw).to(HOST).coming_from(raw[4] & 0x7F).raw)


class _TakesEveryAddress(Firmware):
    """Answers for every address.

    :param mine: the addresses of the unit; the first one answers.
    """

    def __init__(self, mine: list[int], but: frozenset[int] = frozenset()) -> None:
        self._mine = mine
        self._but = but

    def takes(self, frame: Frame) -> None:
        others = frame.dest not in (*self._mine, *self._but)
        self.pass_on(frame.to(self._mine[0]).raw if others else frame.raw)


def _takes_every_address(draw: Draw) -> tuple[Firmware, str]:
    return _TakesEveryAddress([place.address for place in draw.places]), ""


def _takes_documented_addresses(draw: Draw) -> tuple[Firmware, str]:
    """Accept every documented address, alone on its line."""
    mine = [place.address for place in draw.places]
    if len(mine) > 1:
        raise NotHereError
    others = frozenset(range(0x80)) - _DOCUMENTED
    return _TakesEveryAddress(mine, others), ""


class _SmallBuffer(Firmware):
    """Has a buffer for a number of messages. Further messages within two milliseconds are lost."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._at = -1.0
        self._count = 0

    def takes(self, frame: Frame) -> None:
        if self.now() - self._at > 0.002:
            self._count = 0
        self._at = self.now()
        self._count += 1
        if self._count <= self._most:
            self.pass_on(frame.raw)


class _Swaps(Firmware):
    """Delays every fourth reply, so that others overtake it."""

    def __init__(self) -> None:
        self._count = 0

    def says(self, frame: Frame) -> None:
        self._count += 1
        if self._count % 4 == 0:
            self.say(frame.raw, after=0.004)
        else:
            self.say(frame.raw)


RECEPTION = (
    Defect(1, "An unknown id upsets it", of("unknown-id"), _upset(_is_unknown)),
    Defect(6, "The packet of an unknown message is read as messages", of("unknown-id"), _made(_ReadsPackets)),
    Defect(1, "Unknown messages are sent back", of("unknown-id wrong-length"), _made(_Parrot)),
    Defect(1, "A packet where none belongs upsets it", of("wrong-length"), _upset(_has_odd_length)),
    Defect(1, "A truncated frame upsets it", of("truncated"), _upset(_is_cut_short),
           result=Result.FRAGILE),
    Defect(1, "Garbage upsets it", of("garbage"), _upset(_is_rubbish), result=Result.FRAGILE),
    Defect(1, "It waits for ever for the rest of a frame", of("truncated"), _made(_WaitsForTheRest),
           result=Result.FRAGILE),
    Defect(
        1, "It completes a frame with the next one", of("truncated"), _made(_FillsUp),
        result=Result.FRAGILE,
    ),
    Defect(
        11, "It answers to every address", of("foreign-destination"), _takes_every_address,
        result=Result.NON_STRICT,
    ),
    Defect(
        3, "It answers to addresses of other units", of("foreign-destination"), _takes_documented_addresses,
        result=Result.NON_STRICT,
    ),
    Defect(1, "It buffers only five messages", of("back-to-back"), _made(lambda: _SmallBuffer(5))),
    Defect(1, "It buffers only ten messages", of("back-to-back"), _made(lambda: _SmallBuffer(10))),
    Defect(1, "Replies come in another order", of("back-to-back"), _made(_Swaps)),
)  # fmt: skip
