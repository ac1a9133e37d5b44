"""Firmware with undocumented values, counters that cannot be set, and corrupted saved values."""

from __future__ import annotations

from faulty_settings import NUMBERS, a_setting
from firmware_defects import (
    Change,
    Deaf,
    Defect,
    Draw,
    Echoes,
    NotHereError,
    Says,
    Takes,
    named,
    of,
)
from firmware_frames import Frame, entry
from firmware_line import Firmware

_SAVING = ("MOT_SET_EEPROMPARAMS", "PZ_SET_EEPROMPARAMS")


def _not_zero(draw: Draw) -> tuple[Firmware, str]:
    """Report a start velocity, which is always zero by definition."""
    asked = draw.asked(lambda a: a.answer in ("MOT_GET_VELPARAMS", "MOT_GET_JOGPARAMS"))
    name = "min_velocity" if "VEL" in asked.answer else "jog_min_velocity"
    return Says(asked.is_answer, lambda frame: [frame.with_(name, 1000)]), asked.answer


def _beyond_its_range(draw: Draw) -> tuple[Firmware, str]:
    """Report an undocumented value: out of range, or not in the enumeration."""
    ranged = []
    for asked in draw.all_asked():
        for field in draw.present(asked).fields.values():
            if (
                field["kind"] != "integer"
                or field["role"] != "value"
                or field["name"] == "chan_ident"
            ):
                continue
            top = (1 << 8 * field["size"] - field["signed"]) - 1
            closed = "enum" in field and not field.get("open")
            if closed or field["maximum"] < top:
                ranged.append((asked, field["name"], top))
    if not ranged:
        raise NotHereError
    asked, name, top = draw.random.choice(ranged)
    return Says(asked.is_answer, lambda frame: [frame.with_(name, top)]), asked.answer


def _counter(seed: int, name: str, change: Change) -> Defect:
    def make(draw: Draw) -> tuple[Firmware, str]:
        setter = draw.one_of("MOT_SET_POSCOUNTER", "MOT_SET_ENCCOUNTER")
        return Takes(named(setter), change), setter

    return Defect(seed, name, of("counters"), make)


def _field_of_counter(frame: Frame) -> str:
    return next(name for name in frame.fields if name != "chan_ident")


def _saving_spoils(draw: Draw) -> tuple[Firmware, str]:
    """Corrupt a value when parameters are saved."""
    saving = draw.one_of(*_SAVING)
    setting = a_setting(draw, NUMBERS, lambda s: entry(s.set)["effect"] == "settings")
    whole = draw.present(setting.asked).renamed(setting.set).to(setting.asked.place.address)
    spoilt = whole.coming_from(1).with_(setting.name, setting.present ^ 1)

    class Spoils(Firmware):
        def takes(self, frame: Frame) -> None:
            self.pass_on(frame.raw)
            same = frame.channel in (None, setting.asked.channel or frame.channel)
            if frame.name == saving and same and frame.place == setting.asked.place.address:
                self.pass_on(spoilt.raw)

    return Spoils(), saving


def _saving_answered(draw: Draw) -> tuple[Firmware, str]:
    saving = draw.one_of(*_SAVING)
    return Echoes(named(saving)), saving


def _saving_takes_its_time(draw: Draw) -> tuple[Firmware, str]:
    saving = draw.one_of(*_SAVING)
    return Deaf(named(saving), 2.0), saving


STORAGE = (
    Defect(6, "A start velocity is not zero", of("answers readback"), _not_zero),
    Defect(8, "A value is told that is beyond its range", of("answers"), _beyond_its_range),
    _counter(1, "A counter cannot be set", lambda frame: []),
    _counter(
        1,
        "A counter loses its sign",
        lambda f: [f.with_(_field_of_counter(f), abs(f[_field_of_counter(f)]))],
    ),
    Defect(1, "Saving is answered", of("eeprom"), _saving_answered),
    Defect(1, "Saving spoils a value", of("eeprom"), _saving_spoils),
    Defect(7, "Messages are lost while parameters are saved", of("eeprom"), _saving_takes_its_time),
)
