"""Firmware with wrong updates (too many, too few, stale) or a wrong reaction to keep-alive messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from firmware_defects import Defect, Draw, Echoes, NotHereError, Takes, named, of
from firmware_frames import HOST, ID, Frame, entry
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

_MOTORS = ("MOT_GET_DCSTATUSUPDATE", "MOT_GET_STATUSUPDATE")
_STATUSES = (*_MOTORS, "PZ_GET_PZSTATUSUPDATE")
_QUESTIONS = ("MOT_REQ_DCSTATUSUPDATE", "MOT_REQ_STATUSUPDATE")
_SIGNS = ("MOT_ACK_DCSTATUSUPDATE", "PZ_ACK_PZSTATUSUPDATE")
_LOST = 8
"""The number of updates out of ten that remain when some are lost."""
_FIXED = ("BBD101", "BBD102", "BBD103")
"""Units with a documented fixed rate."""


def _is_update(frame: Frame) -> bool:
    return frame.name in _STATUSES


class _Starts(Firmware):
    """Tracks whether updates were started, because only then is a status an update."""

    def __init__(self) -> None:
        self.on = False
        self.count = 0

    def takes(self, frame: Frame) -> None:
        self.on = (self.on or frame.name == "HW_START_UPDATEMSGS") and (
            frame.name != "HW_STOP_UPDATEMSGS"
        )
        self.pass_on(frame.raw)

    def says(self, frame: Frame) -> None:
        if self.on and _is_update(frame):
            self.count += 1
            self.updates(frame)
        else:
            self.say(frame.raw)

    def updates(self, frame: Frame) -> None:
        """Handle an update."""
        self.say(frame.raw)


class _Rate(_Starts):
    """Sends only some of ten updates, or each of them twice."""

    def __init__(self, of_ten: int) -> None:
        super().__init__()
        self._of_ten = of_ten
        self._counts: Counter[tuple[int, int | None]] = Counter()

    def updates(self, frame: Frame) -> None:
        key = frame.source, frame.channel
        self._counts[key] += 1
        if self._of_ten > 10:
            self.say(frame.raw)
            self.say(frame.raw, after=0.05)
        elif self._counts[key] * self._of_ten % 10 < self._of_ten:
            self.say(frame.raw)


def _rate(
    of_ten: int, which: tuple[str, ...] = _STATUSES
) -> Callable[[Draw], tuple[Firmware, str]]:
    def make(draw: Draw) -> tuple[Firmware, str]:
        status = draw.one_of(*which)
        if draw.bench.declared.wants_signs and of_ten != _LOST:
            raise NotHereError  # these units count their updates
        return _Rate(of_ten), status

    return make


class _Ends(_Starts):
    """Sends a number of updates and then stops."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self._most = most

    def takes(self, frame: Frame) -> None:
        if frame.name == "HW_START_UPDATEMSGS":
            self.count = 0
        super().takes(frame)

    def updates(self, frame: Frame) -> None:
        if self.count <= self._most:
            self.say(frame.raw)


def _ends(draw: Draw) -> tuple[Firmware, str]:
    _all_signs(draw)
    return _Ends(draw.random.randrange(45, 95)), draw.one_of(*_STATUSES)


class _StaleUpdates(_Starts):
    """Repeats the first update for ever, but answers requests correctly."""

    def __init__(self) -> None:
        super().__init__()
        self._first: dict[tuple[int, int | None], bytes] = {}
        self._asked = 0

    def takes(self, frame: Frame) -> None:
        self._asked += frame.name in _QUESTIONS
        super().takes(frame)

    def says(self, frame: Frame) -> None:
        if self._asked and _is_update(frame):
            self._asked -= 1
            self.say(frame.raw)
        else:
            super().says(frame)

    def updates(self, frame: Frame) -> None:
        self.say(self._first.setdefault((frame.source, frame.channel), frame.raw))


class _OfTheRack(_Starts):
    """Sends updates from the motherboard instead of the bay."""

    def updates(self, frame: Frame) -> None:
        self.say(frame.coming_from(0x11).raw)


def _updates_of_the_rack(draw: Draw) -> tuple[Firmware, str]:
    if all(place.bay is None for place in draw.places):
        raise NotHereError
    return _OfTheRack(), draw.one_of(*_STATUSES)


def _unasked(draw: Draw) -> tuple[Firmware, str]:
    """Send an unsolicited reply every 0.3 s."""
    asked = draw.asked(lambda a: not entry(a.answer)["exchange"])
    raw = draw.present(asked).raw

    class Chatters(Firmware):
        def begins(self) -> None:
            for number in range(1, 600):
                self.say(raw, after=0.3 * number)

    return Chatters(), asked.answer


def _dropped(name: str) -> Callable[[Draw], tuple[Firmware, str]]:
    def make(draw: Draw) -> tuple[Firmware, str]:
        draw.claims(name)
        return Takes(named(name), lambda frame: []), name

    return make


# Keep-alive messages


def _not_heeded(draw: Draw) -> tuple[Firmware, str]:
    """Fall silent despite keep-alive messages."""
    _all_signs(draw)
    return Takes(named(*_SIGNS), lambda frame: []), ""


def _answered(draw: Draw) -> tuple[Firmware, str]:
    _all_signs(draw)
    return Echoes(named(*_SIGNS)), ""


class _NeverSilent(Firmware):
    """Needs no keep-alive messages: it generates them internally."""

    def __init__(self, signs: list[bytes]) -> None:
        self._signs = signs

    def says(self, frame: Frame) -> None:
        self.say(frame.raw)
        for sign in self._signs:
            self.pass_on(sign)


def _never_silent(draw: Draw) -> tuple[Firmware, str]:
    return _NeverSilent(_all_signs(draw)), ""


def _all_signs(draw: Draw) -> list[bytes]:
    """Return a keep-alive message for every place that has one."""
    sign = draw.one_of(*_SIGNS)
    places = [place.address for place in draw.places if sign in place.messages and place.keep_alive]
    if not places or not draw.bench.declared.wants_signs:
        raise NotHereError
    id = ID[sign].to_bytes(2, "little")
    return [id + bytes((0, 0, place, HOST)) for place in places]


class _Silent(_Starts):
    """Falls silent after some messages without a keep-alive message.

    :param most: the number of messages.
    :param again: whether it continues after a later keep-alive message.
    """

    def __init__(self, most: int, *, again: bool) -> None:
        super().__init__()
        self._most = most
        self._again = again
        self._since = 0

    def takes(self, frame: Frame) -> None:
        if frame.name in _SIGNS and (self._again or self._since <= self._most):
            self._since = 0
        super().takes(frame)

    def updates(self, frame: Frame) -> None:
        self._since += 1
        if self._since <= self._most:
            self.say(frame.raw)


def _silent(most: int, *, again: bool) -> Callable[[Draw], tuple[Firmware, str]]:
    def make(draw: Draw) -> tuple[Firmware, str]:
        _all_signs(draw)
        return _Silent(most, again=again), ""

    return make


def _stale(draw: Draw) -> tuple[Firmware, str]:
    draw.moves()
    return _StaleUpdates(), draw.one_of(*_MOTORS)


UPDATES = (
    Defect(12, "Updates come five times a second", of("updates"), _rate(5), result=Result.NON_STRICT),
    Defect(5, "Updates come twenty times a second", of("updates"), _rate(20, _MOTORS),
           result=Result.NON_STRICT),
    Defect(6, "Two updates in ten are lost", of("updates"), _rate(_LOST), _FIXED),
    Defect(11, "Updates end by themselves", of("updates keep-alive"), _ends),
    Defect(1, "Updates cannot be started", of("updates status"), _dropped("HW_START_UPDATEMSGS")),
    Defect(8, "Updates cannot be stopped", of("updates"), _dropped("HW_STOP_UPDATEMSGS")),
    Defect(10, "Updates come from the motherboard", of("updates"), _updates_of_the_rack),
    Defect(1, "Updates say for ever what the first one said", of("move-updates"), _stale),
    Defect(1, "Unsolicited messages are sent", of("quiet"), _unasked),
    Defect(1, "Keep-alive messages are ignored", of("updates keep-alive"), _not_heeded),
    Defect(1, "Keep-alive messages are answered", of("keep-alive-reply identify"), _answered),
    Defect(4, "It continues without keep-alive messages", of("keep-alive"), _never_silent),
    Defect(1, "It falls silent after twenty messages", of("keep-alive"), _silent(20, again=True)),
    Defect(1, "It stays silent once it has fallen silent", of("keep-alive"), _silent(45, again=False)),
)  # fmt: skip
