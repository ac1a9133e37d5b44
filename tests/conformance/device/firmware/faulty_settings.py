"""Firmware that stores settings wrongly: not at all, elsewhere, truncated, or with another byte order."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from firmware_defects import Asked, Change, Defect, Draw, Echoes, NotHereError, Says, Takes, of
from firmware_frames import Frame, entry
from firmware_line import Firmware

from stagewire_conformance.device.checks.apt.settings.care import CARE, How
from stagewire_conformance.device.results import Result

_READ_BACK = of("readback loops")
NUMBERS = (How.NEAR, How.LOWER, How.HIGHER)


@dataclass(frozen=True)
class Setting:
    """A field of a parameter set, on one channel.

    :param asked: the request that reads it.
    :param set: the message that sets it.
    :param field: the field, as in the registry.
    :param present: its value after power-on.
    """

    asked: Asked
    set: str
    field: dict[str, object]
    present: int

    @property
    def name(self) -> str:
        """The name of the field."""
        return str(self.field["name"])

    def is_set(self, frame: Frame) -> bool:
        """Return whether a message sets this field on this channel."""
        mine = frame.name == self.set and frame.place == self.asked.place.address
        return mine and (self.asked.channel is None or frame.channel == self.asked.channel)


def _settings(draw: Draw, hows: Iterable[How] = ()) -> list[Setting]:
    """Return every field that a check may change, including those that affect a control loop."""
    found = []
    for asked in draw.all_asked():
        owner = entry(asked.answer)["set"]
        care = CARE.get(owner["name"]) if owner and owner["role"] == "get" else None
        if care is None or care.doubtful or (care.first_channel and asked.channel != 1):
            continue
        setter = entry(asked.answer)["name"].replace("_GET_", "_SET_")
        said = draw.present(asked)
        for name, varied in care.fields.items():
            if name in said.fields and (not hows or varied.how in hows) and not varied.advised:
                found.append(Setting(asked, setter, said.fields[name], said[name]))
    return found


def a_setting(
    draw: Draw, hows: Iterable[How] = (), allow: Callable[[Setting], bool] = lambda s: True
) -> Setting:
    found = [setting for setting in _settings(draw, hows) if allow(setting)]
    if not found:
        raise NotHereError
    return draw.random.choice(found)


def _taken(
    seed: int,
    name: str,
    change: Callable[[Setting], Change],
    hows: Iterable[How] = (),
    allow: Callable[[Setting], bool] = lambda s: True,
    result: Result = Result.FAIL,
) -> Defect:
    """Return a defect in the effect of a SET."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        setting = a_setting(draw, hows, allow)
        return Takes(setting.is_set, change(setting)), setting.set

    return Defect(seed, name, _READ_BACK, make, result=result)


def _is_wide(setting: Setting) -> bool:
    """Return whether its values need more than half of its bytes."""
    return setting.field["size"] == 4 and abs(setting.present) > 0x2_0000


def _turns_round(setting: Setting) -> bool:
    size = int(str(setting.field["size"]))
    data = (setting.present % (1 << 8 * size)).to_bytes(size, "little")
    return size > 1 and data != data[::-1]


def _reversed(setting: Setting) -> Change:
    size = int(str(setting.field["size"]))

    def change(frame: Frame) -> list[Frame]:
        data = (frame[setting.name] % (1 << 8 * size)).to_bytes(size, "big")
        return [frame.with_(setting.name, int.from_bytes(data, "little"))]

    return change


def _off_by_one(setting: Setting) -> Change:
    return lambda frame: [frame.with_(setting.name, frame[setting.name] + 1)]


def _half(setting: Setting) -> Change:
    return lambda frame: [frame.with_(setting.name, frame[setting.name] & 0xFFFF)]


def _kept(setting: Setting) -> Change:
    return lambda frame: [frame.with_(setting.name, setting.present)]


def _rounded(setting: Setting) -> Change:
    step = max(2, abs(setting.present) // 64)
    return lambda frame: [frame.with_(setting.name, frame[setting.name] // step * step)]


def _can_be_rounded(setting: Setting) -> bool:
    step = max(2, abs(setting.present) // 64)
    if setting.name.endswith("velocity"):
        return False  # a slow velocity becomes 0, so that nothing moves
    return abs(setting.present) > 4096 and setting.present % step == 0


def _swapped(draw: Draw) -> tuple[Firmware, str]:
    """Exchange two fields of one size when written, but not when read."""
    setting = a_setting(draw, NUMBERS)
    others = [
        other
        for other in _settings(draw, NUMBERS)
        if other.asked == setting.asked
        and other.name != setting.name
        and other.field["size"] == setting.field["size"]
        and other.present != setting.present
    ]
    if not others:
        raise NotHereError
    other = draw.random.choice(others)

    def change(frame: Frame) -> list[Frame]:
        one, two = frame[setting.name], frame[other.name]
        return [frame.with_(setting.name, two).with_(other.name, one)]

    return Takes(setting.is_set, change), setting.set


def _bit(draw: Draw, *, stuck: bool) -> tuple[Firmware, str]:
    setting = a_setting(draw, (How.BITS,))
    masks = setting.field["flags"]
    assert isinstance(masks, dict)
    mask = draw.random.choice(
        [mask for mask in masks.values() if bool(mask & setting.present) is stuck]
        or [next(iter(masks.values()))]
    )

    def change(frame: Frame) -> list[Frame]:
        value = frame[setting.name]
        return [frame.with_(setting.name, value | mask if stuck else value & ~mask)]

    return Takes(setting.is_set, change), setting.set


def _has_several(setting: Setting) -> bool:
    """Return whether a check writes several values of an enumeration; of switches it writes two."""
    values = setting.field.get("enum")
    return isinstance(values, dict) and len(values) > 2 and "LIMSWITCH" not in setting.set


def _one_value(draw: Draw) -> tuple[Firmware, str]:
    """Refuse one of the documented values."""
    setting = a_setting(draw, (How.LISTED,), _has_several)
    values = setting.field["enum"]
    assert isinstance(values, dict)
    refused = draw.random.choice([v for v in values.values() if v not in (setting.present, 0x80)])

    def change(frame: Frame) -> list[Frame]:
        is_refused = frame[setting.name] == refused
        return [frame.with_(setting.name, setting.present) if is_refused else frame]

    return Takes(setting.is_set, change), setting.set


def _elsewhere(draw: Draw, *, bays: bool) -> tuple[Firmware, str]:
    """Also set it in another bay or on another channel."""
    setting = a_setting(draw)
    asked = setting.asked
    if bays:
        if "LOOP" in setting.set:  # changed only while a channel is disabled, one bay at a time
            raise NotHereError
        others = [p.address for p in draw.places if p.bay and p is not asked.place]
        others = [a for a in others if setting.set in _messages_at(draw, a)]
    else:
        others = [channel for channel in asked.place.channels if channel != asked.channel]
    if not others or (asked.channel is None and not bays):
        raise NotHereError
    other = draw.random.choice(others)

    def change(frame: Frame) -> list[Frame]:
        return [frame, frame.to(other) if bays else frame.with_("chan_ident", other)]

    return Takes(setting.is_set, change), setting.set


def _messages_at(draw: Draw, address: int) -> frozenset[str]:
    return next(place.messages for place in draw.places if place.address == address)


def _answered(draw: Draw) -> tuple[Firmware, str]:
    """Answer a SET with an unsolicited GET."""
    setting = a_setting(draw)
    return Echoes(setting.is_set, setting.asked.answer), setting.set


def _one_late(draw: Draw) -> tuple[Firmware, str]:
    """Apply a SET only after the next message has arrived."""
    setting = a_setting(draw)

    class Hesitates(Firmware):
        def __init__(self) -> None:
            self._waiting = b""

        def takes(self, frame: Frame) -> None:
            waiting, self._waiting = self._waiting, b""
            if setting.is_set(frame):
                self._waiting = frame.raw
            else:
                self.pass_on(frame.raw)
            if waiting:
                self.pass_on(waiting)

    return Hesitates(), setting.set


def _as_it_woke(draw: Draw) -> tuple[Firmware, str]:
    """Always report the value after power-on."""
    setting = a_setting(draw)
    first: dict[bytes, Frame] = {}
    return Says(
        setting.asked.is_answer, lambda frame: [first.setdefault(frame.raw[4:8], frame)]
    ), setting.asked.answer


def _neighbour(draw: Draw) -> tuple[Firmware, str]:
    """Also write into the next parameter set, as with a wrong address in memory."""
    setting = a_setting(draw)
    others = [
        other
        for other in _settings(draw, NUMBERS)
        if other.asked.place is setting.asked.place
        and other.asked.channel == setting.asked.channel
        and other.set != setting.set
        and entry(other.set)["effect"] == "settings"
    ]
    if not others:
        raise NotHereError
    other = draw.random.choice(others)
    whole = draw.present(other.asked).renamed(other.set).to(other.asked.place.address)
    spoilt = whole.coming_from(1)

    class Spills(Firmware):
        def __init__(self) -> None:
            self._written = 0

        def takes(self, frame: Frame) -> None:
            self.pass_on(frame.raw)
            if setting.is_set(frame):
                self._written += 1
                self.pass_on(spoilt.with_(other.name, other.present + self._written % 3).raw)

    return Spills(), setting.set


SETTINGS = (
    _taken(1, "A SET is ignored", lambda setting: lambda frame: []),
    _taken(1, "One value of a SET is not stored", _kept),
    _taken(10, "A value is off by one", _off_by_one, NUMBERS),
    _taken(1, "A value is stored with the wrong byte order", _reversed, NUMBERS, _turns_round),
    _taken(1, "Only half of the bytes of a value are stored", _half, NUMBERS, _is_wide),
    _taken(10, "A value is rounded", _rounded, NUMBERS, _can_be_rounded, Result.NON_STRICT),
    Defect(1, "Two values of a SET are exchanged", _READ_BACK, _swapped),
    Defect(1, "A bit of a mask is lost", _READ_BACK, partial(_bit, stuck=False), ("TDC001",)),
    Defect(1, "A bit of a mask is stuck", _READ_BACK, partial(_bit, stuck=True), ("TDC001",)),
    Defect(2, "A documented value is refused", _READ_BACK, _one_value, result=Result.NON_STRICT),
    Defect(9, "A SET also sets another channel", of("channels"), partial(_elsewhere, bays=False)),
    Defect(3, "A SET also sets another bay", of("bays-apart"), partial(_elsewhere, bays=True)),
    Defect(1, "A SET is answered", _READ_BACK, _answered),
    Defect(12, "A SET takes effect one message late", _READ_BACK, _one_late),
    Defect(11, "A GET always repeats its first value", _READ_BACK, _as_it_woke),
    Defect(1, "A SET writes into another parameter set", _READ_BACK, _neighbour),
)  # fmt: skip
