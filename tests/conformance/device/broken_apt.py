"""Defective Thorlabs APT controllers, each with the check that finds it and a part of the finding."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from faulty_apt_link import (
    DATA_FLAG,
    Change,
    LinkFault,
    byte,
    dropped,
    every,
    flip,
    followed_by,
    frame,
    from_the,
    name_of,
    of,
    of_source,
    plus,
    renamed,
    shorter,
    twice,
)

from stagewire_conformance.device.results import Result

FAIL, NON_STRICT, FRAGILE = Result.FAIL, Result.NON_STRICT, Result.FRAGILE


class Broken(NamedTuple):
    """A defective controller.

    :param unit: the name of the unit.
    :param spoil: the fault on the line. Use it only once, because some faults count.
    :param where: the id of the check that finds it.
    :param words: a part of the finding.
    """

    unit: str
    spoil: LinkFault
    where: str
    result: Result
    words: str


def sends(names: str, change: Change) -> LinkFault:
    """Change messages that the controller sends."""
    return LinkFault(to_host=of(names, change))


def takes(change: Change) -> LinkFault:
    """Change messages that the controller receives."""
    return LinkFault(to_controller=change)


def takes_of(name: str, change: Change) -> LinkFault:
    """Change certain messages that the controller receives."""
    return LinkFault(to_controller=of(name, change))


def longer(raw: bytes) -> bytes:
    """Send six more bytes than documented, with a matching length in the header."""
    return raw[:2] + len(raw).to_bytes(2, "little") + raw[4:] + bytes(range(6))


def by_host(name: str, channel: int = 0, dest: int = 0x50) -> bytes:
    """Return a header from the host."""
    return frame(name, channel, dest=dest, source=1)


def locked_by(what: Callable[[bytes], bool]) -> LinkFault:
    """Ignore everything after certain bytes."""
    locked = [False]

    def change(raw: bytes) -> bytes:
        locked[0] = locked[0] or what(raw)
        return b"" if locked[0] else raw

    return takes(change)


def losing(count: int, after: Callable[[bytes], bool]) -> LinkFault:
    """Lose some frames after certain bytes."""
    left = [0]

    def change(raw: bytes) -> bytes:
        if after(raw):
            left[0] = count
            return raw
        lost = left[0] > 0
        left[0] -= lost
        return b"" if lost else raw

    return takes(change)


def at_both_ends(raw: bytes) -> bytes:
    """Set the bits of both limit switches in every message that has them."""
    return of(BITS, flip(8, 3))(of(STEPPER, flip(16, 3))(raw))


def is_unknown(raw: bytes) -> bool:
    return len(raw) >= 6 and not name_of(raw) and raw[5] == 1


def is_no_frame(raw: bytes) -> bool:
    if len(raw) < 6 or raw[5] != 1:
        return True
    return bool(raw[4] & DATA_FLAG) and len(raw) != 6 + int.from_bytes(raw[2:4], "little")


def is_request_with_packet(raw: bytes) -> bool:
    return len(raw) >= 6 and bool(raw[4] & DATA_FLAG) and "_REQ_" in name_of(raw)


def read_packets(raw: bytes) -> bytes:
    """Read the packet of an unknown frame as messages."""
    return raw[6:] if is_unknown(raw) and raw[4] & DATA_FLAG else raw


def answer_all(raw: bytes) -> bytes:
    """Accept messages for any other address."""
    return byte(4, 0x50)(raw) if len(raw) == 6 and raw[5] == 1 else raw


def answer_unknown(raw: bytes) -> bytes:
    return by_host("HW_REQ_INFO") if is_unknown(raw) else raw


def swapped_length(raw: bytes) -> bytes:
    return raw[:2] + raw[3:1:-1] + raw[4:]


def disorderly() -> Change:
    """Hold a reply back until the next one, from time to time."""
    held: list[bytes] = []
    count = [0]

    def change(raw: bytes) -> bytes:
        count[0] += 1
        if held:
            return raw + held.pop()
        if count[0] % 7 == 0:
            held.append(raw)
            return b""
        return raw

    return change


def running_away() -> LinkFault:
    """Report another position each time, in status and counter alike."""
    count = [0]

    def change(raw: bytes) -> bytes:
        count[0] += 1
        return plus(9, count[0])(raw)

    return LinkFault(to_host=of((STEPPER, "MOT_GET_POSCOUNTER"), change))


def in_bay_three(raw: bytes) -> bytes:
    """Make the card in bay 1 also answer for bay 3."""
    return byte(4, 0x21)(raw) if raw[4:5] == b"\x23" else raw


def filled_up(raw: bytes) -> bytes:
    """Read a packet that lacks a byte as one that ends with a zero."""
    if len(raw) > 6 and raw[4] & DATA_FLAG and "_SET_" in name_of(raw):
        return raw[:2] + (len(raw) - 5).to_bytes(2, "little") + raw[4:] + b"\0"
    return raw


VEL, INFO, DC, STEPPER = (
    "MOT_GET_VELPARAMS",
    "HW_GET_INFO",
    "MOT_GET_DCSTATUSUPDATE",
    "MOT_GET_STATUSUPDATE",
)
PIEZO, BITS, BAY = "PZ_GET_PZSTATUSUPDATE", "MOT_GET_STATUSBITS", "RACK_GET_BAYUSED"
ENABLED, ACK = "MOD_GET_CHANENABLESTATE", "MOT_ACK_DCSTATUSUPDATE"
START, STOP = "HW_START_UPDATEMSGS", "HW_STOP_UPDATEMSGS"
VEL_50, IDENTITY, STATUS = (
    "answers/0x50/MOT_REQ_VELPARAMS/1",
    "identification/0x50",
    "status/0x50/1",
)
STATUS, FRAMES, UPDATES = "status/0x50/1", "frames/0x50", "updates/start-stop"


def broken() -> dict[str, Broken]:
    """Return the defective controllers by description, with faults that have counted nothing yet."""
    return {name: Broken(*entry) for name, entry in {
    "no answer":
        ("TDC001", sends(VEL, dropped), VEL_50, FAIL, "was not answered"),
    "an answer that is too short":
        ("TDC001", sends(VEL, shorter), VEL_50, FAIL, "packet of 13 bytes instead of 14"),
    "two answers":
        ("TDC001", sends(VEL, twice), VEL_50, FAIL, "was answered 2 times"),
    "another channel":
        ("TDC001", sends(VEL, byte(6, 2)), VEL_50, FAIL, "channel 2; it should be for channel 1"),
    "a start velocity":
        ("TDC001", sends(VEL, byte(8, 1)), VEL_50, FAIL, "min_velocity is 1; it is always zero"),
    "values that change":
        ("TDC001", sends(VEL, every(2, plus(12, 1))), VEL_50, FAIL, "two different replies"),
    "an undocumented address":
        ("TDC001", sends(VEL, byte(5, 0x33)), VEL_50, FAIL, "goes from 0x33 to 0x01"),
    "the address of a bay":
        ("TDC001", sends(VEL, byte(5, 0x22)), VEL_50, FAIL, "went from 0x22 to 0x01; it should"),
    "a packet that is not announced":
        ("TDC001", sends(VEL, flip(4, DATA_FLAG)), VEL_50, FAIL, "announces no data packet"),
    "an extra message next to the answer":
        ("TDC001", sends(VEL, followed_by(frame(ENABLED, 1, 1))), VEL_50, FAIL,
         "in addition to the reply to MOT_REQ_VELPARAMS for channel 1 to 0x50, the controller sent "
         "MOD_GET_CHANENABLESTATE"),
    "an end of a move next to the answer":
        ("TDC001", sends(VEL, followed_by(frame("MOT_MOVE_COMPLETED", 1))), VEL_50, FAIL,
         "the controller sent MOT_MOVE_COMPLETED"),
    "an error next to the answer":
        ("TDC001", sends(VEL, followed_by(frame("HW_RESPONSE"))), VEL_50, NON_STRICT, "reports a fault"),
    "another message as the answer":
        ("TDC001", sends("MOT_GET_GENMOVEPARAMS", renamed("MOT_GET_MOVERELPARAMS")),
         "answers/0x50/MOT_REQ_GENMOVEPARAMS/1", FAIL, "received MOT_GET_MOVERELPARAMS"),
    "an undefined value":
        ("TDC001", sends(ENABLED, byte(3, 3)), "answers/0x50/MOD_REQ_CHANENABLESTATE/1", FAIL,
         "enable_state is 3; the document defines 1 (ENABLE), 2 (DISABLE)"),
    "a value out of range":
        ("TPZ001", sends("PZ_GET_PICONSTS", byte(9, 1)), "answers/0x50/PZ_REQ_PICONSTS/1", FAIL,
         "the document allows 0 to 255"),
    "a bay that answers as another":
        ("BBD102", sends(VEL, of_source(0x21, byte(5, 0x22))), "answers/0x21/MOT_REQ_VELPARAMS/1", FAIL,
         "went from 0x22 (bay 2) to 0x01; it should go from 0x21"),
    "a bay that answers as the motherboard":
        ("BSC102", LinkFault(of_source(0x22, byte(5, 0x11))), "frames/0x22", FAIL,
         "0x11 (the motherboard) to 0x01; it"),
    "a wrong length in the header":
        ("TDC001", sends(VEL, byte(2, 0)), FRAMES, FAIL, "with a packet of 0 bytes"),
    "big-endian lengths":
        ("TDC001", sends(VEL, swapped_length), FRAMES, FAIL, "3584 bytes"),
    "a destination that is not the host":
        ("TDC001", sends(VEL, byte(4, 0x82)), FRAMES, FAIL, "to 0x02, not from a controller to the host"),
    "an unused parameter":
        ("TST001", sends("HUB_GET_BAYUSED", byte(3, 9)), FRAMES, FAIL, "byte 3 is 0x09"),
    "a request to the host":
        ("TDC001", sends(VEL, followed_by(by_host("MOT_REQ_VELPARAMS", 1))), FRAMES, FAIL,
         "which only a host sends"),
    "hardware information that is too short":
        ("TDC001", sends(INFO, shorter), IDENTITY, FAIL, "packet of 83 bytes instead of 84"),
    "hardware information that is longer":
        ("TDC001", sends(INFO, longer), IDENTITY, NON_STRICT, "undocumented bytes 00 01 02 03 04 05"),
    "a serial number with nine digits":
        ("BBD103", sends(INFO, lambda raw: raw[:6] + (103_000_007).to_bytes(4, "little") + raw[10:]),
         "identification/0x11", NON_STRICT, "103000007 has 9 digits; the document states 8"),
    "one channel too many":
        ("TDC001", sends(INFO, byte(88, 2)), IDENTITY, FAIL, "channels is 2; TDC001 should have 1"),
    "a card with the channels of the rack":
        ("BBD103", sends(INFO, of_source(0x23, byte(88, 3))), "identification/0x23", FAIL,
         "BBD103 in bay 3 should have 1"),
    "no serial number":
        ("TDC001", sends(INFO, lambda raw: raw[:6] + bytes(4) + raw[10:]), IDENTITY, FAIL,
         "the serial number is 0"),
    "a serial number that changes":
        ("TDC001", sends(INFO, every(2, plus(6, 1))), IDENTITY, FAIL, "two different replies"),
    "an unreadable model number":
        ("TDC001", sends(INFO, byte(10, 7)), IDENTITY, FAIL, "the model number is"),
    "a cube that reports to be a motherboard":
        ("TDC001", sends(INFO, byte(18, 45)), IDENTITY, FAIL, "the hardware type is 45"),
    "an unused byte of the version that is set":
        ("TDC001", sends(INFO, byte(23, 1)), IDENTITY, NON_STRICT, "the last byte of the software version"),
    "a status with another position":
        ("TDC001", sends(DC, plus(8, 1)), STATUS, FAIL, "MOT_GET_POSCOUNTER, read before and after"),
    "an update with another position":
        ("TST001", sends(STEPPER, every(2, plus(8, 1))), STATUS, FAIL, "periodic MOT_GET_STATUSUPDATE has"),
    "the status of steppers":
        ("TDC001", sends(DC, renamed(STEPPER)), STATUS, FAIL, "received MOT_GET_STATUSUPDATE"),
    "a motion bit at rest":
        ("TDC001", sends(DC, flip(16, 0x10)), STATUS, FAIL, "reports moving_forward, but the position stays"),
    "motion in both directions":
        ("TDC001", sends(DC, flip(16, 0x30)), STATUS, FAIL, "moving_forward and moving_reverse at the same"),
    "an enabled channel that is reported as disabled":
        ("TDC001", sends(DC, flip(19, 0x80)), "enabled-bit/0x50/1", FAIL, "channel_enabled"),
    "a velocity at rest":
        ("TDC001", sends(DC, byte(12, 9)), STATUS, FAIL, "has the velocity 9, but the position stays"),
    "a position that runs away":
        ("BMS001", running_away(), STATUS, FAIL, "but no motion bit is set"),
    "both limit switches":
        ("BMS001", LinkFault(to_host=at_both_ends), STATUS, NON_STRICT, "both limit switches as active"),
    "other bits in each answer":
        ("TDC001", sends(BITS, flip(9, 4)), STATUS, FAIL, "differ in homed"),
    "other bits in each answer of a stepper":
        ("BMS001", sends(BITS, flip(9, 4)), STATUS, FAIL, "differ in homed"),
    "the status of channel 1 for channel 2":
        ("BMS002", sends(STEPPER, byte(6, 1)), "status/0x50/2", FAIL, "it should be for channel 2"),
    "an open loop reported as closed":
        ("BPC301", sends(PIEZO, flip(13, 4)), STATUS, FAIL, "closed_loop"),
    "no status at all":
        ("TPZ001", sends(PIEZO, dropped), STATUS, FAIL, "received nothing"),
    "an answer to a message without one":
        ("TDC001", takes_of("MOD_IDENTIFY", followed_by(by_host("HW_REQ_INFO"))), "identify/0x50", FAIL,
         "MOD_IDENTIFY to 0x50 was answered with HW_GET_INFO"),
    "one answer of fifty lost":
        ("TDC001", LinkFault(every(50, dropped)), "back-to-back", FAIL, "1 of 10 requests sent without"),
    "answers out of order":
        ("TDC001", LinkFault(disorderly()), "back-to-back", FAIL, "which was sent first"),
    "one answer of fifty sent twice":
        ("TDC001", LinkFault(every(50, twice)), "back-to-back", FAIL, "each request should be answered once"),
    "answers that are late":
        ("TDC001", LinkFault(late=0.02), "timing/reply", FAIL, "the PICS promises 10 ms"),
    "an answer to an unknown message":
        ("TDC001", takes(answer_unknown), "unknown-id/header", FAIL, "the controller sent HW_GET_INFO"),
    "packets that are read as messages":
        ("TDC001", takes(read_packets), "unknown-id/message-inside", FAIL, "the controller sent HW_GET_INFO"),
    "a frame lost after an unknown one":
        ("TDC001", losing(1, is_unknown), "unknown-id/packet", FAIL, "HW_REQ_INFO to 0x50 was not answered"),
    "a frame lost after a request with a packet":
        ("TDC001", losing(1, is_request_with_packet), "wrong-length/long", FAIL, "was not answered"),
    "no way out of a request with a packet":
        ("TDC001", locked_by(is_request_with_packet), "wrong-length/empty", FAIL, "was not answered"),
    "an incomplete setting that is accepted":
        ("TDC001", takes(filled_up), "wrong-length/short/0x50", NON_STRICT, "should change nothing"),
    "an answer at any address":
        ("TDC001", takes(answer_all), "foreign-destination/undocumented", NON_STRICT,
         "undocumented address"),
    "an answer for other units":
        ("BSC001", takes(answer_all), "foreign-destination/documented", NON_STRICT, "with HW_GET_INFO"),
    "no way out of a part of a header":
        ("TDC001", locked_by(is_no_frame), "truncated/header", FRAGILE, "was not answered in 6 attempts"),
    "a long way out of a part of a packet":
        ("TDC001", losing(2, is_no_frame), "truncated/packet", FRAGILE, "only at attempt 3"),
    "no way out of a stray byte":
        ("TDC001", locked_by(is_no_frame), "garbage/one", FRAGILE, "was not answered in 6 attempts"),
    "a long way out of garbage":
        ("TDC001", losing(1, is_no_frame), "garbage/many", FRAGILE, "only at attempt 2"),
    "an occupied bay called empty":
        ("BSC103", sends(BAY, byte(3, 2)), "bays/used", FAIL, "bay occupied, so the state should be 1"),
    "an undefined bay state":
        ("BSC103", sends(BAY, byte(3, 7)), "bays/used", FAIL, "bay_state is 7"),
    "another bay than requested":
        ("BSC103", sends(BAY, byte(2, 0)), "bays/used", FAIL, "bay ident 0; 1 was requested"),
    "no answer about bays":
        ("BSC103", sends(BAY, dropped), "bays/used", FAIL, "bay ident 0 was not answered"),
    "an empty bay that answers":
        ("BSC102", LinkFault(of_source(0x21, byte(5, 0x23)), in_bay_three), "bays/empty", FAIL,
         "0x23, a bay declared empty, was answered with HW_GET_INFO"),
    "no updates":
        ("TDC001", takes_of(START, dropped), UPDATES, FAIL, "MOT_GET_DCSTATUSUPDATE 0 times"),
    "updates without end":
        ("TDC001", takes_of(STOP, dropped), UPDATES, FAIL, "nothing more should come"),
    "updates of two bays for one start":
        ("BBD103", takes_of(START, lambda raw: raw + byte(4, 0x22)(raw)), UPDATES, FAIL,
         "0x21 also started MOT_GET_DCSTATUSUPDATE from 0x22"),
    "an end for two bays for one stop":
        ("BBD103", takes_of(STOP, lambda raw: raw + byte(4, 0x23)(raw)), UPDATES, FAIL,
         "0x21 also stopped MOT_GET_DCSTATUSUPDATE from 0x23"),
    "updates of a missing channel":
        ("TDC001", sends(DC, byte(6, 2)), UPDATES, FAIL, "is for channel 2; the target has 1"),
    "updates half as often":
        ("BBD102", sends(DC, every(2, dropped)), UPDATES, FAIL, "came 5.00 times a second"),
    "updates half as often, with a documented typical rate":
        ("TST001", sends(STEPPER, every(2, dropped)), UPDATES, NON_STRICT, "it should come 10 times"),
    "updates too seldom":
        ("BBD101", sends(DC, every(6, dropped)), "updates/rate", FAIL, "came 8.3"),
    "updates too often":
        ("TDC001", sends(DC, every(6, twice)), "updates/rate", NON_STRICT, "came 11.6"),
    "silence although keep-alive messages are sent":
        ("BBD102", takes_of(ACK, dropped), "updates/rate", FAIL,
         "came 50 times, the last one 5.0 s after the start, though MOT_ACK_DCSTATUSUPDATE was sent every"),
    "silence of a unit without keep-alive messages":
        ("TPZ001", sends(PIEZO, from_the(51, dropped)), "updates/rate", NON_STRICT, "came 50 times, the"),
    "silence for ever":
        ("TDC001", takes_of(ACK, dropped), "keep-alive", FAIL, "nor after HW_START_UPDATEMSGS was sent"),
    "an answer to a keep-alive message":
        ("TDC001", takes_of(ACK, followed_by(by_host("HW_REQ_INFO"))), "keep-alive-reply", FAIL,
         "MOT_ACK_DCSTATUSUPDATE to 0x50 was answered with HW_GET_INFO"),
    "silence too early":
        ("BSC103", sends(STEPPER, of_source(0x22, from_the(31, dropped))), "keep-alive", FAIL,
         "0x22 stopped after it had sent MOT_GET_STATUSUPDATE 30 times after the last MOT_ACK_"),
}.items()}  # fmt: skip


BROKEN = broken()
