"""Firmware with wrong replies: missing, doubled, late, too short, with wrong addresses or contents."""

from __future__ import annotations

from collections.abc import Callable

from firmware_defects import Asked, Change, Defect, Draw, NotHereError, Says, of
from firmware_frames import HOST, ID, Frame, entry
from firmware_line import Firmware

from stagewire_conformance.device.results import Result

_ANYWHERE = of("answers identification frames")


def _always(asked: Asked) -> bool:
    return True


def _has_packet(asked: Asked) -> bool:
    return any(layout["length"] for layout in entry(asked.answer)["layouts"])


def _has_channel(asked: Asked) -> bool:
    return asked.channel is not None


def _is_long(asked: Asked) -> bool:
    """Return whether its packet is too long to be mistaken for that of another message."""
    return any(layout["length"] > 8 for layout in entry(asked.answer)["layouts"])


def _reply(
    seed: int,
    name: str,
    change: Callable[[Draw, Asked], Change],
    allow: Callable[[Asked], bool] = _always,
    result: Result = Result.FAIL,
    found_by: frozenset[str] = _ANYWHERE,
) -> Defect:
    """Return a defect in the reply to one request."""

    def make(draw: Draw) -> tuple[Firmware, str]:
        asked = draw.asked(allow)
        return Says(asked.is_answer, change(draw, asked)), asked.answer

    return Defect(seed, name, found_by, make, result=result)


def _always_so(change: Change) -> Callable[[Draw, Asked], Change]:
    return lambda draw, asked: change


def _other_place(draw: Draw, asked: Asked) -> Change:
    others = [place.address for place in draw.places if place is not asked.place]
    other = draw.random.choice(others or [0x2A])
    return lambda frame: [frame.coming_from(other)]


def _other_channel(draw: Draw, asked: Asked) -> Change:
    other = draw.random.choice([0, asked.channel + 1, 255] if asked.channel else [0])
    return lambda frame: [frame.with_("chan_ident", other)]


def _other_id(draw: Draw, asked: Asked) -> Change:
    """Answer with the id of the request, of the SET, or of another reply."""
    mine = {asked.answer, *(a.answer for a in draw.all_asked() if _form(a) == _form(asked))}
    others = sorted({asked.request, *mine} - {asked.answer})
    other = draw.random.choice(others)
    return lambda frame: [frame.renamed(other)]


def _form(asked: Asked) -> int:
    return max(layout["length"] for layout in entry(asked.answer)["layouts"])


def _unknown_id(draw: Draw, asked: Asked) -> Change:
    unknown = draw.random.choice([id for id in range(0x0800, 0x0F00) if id not in ID.values()])
    return lambda frame: [frame.patched(0, unknown.to_bytes(2, "little"))]


def _longer(draw: Draw, asked: Asked) -> Change:
    more = bytes(draw.random.randrange(1, 200) for _ in range(draw.random.choice((2, 4, 14))))
    return lambda frame: [frame.with_packet(frame.packet + more)]


def _shorter(draw: Draw, asked: Asked) -> Change:
    less = draw.random.choice((1, 2))
    return lambda frame: [frame.with_packet(frame.packet[:-less])]


def _length_in_header(draw: Draw, asked: Asked) -> Change:
    by = draw.random.choice((-2, -1, 1, 2))
    return lambda frame: [frame.patched(2, (len(frame.packet) + by).to_bytes(2, "little"))]


def _two_in_a_row(draw: Draw, asked: Asked) -> Change:
    other = draw.asked(lambda a: a.answer != asked.answer and a.place is asked.place)
    return lambda frame: [frame, frame.renamed(other.answer) if not _has_packet(other) else frame]


class _DropsSome(Firmware):
    """Loses one of a number of replies."""

    def __init__(self, one_in: int) -> None:
        self._one_in = one_in
        self._said = 0

    def says(self, frame: Frame) -> None:
        self._said += 1
        if self._said % self._one_in:
            self.say(frame.raw)


def _drops(draw: Draw) -> tuple[Firmware, str]:
    return _DropsSome(draw.random.choice((30, 40, 50))), ""


class _Late(Says):
    """Sends some messages late."""

    def __init__(self, which: Callable[[Frame], bool], seconds: Callable[[], float]) -> None:
        super().__init__(which, lambda frame: [frame])
        self._seconds = seconds

    def says(self, frame: Frame) -> None:
        self.say(frame.raw, self._seconds() if self._which(frame) else 0.0)


def _too_late(draw: Draw) -> tuple[Firmware, str]:
    asked = draw.asked()
    return _Late(asked.is_answer, lambda: 1.5), asked.answer


def _slow(draw: Draw) -> tuple[Firmware, str]:
    """Exceed the promised time for one reply in ten."""
    random = draw.random
    return _Late(lambda frame: True, lambda: 0.15 if random.random() < 0.1 else 0.001), ""


def _other_channel_answers(draw: Draw) -> tuple[Firmware, str]:
    """Answer for channel 1 whichever channel was requested."""
    asked = draw.asked(lambda a: a.channel == 2)
    return Says(asked.is_answer, lambda frame: [frame.with_("chan_ident", 1)]), asked.answer


def _bays_mixed_up(draw: Draw) -> tuple[Firmware, str]:
    """Exchange the addresses of two bays in replies."""
    bays = [place.address for place in draw.places if place.bay is not None]
    if len(bays) < 2:
        raise NotHereError
    one, other = draw.random.sample(bays, 2)
    swapped = {one: other, other: one}
    return Says(lambda f: f.source in swapped, lambda f: [f.coming_from(swapped[f.source])]), ""


class _AnswersBeforehand(Firmware):
    """Sends the reply to the previous request instead of the current one."""

    def __init__(self) -> None:
        self._last: dict[str, bytes] = {}

    def says(self, frame: Frame) -> None:
        last = self._last.get(frame.name)
        self._last[frame.name] = frame.raw
        self.say(last or frame.raw)


REPLIES = (
    _reply(7, "A request is never answered", _always_so(lambda frame: [])),
    _reply(1, "A request is answered twice", _always_so(lambda frame: [frame, frame])),
    _reply(1, "A reply is too short", _shorter, _has_packet),
    _reply(7, "A reply is longer than documented", _longer, _is_long, Result.NON_STRICT),
    _reply(1, "The header of a reply states another length", _length_in_header, _has_packet),
    _reply(
        12,
        "A reply with a packet lacks the packet flag",
        _always_so(lambda frame: [frame.patched(4, bytes((frame.dest,)))]),
        _has_packet,
    ),
    _reply(1, "A reply comes from another address", _other_place),
    _reply(1, "A reply goes to another address", _always_so(lambda frame: [frame.to(0x2A)])),
    _reply(
        15,
        "A reply keeps the addresses of the request",
        _always_so(lambda frame: [frame.to(frame.source).coming_from(HOST)]),
        result=Result.NON_STRICT,
    ),
    _reply(3, "A reply is about another channel", _other_channel, _has_channel),
    _reply(1, "A reply has the id of another message", _other_id),
    _reply(1, "A reply has an unknown id", _unknown_id),
    _reply(1, "Another message follows a reply", _two_in_a_row),
    Defect(1, "One reply in fifty is lost", _ANYWHERE | {"back-to-back"}, _drops),
    Defect(15, "A reply comes after more than a second", _ANYWHERE, _too_late),
    Defect(11, "Replies take longer than promised", of("timing"), _slow),
    Defect(5, "Channel 2 is answered as channel 1", _ANYWHERE, _other_channel_answers),
    Defect(2, "Two bays are mixed up", _ANYWHERE | {"bays"}, _bays_mixed_up),
)
