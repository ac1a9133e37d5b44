"""Firmware with wrong identification, wrong bay states, or a wrong reaction to MOD_IDENTIFY."""

from __future__ import annotations

from collections.abc import Callable

from firmware_defects import Deaf, Defect, Draw, Echoes, NotHereError, Says, named, of
from firmware_frames import Frame
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

_INFO = "HW_GET_INFO"
_IS_USED = "RACK_REQ_BAYUSED"
_USED = "RACK_GET_BAYUSED"
_IDENTIFY = "MOD_IDENTIFY"
_SAYS = "identification"
_WITH_EMPTY_BAYS = ("RACK", "BSC103 with an empty bay", "BBD102", "BPC102")


def _bays(change: Callable[[Frame], Frame]) -> Callable[[Draw], tuple[Firmware, str]]:
    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims(_IS_USED)
        if all(place.bay is None for place in draw.places):
            raise NotHereError
        return Says(named(_USED), lambda frame: [change(frame)]), _USED

    return make


def _exchanged(frame: Frame) -> Frame:
    """Exchange the states of a bay: occupied (1) and empty (2)."""
    return frame.with_("bay_state", 3 - frame["bay_state"])


def _from_one(draw: Draw) -> tuple[Firmware, str]:
    draw.claims(_IS_USED)

    class CountsFromOne(Firmware):
        def takes(self, frame: Frame) -> None:
            if frame.name != _IS_USED:
                self.pass_on(frame.raw)
            elif frame["bay_ident"]:
                self.pass_on(frame.with_("bay_ident", frame["bay_ident"] - 1).raw)
            else:  # there is no such bay
                self.pass_on(frame.with_("bay_ident", 9).raw)  # an empty one

        def says(self, frame: Frame) -> None:
            counts = frame.name == _USED
            ident = (frame["bay_ident"] + 1) % 10 if counts else 0
            self.say(frame.with_("bay_ident", ident).raw if counts else frame.raw)

    return CountsFromOne(), _USED


def _empty_bay_answers(draw: Draw) -> tuple[Firmware, str]:
    """Answer for an empty bay."""
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
            lambda f: f.name == _INFO and f.source == place.address,
            lambda f: [f.with_(field, change(f[field]))],
        ), _INFO

    return make


def _of_another_unit(draw: Draw) -> tuple[Firmware, str]:
    units = {
        place.unit.card_usb_prefix if place.bay else place.unit.usb_prefix for place in draw.places
    }
    if None in units:
        raise NotHereError
    return _info("serial_number", lambda n: 99_000_000 + n % 1_000_000)(draw)


def _unreadable(draw: Draw) -> tuple[Firmware, str]:
    return Says(
        lambda f: f.name == _INFO,
        lambda f: [f.patched(10, b"\xff\xfe\x80\x01\x02\x03\x04\x05")],
    ), _INFO


def _identify_answered(draw: Draw) -> tuple[Firmware, str]:
    draw.claims(_IDENTIFY)
    return Echoes(named(_IDENTIFY)), _IDENTIFY


def _identify_upsets(draw: Draw) -> tuple[Firmware, str]:
    draw.claims(_IDENTIFY)
    return Deaf(named(_IDENTIFY), 3.0), _IDENTIFY


IDENTITY = (
    Defect(1, "MOD_IDENTIFY is answered", of("identify"), _identify_answered),
    Defect(1, "Messages are lost while the light flashes", of("identify"), _identify_upsets),
    Defect(6, "Occupied and empty bays are exchanged", of("bays"), _bays(_exchanged)),
    Defect(8, "Another bay is reported", of("bays"),
           _bays(lambda f: f.with_("bay_ident", f["bay_ident"] + 2))),
    Defect(14, "Bays are counted from one", of("bays"), _from_one, result=Result.NON_STRICT),
    Defect(3, "An empty bay answers", of("bays"), _empty_bay_answers, _WITH_EMPTY_BAYS),
    Defect(2, "It reports another number of channels", of(_SAYS), _info("nchs", lambda n: n + 1)),
    Defect(10, "Its serial number has seven digits", of(_SAYS), _info("serial_number", lambda n: n // 10)),
    Defect(6, "Its serial number is of another unit", of(_SAYS), _of_another_unit, result=Result.NON_STRICT),
    Defect(15, "A card reports to be a motherboard", of(_SAYS), _info("type", lambda n: 45)),
    Defect(1, "Its model number is unreadable", of(_SAYS), _unreadable),
)  # fmt: skip
