"""Firmware whose status is wrong: stale, of another layout, at odds with itself; and whose updates are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping

from firmware_defects import Change, Defect, Draw, NotHereError, Says, Takes
from firmware_frames import HOST, ID, Frame, entry
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

__all__ = ["STATUS"]

_STATUSES = ("MOT_GET_DCSTATUSUPDATE", "MOT_GET_STATUSUPDATE", "PZ_GET_PZSTATUSUPDATE")
_MOTORS = _STATUSES[:2]
_ENDS = ("MOT_MOVE_COMPLETED", "MOT_MOVE_STOPPED")
_ALONE = ("MOT_GET_STATUSBITS", "PZ_GET_PZSTATUSBITS")
_SIGNS = ("MOT_ACK_DCSTATUSUPDATE", "PZ_ACK_PZSTATUSUPDATE")
_LOST = 8  # of ten come
_FIXED = ("BBD101", "BBD102", "BBD103")
_MOVES = frozenset({"move-absolute", "move-relative", "move-jog", "move-velocity", "move-stop"})
_MORE_MOVES = _MOVES | {"move-stored", "move-alone", "home"}


def _bits(name: str) -> Mapping[str, int]:
    """Return the bits of a status by name."""
    layout = entry(name)["layouts"][0]
    flags = next(field["flags"] for field in layout["fields"] if field["name"] == "status_bits")
    assert isinstance(flags, dict)
    return flags


def _status(draw: Draw, *names: str) -> str:
    """Return the status that the unit sends, of some."""
    return draw.one_of(*(names or _STATUSES))


def _told(name: str, found_by: frozenset[str], change: Callable[[str], Change], *which: str) -> Defect:
    """Return a defect in the status, asked for or not."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        status = _status(draw, *which)
        return Says(lambda frame: frame.name == status, change(status)), status

    return Defect(name, found_by, make)


def _bit_set(*wanted: str) -> Callable[[str], Change]:
    """Return a change that sets bits."""

    def change(status: str) -> Change:
        mask = sum(_bits(status)[name] for name in wanted)
        return lambda frame: [frame.with_("status_bits", frame["status_bits"] | mask)]

    return change


def _stuck(*wanted: str, on: bool, found_by: frozenset[str]) -> Callable[[Draw], tuple[Firmware, str]]:
    """Return a status whose bits never change, in every message that has them."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        status = _status(draw, *_MOTORS)
        if any(name not in _bits(status) for name in wanted):
            raise NotHereError
        mask = sum(_bits(status)[name] for name in wanted)

        def change(frame: Frame) -> list[Frame]:
            if "status_bits" not in frame.fields:
                return [frame]
            bits = frame["status_bits"]
            return [frame.with_("status_bits", bits | mask if on else bits & ~mask)]

        return Says(lambda f: f.name in (status, *_ENDS, *_ALONE), change), ""

    return make


def _frozen(field: str) -> Callable[[str], Change]:
    """Return a change that tells for ever what was told first."""

    def change(status: str) -> Change:
        first: dict[tuple[int, int | None], int] = {}

        def again(frame: Frame) -> list[Frame]:
            key = frame.source, frame.channel
            return [frame.with_(field, first.setdefault(key, frame[field]))]

        return again

    return change


def _one_behind(draw: Draw) -> tuple[Firmware, str]:
    """Tell the bits that were there the time before."""
    status = _status(draw, *_MOTORS)
    last: dict[tuple[int, int | None], int] = {}

    def change(frame: Frame) -> list[Frame]:
        key = frame.source, frame.channel
        before = last.get(key, frame["status_bits"])
        last[key] = frame["status_bits"]
        return [frame.with_("status_bits", before)]

    return Says(lambda frame: frame.name == status, change), ""


def _shifted(status: str) -> Change:
    """Pack the status with a field of another width: what follows the position is two bytes later."""
    return lambda frame: [frame.patched(12, frame.raw[10:-2] if len(frame.raw) > 12 else b"")]


def _of_the_other_family(draw: Draw) -> tuple[Firmware, str]:
    """Send the status of a stepper instead of that of a servo, or the other way round."""
    status = _status(draw, *_MOTORS)
    other = _MOTORS[1 - _MOTORS.index(status)]
    return Says(lambda f: f.name == status, lambda f: [f.renamed(other)]), status


def _other_channel(draw: Draw) -> tuple[Firmware, str]:
    status = _status(draw)
    return Says(lambda f: f.name == status, lambda f: [f.with_("chan_ident", 0)]), status


def _at_odds(draw: Draw) -> tuple[Firmware, str]:
    """Tell other bits in the message that has nothing but bits."""
    alone = draw.one_of(*_ALONE)
    mask = 0x400 if alone.startswith("MOT") else 0x11  # homed; actuator connected, zeroed
    return Says(
        lambda f: f.name == alone, lambda f: [f.with_("status_bits", f["status_bits"] ^ mask)]
    ), alone


def _other_position(draw: Draw) -> tuple[Firmware, str]:
    counter = draw.one_of("MOT_GET_POSCOUNTER")
    return Says(
        lambda f: f.name == counter, lambda f: [f.with_("position", f["position"] + 1000)]
    ), counter


# Updates


def _is_update(frame: Frame) -> bool:
    return frame.name in _STATUSES


class _Starts(Firmware):
    """Knows whether updates were started; only then is a status an update."""

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
        """Say an update."""
        self.say(frame.raw)


class _Rate(_Starts):
    """Sends only so many of ten updates, or each of them twice."""

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


def _rate(of_ten: int, *which: str) -> Callable[[Draw], tuple[Firmware, str]]:
    def make(draw: Draw) -> tuple[Firmware, str]:
        if draw.bench.declared.wants_signs and of_ten != _LOST:
            raise NotHereError  # those count what they send
        return _Rate(of_ten), _status(draw, *which)

    return make


class _Ends(_Starts):
    """Sends so many updates and no more."""

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
    return _Ends(draw.random.randrange(45, 200)), _status(draw)


class _StaleUpdates(_Starts):
    """Sends in every update what the first one said; when it is asked it tells the truth."""

    def __init__(self) -> None:
        super().__init__()
        self._first: dict[tuple[int, int | None], bytes] = {}

    def updates(self, frame: Frame) -> None:
        self.say(self._first.setdefault((frame.source, frame.channel), frame.raw))


class _UpdatesOf(_Starts):
    """Sends updates from the motherboard, and not from the bay that they are about."""

    def updates(self, frame: Frame) -> None:
        self.say(frame.coming_from(0x11).raw)


def _updates_of_the_rack(draw: Draw) -> tuple[Firmware, str]:
    if all(place.bay is None for place in draw.places):
        raise NotHereError
    return _UpdatesOf(), _status(draw)


def _dropped(*names: str, about: str = "") -> Callable[[Draw], tuple[Firmware, str]]:
    def make(draw: Draw) -> tuple[Firmware, str]:
        name = draw.one_of(*names)
        return Takes(lambda frame: frame.name == name, lambda frame: []), about or name

    return make


class _Chatters(Firmware):
    """Sends a status now and then that nobody asked for."""

    def __init__(self, status: str, place: int) -> None:
        self._raw = b""
        self._next = 0.0
        self._is_mine = lambda f: f.name == status and f.source == place

    def says(self, frame: Frame) -> None:
        if self._is_mine(frame):
            self._raw = frame.raw
        self.say(frame.raw)

    def takes(self, frame: Frame) -> None:
        self.pass_on(frame.raw)
        if self._raw and self.now() >= self._next:
            self._next = self.now() + 0.1
            self.say(self._raw, after=0.01)


def _unasked(draw: Draw) -> tuple[Firmware, str]:
    """Send an answer to nothing, every 0.3 s."""
    asked = draw.asked(lambda a: not entry(a.answer)["exchange"])
    raw = draw.present(asked).raw

    class Chatters(Firmware):
        def begins(self) -> None:
            for number in range(600):
                self.say(raw, after=0.3 * (number + 1))

    return Chatters(), asked.answer


# Signs of life


def _not_heeded(draw: Draw) -> tuple[Firmware, str]:
    """Take no notice of signs of life: fall silent all the same."""
    sign = draw.one_of(*_SIGNS)
    return Takes(lambda frame: frame.name == sign, lambda frame: []), ""


class _NeverSilent(Firmware):
    """Goes on without signs of life: gives them to itself."""

    def __init__(self, signs: list[bytes]) -> None:
        self._signs = signs

    def says(self, frame: Frame) -> None:
        self.say(frame.raw)
        for sign in self._signs:
            self.pass_on(sign)


def _never_silent(draw: Draw) -> tuple[Firmware, str]:
    return _NeverSilent(_all_signs(draw)), ""


def _all_signs(draw: Draw) -> list[bytes]:
    """Return a sign of life for every place that takes one."""
    sign = draw.one_of(*_SIGNS)
    places = [place.address for place in draw.places if sign in place.messages and place.keep_alive]
    if not places or not draw.bench.declared.wants_signs:
        raise NotHereError
    id = ID[sign].to_bytes(2, "little")
    return [id + bytes((0, 0, place, HOST)) for place in places]


class _SilentSoon(_Starts):
    """Falls silent after twenty messages without a sign of life."""

    def __init__(self) -> None:
        super().__init__()
        self._since = 0

    def takes(self, frame: Frame) -> None:
        if frame.name in _SIGNS:
            self._since = 0
        super().takes(frame)

    def updates(self, frame: Frame) -> None:
        self._since += 1
        if self._since <= 20:
            self.say(frame.raw)


def _silent_soon(draw: Draw) -> tuple[Firmware, str]:
    _all_signs(draw)
    return _SilentSoon(), ""


def _sign_answered(draw: Draw) -> tuple[Firmware, str]:
    _all_signs(draw)

    class Confirms(Firmware):
        def takes(self, frame: Frame) -> None:
            self.pass_on(frame.raw)
            if frame.name in _SIGNS:
                self.say(frame.to(HOST).coming_from(frame.dest).raw)

    return Confirms(), ""


def _never_back(draw: Draw) -> tuple[Firmware, str]:
    """Stay silent for ever once it has fallen silent."""
    _all_signs(draw)

    class Sulks(_SilentSoon):
        def takes(self, frame: Frame) -> None:
            super(_SilentSoon, self).takes(frame)
            if frame.name in _SIGNS and self._since <= 45:
                self._since = 0

        def updates(self, frame: Frame) -> None:
            self._since += 1
            if self._since <= 45:
                self.say(frame.raw)

    return Sulks(), ""


_STATE = frozenset({"status"})
_UPDATES = frozenset({"updates"})
_ALIVE = frozenset({"keep-alive"})
STATUS = (
    Defect(
        "Both limit switches are told to be active", _STATE,
        _told("", _STATE, _bit_set("forward_hardware_limit", "reverse_hardware_limit"), *_MOTORS).make,
        result=Result.NON_STRICT,
    ),
    _told("The status says that it moves both ways", _STATE, _bit_set("moving_forward", "moving_reverse"), *_MOTORS),
    Defect("The moving bit is stuck on", _STATE, _stuck("moving_forward", on=True, found_by=_STATE)),
    Defect(
        "The moving bits are never set", _MORE_MOVES,
        _stuck(
            "moving_forward", "moving_reverse", "jogging_forward", "jogging_reverse", on=False,
            found_by=_MOVES,
        ),
    ),
    Defect("The homed bit is never set", frozenset({"home"}), _stuck("homed", on=False, found_by=_MOVES)),
    Defect("The homing bit is never set", frozenset({"home"}), _stuck("homing", on=False, found_by=_MOVES)),
    Defect(
        "The limit bits are never set", frozenset({"limits"}),
        _stuck("forward_hardware_limit", "reverse_hardware_limit", on=False, found_by=_MOVES),
        ("TDC001", "TST001", "OST001", "ODC001", "BSC002", "BSC102"),
    ),
    Defect(
        "The enabled bit is never set", _STATE | {"enable"},
        _stuck("channel_enabled", on=False, found_by=_STATE),
    ),
    _told("The position in the status is stale", _STATE | {"counters"}, _frozen("position"), *_MOTORS),
    _told("The bits in the status are stale", _STATE | _MORE_MOVES, _frozen("status_bits"), *_MOTORS),
    Defect("The status is one behind", _STATE | _MORE_MOVES, _one_behind),
    _told("A field of the status has another width", _STATE | {"answers"} | _MORE_MOVES, _shifted, *_MOTORS),
    Defect("The status is that of another family", _STATE | {"answers"}, _of_the_other_family),
    Defect("The status is about channel 0", _STATE | {"answers", "updates"}, _other_channel),
    Defect("Two messages tell different status bits", _STATE, _at_odds),
    Defect("The counter tells another position than the status", _STATE, _other_position),
    Defect("Updates come five times a second", _UPDATES, _rate(5), result=Result.NON_STRICT),
    Defect("Updates come twenty times a second", _UPDATES, _rate(20, *_MOTORS), result=Result.NON_STRICT),
    Defect("One update in six is lost", _UPDATES, _rate(_LOST), _FIXED),
    Defect("Updates end by themselves", _UPDATES | _ALIVE, _ends),
    Defect("Updates cannot be started", _UPDATES | _STATE, _dropped("HW_START_UPDATEMSGS")),
    Defect("Updates cannot be stopped", _UPDATES, _dropped("HW_STOP_UPDATEMSGS")),
    Defect("Updates come from the motherboard", _UPDATES, _updates_of_the_rack),
    Defect("Something comes that nobody asked for", frozenset({"quiet"}), _unasked),
    Defect("Signs of life are not heeded", _UPDATES | _ALIVE, _not_heeded),
    Defect("It goes on without signs of life", _ALIVE, _never_silent),
    Defect("It falls silent after twenty messages", _ALIVE, _silent_soon),
    Defect("Signs of life are answered", _ALIVE | {"identify"}, _sign_answered),
    Defect("It stays silent once it has fallen silent", _ALIVE, _never_back),
    Defect("Updates say for ever what the first one said", frozenset({"move-updates"}), lambda draw: (_StaleUpdates(), _status(draw, *_MOTORS))),
)
