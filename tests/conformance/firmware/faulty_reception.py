"""Firmware that trips over what it receives: rubbish, unknown ids, wrong lengths, others' addresses, haste."""

from __future__ import annotations

from collections.abc import Callable

from firmware_defects import Defect, Draw, NotHereError, Says
from firmware_frames import HOST, ID, Frame, is_whole
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

__all__ = ["RECEPTION"]

_DEAF = 5.0
"""Seconds for which something has upset the firmware."""


class _Upset(Firmware):
    """Hears nothing for a while after something that upsets it.

    :param by: says what does.
    """

    def __init__(self, by: Callable[[bytes], bool], seconds: float = _DEAF) -> None:
        self._by = by
        self._seconds = seconds
        self._until = 0.0

    def takes(self, frame: Frame) -> None:
        if self.now() >= self._until:
            self.pass_on(frame.raw)

    def takes_odd(self, raw: bytes) -> None:
        if self.now() >= self._until:
            self.pass_on(raw)
        if self._by(raw):
            self._until = self.now() + self._seconds


def _is_unknown(raw: bytes) -> bool:
    """Whether it is a whole frame with an id that no message has."""
    return is_whole(raw) and int.from_bytes(raw[:2], "little") not in ID.values()


def _has_odd_length(raw: bytes) -> bool:
    """Whether it is a whole frame of a known message, with a packet that it has not."""
    return is_whole(raw) and int.from_bytes(raw[:2], "little") in ID.values()


def _is_cut_short(raw: bytes) -> bool:
    return 1 < len(raw) < 6 or (len(raw) > 6 and not is_whole(raw) and bool(raw[4] & 0x80))


def _is_rubbish(raw: bytes) -> bool:
    return not is_whole(raw)


def _upset(by: Callable[[bytes], bool]) -> Callable[[Draw], tuple[Firmware, str]]:
    return lambda draw: (_Upset(by), "")


class _WaitsForTheRest(Firmware):
    """Waits for ever for the rest of what was cut short, and takes what comes next for it."""

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
    """Fills up what was cut short with the next messages, and is in step with the one after them."""

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


class _NeverLooksAtTheLength(Firmware):
    """Reads an unknown frame as a header, and its packet as messages."""

    def takes_odd(self, raw: bytes) -> None:
        if _is_unknown(raw) and len(raw) > 6:
            self.pass_on(raw[6:])
        else:
            self.pass_on(raw)


class _Parrot(Firmware):
    """Sends back whatever it does not know."""

    def takes_odd(self, raw: bytes) -> None:
        self.pass_on(raw)
        if is_whole(raw):
            self.say(Frame(raw).to(HOST).coming_from(raw[4] & 0x7F).raw)


class _TakesEveryAddress(Firmware):
    """Answers for everybody.

    :param mine: the addresses of the unit; the first one answers.
    """

    def __init__(self, mine: list[int], but: frozenset[int] = frozenset()) -> None:
        self._mine = mine
        self._but = but

    def takes(self, frame: Frame) -> None:
        others = frame.dest not in (*self._mine, *self._but)
        self.pass_on(frame.to(self._mine[0]).raw if others else frame.raw)


def _documented(draw: Draw) -> frozenset[int]:
    return frozenset({HOST, 0x11, 0x50, *range(0x21, 0x2B)})


def _takes_every_address(draw: Draw) -> tuple[Firmware, str]:
    return _TakesEveryAddress([place.address for place in draw.places]), ""


def _takes_documented_addresses(draw: Draw) -> tuple[Firmware, str]:
    """Take every address that a unit can have, alone on its line."""
    mine = [place.address for place in draw.places]
    if len(mine) > 1:
        raise NotHereError
    others = frozenset(range(0x80)) - _documented(draw)
    return _TakesEveryAddress(mine, others), ""


class _OneAtATime(Firmware):
    """Has room for one message only: what comes within two milliseconds of another is lost."""

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
    """Says every fourth reply a little later; when others come at once they overtake it."""

    def __init__(self) -> None:
        self._count = 0

    def says(self, frame: Frame) -> None:
        self._count += 1
        if self._count % 4 == 0:
            self.say(frame.raw, after=0.004)
        else:
            self.say(frame.raw)


def _identify_answered(draw: Draw) -> tuple[Firmware, str]:
    class Confirms(Firmware):
        def takes(self, frame: Frame) -> None:
            self.pass_on(frame.raw)
            if frame.name == "MOD_IDENTIFY":
                self.say(frame.to(HOST).coming_from(frame.dest).raw)

    draw.claims("MOD_IDENTIFY")
    return Confirms(), "MOD_IDENTIFY"


def _identify_upsets(draw: Draw) -> tuple[Firmware, str]:
    """Hear nothing while the light flashes."""
    draw.claims("MOD_IDENTIFY")

    class Deaf(_Upset):
        def takes(self, frame: Frame) -> None:
            super().takes(frame)
            if frame.name == "MOD_IDENTIFY":
                self._until = self.now() + 3.0

    return Deaf(lambda raw: False), "MOD_IDENTIFY"


# Bays, and what a unit says of itself


def _bays(change: Callable[[Frame], Frame]) -> Callable[[Draw], tuple[Firmware, str]]:
    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims("RACK_REQ_BAYUSED")
        return Says(lambda f: f.name == "RACK_GET_BAYUSED", lambda f: [change(f)]), "RACK_GET_BAYUSED"

    return make


def _from_one(draw: Draw) -> tuple[Firmware, str]:
    draw.claims("RACK_REQ_BAYUSED")

    class CountsFromOne(Firmware):
        def takes(self, frame: Frame) -> None:
            if frame.name != "RACK_REQ_BAYUSED":
                self.pass_on(frame.raw)
            elif frame["bay_ident"]:
                self.pass_on(frame.with_("bay_ident", frame["bay_ident"] - 1).raw)
            else:  # there is none
                self.pass_on(frame.with_("bay_ident", 9).raw)  # an empty one

        def says(self, frame: Frame) -> None:
            counts = frame.name == "RACK_GET_BAYUSED"
            ident = (frame["bay_ident"] + 1) % 10 if counts else 0
            self.say(frame.with_("bay_ident", ident).raw if counts else frame.raw)

    return CountsFromOne(), "RACK_GET_BAYUSED"


def _empty_bay_answers(draw: Draw) -> tuple[Firmware, str]:
    """Answer for a bay in which nothing is."""
    bays = [place.address for place in draw.places if place.bay is not None]
    empty = [a for a in range(0x21, 0x24) if a not in bays]
    if not bays or not empty:
        raise NotHereError

    class Ghost(Firmware):
        def takes(self, frame: Frame) -> None:
            self.pass_on(frame.to(bays[0]).raw if frame.dest == empty[0] else frame.raw)

    return Ghost(), ""


def _info(field: str, change: Callable[[int], int]) -> Callable[[Draw], tuple[Firmware, str]]:
    def make(draw: Draw) -> tuple[Firmware, str]:
        place = draw.random.choice([p for p in draw.places if not p.is_motherboard])
        return Says(
            lambda f: f.name == "HW_GET_INFO" and f.source == place.address,
            lambda f: [f.with_(field, change(f[field]))],
        ), "HW_GET_INFO"

    return make


def _of_another_unit(draw: Draw) -> tuple[Firmware, str]:
    units = {place.unit.card_usb_prefix if place.bay else place.unit.usb_prefix for place in draw.places}
    if None in units:
        raise NotHereError
    return _info("serial_number", lambda n: 99_000_000 + n % 1_000_000)(draw)


def _unreadable(draw: Draw) -> tuple[Firmware, str]:
    return Says(
        lambda f: f.name == "HW_GET_INFO", lambda f: [f.patched(10, b"\xff\xfe\x80\x01\x02\x03\x04\x05")]
    ), "HW_GET_INFO"


_INFO = frozenset({"identification"})
_ODD = frozenset({"unknown-id"})
RECEPTION = (
    Defect("An unknown id upsets it", _ODD, _upset(_is_unknown)),
    Defect("The packet of an unknown message is read as messages", _ODD, lambda draw: (_NeverLooksAtTheLength(), "")),
    Defect("What it does not know it sends back", _ODD | {"wrong-length"}, lambda draw: (_Parrot(), "")),
    Defect("A packet where none belongs upsets it", frozenset({"wrong-length"}), _upset(_has_odd_length)),
    Defect("A frame that is cut short upsets it", frozenset({"truncated"}), _upset(_is_cut_short)),
    Defect("Rubbish upsets it", frozenset({"garbage"}), _upset(_is_rubbish)),
    Defect("It waits for ever for the rest of a frame", frozenset({"truncated"}), lambda draw: (_WaitsForTheRest(), "")),
    Defect("It fills up a frame with the next one", frozenset({"truncated"}), lambda draw: (_FillsUp(), ""), result=Result.NON_STRICT),
    Defect("It answers to every address", frozenset({"foreign-destination"}), _takes_every_address),
    Defect("It answers to addresses of other units", frozenset({"foreign-destination"}), _takes_documented_addresses, result=Result.NON_STRICT),
    Defect("It takes five messages at a time", frozenset({"back-to-back"}), lambda draw: (_OneAtATime(5), "")),
    Defect("It takes ten messages at a time", frozenset({"back-to-back"}), lambda draw: (_OneAtATime(10), "")),
    Defect("Replies come in another order", frozenset({"back-to-back"}), lambda draw: (_Swaps(), "")),
    Defect("MOD_IDENTIFY is answered", frozenset({"identify"}), _identify_answered),
    Defect("Nothing is heard while the light flashes", frozenset({"identify"}), _identify_upsets),
    Defect("Occupied and empty bays are exchanged", frozenset({"bays"}), _bays(lambda f: f.with_("bay_state", 3 - f["bay_state"]))),
    Defect("Another bay is told", frozenset({"bays"}), _bays(lambda f: f.with_("bay_ident", f["bay_ident"] + 2))),
    Defect("Bays are counted from one", frozenset({"bays"}), _from_one, result=Result.NON_STRICT),
    Defect("An empty bay answers", frozenset({"bays"}), _empty_bay_answers, ("RACK", "BSC103 with an empty bay", "BBD102", "BPC102")),
    Defect("It tells another number of channels", _INFO, _info("nchs", lambda n: n + 1)),
    Defect("Its serial number has seven digits", _INFO, _info("serial_number", lambda n: n // 10)),
    Defect("Its serial number is that of another unit", _INFO, _of_another_unit, result=Result.NON_STRICT),
    Defect("A card says that it is a motherboard", _INFO, _info("type", lambda n: 45)),
    Defect("Its model number cannot be read", _INFO, _unreadable),
)
