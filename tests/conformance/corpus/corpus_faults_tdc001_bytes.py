"""Faults of bytes and messages in the TDC001 of the corpus."""

from __future__ import annotations

import math
import struct

from corpus_apt import HOST, UNIT
from corpus_faults import Faults
from corpus_tdc001 import Tdc001

FAULTS = Faults()
ANSWERED = ("request-answered", "get-answers-request")


@FAULTS.breaks("info-length")
class InfoTooLong(Tdc001):
    """The packet of HW_GET_INFO has ten bytes too many."""

    def info_packet(self) -> bytes:
        return super().info_packet() + bytes(10)


@FAULTS.breaks("info-channels")
class InfoWithoutChannels(Tdc001):
    """HW_GET_INFO reports no channels."""

    def info_packet(self) -> bytes:
        return super().info_packet()[:-2] + bytes(2)


@FAULTS.breaks(
    "little-endian", "least-significant-first", "info-serial-number", "serial-number-eight-digits"
)
class SerialNumberBigEndian(Tdc001):
    """The serial number is sent most significant byte first."""

    def info_packet(self) -> bytes:
        packet = super().info_packet()
        return packet[3::-1] + packet[4:]


@FAULTS.breaks("info-model")
class ModelNotText(Tdc001):
    """The model number contains bytes that are not characters."""

    MODEL = b"\xff\x01\x02DC001"


@FAULTS.breaks("format-sizes", "data-length-bytes", "jog-parameters")
class JogParametersShort(Tdc001):
    """MOT_GET_JOGPARAMS is one byte short."""

    def setting_packet(self, name: str) -> bytes:
        packet = super().setting_packet(name)
        return packet[:-1] if name == "jog" else packet


@FAULTS.breaks("data-length-bytes")
class JogParametersLengthWrong(Tdc001):
    """The header of MOT_GET_JOGPARAMS announces one byte more than follows."""

    def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
        super().send_packet(id, packet, dest)
        if id == 0x0418:
            del self.leaving[-1:]


@FAULTS.breaks("get-messages-to-host", "reply-addresses-swapped")
class ReplyToTheMotherboard(Tdc001):
    """MOT_GET_POSCOUNTER is addressed to 0x11."""

    def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
        super().send_packet(id, packet, 0x11 if id == 0x0412 else dest)


@FAULTS.breaks("reply-addresses-swapped", "slot-source", "generic-unit-address")
class EveryReplyFromABay(Tdc001):
    """All messages have the source address of bay 0."""

    def send_header(self, id: int, param1: int = 0, param2: int = 0, dest: int = HOST) -> None:
        self.leaving += struct.pack("<HBBBB", id, param1, param2, dest, 0x21)

    def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
        super().send_packet(id, packet, dest)
        self.leaving[-len(packet) - 1] = 0x21


@FAULTS.breaks("destination-with-flag", "data-flag", "data-follows-flag", "header-only-meaning")
class DataFlagMissing(Tdc001):
    """MOT_GET_VELPARAMS has data, but no flag that announces them."""

    def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
        super().send_packet(id, packet, dest)
        if id == 0x0415:
            self.leaving[-len(packet) - 2] = HOST


@FAULTS.breaks("little-endian", "least-significant-first", "length-in-header", "data-length-bytes")
class LengthBigEndian(Tdc001):
    """The length of MOT_GET_BUTTONPARAMS is sent most significant byte first."""

    def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
        super().send_packet(id, packet, dest)
        if id == 0x04B8:
            at = len(self.leaving) - len(packet) - 4
            self.leaving[at : at + 2] = len(packet).to_bytes(2, "big")


@FAULTS.breaks("dc-status-always-chan1")
class StatusOfChannelZero(Tdc001):
    """Status messages name channel 0."""

    def status_packet(self) -> bytes:
        return bytes(2) + super().status_packet()[2:]


@FAULTS.breaks("format-sizes", "dc-status-answer", "data-length-bytes")
class StatusWithoutReservedField(Tdc001):
    """Status messages lack the reserved field."""

    def status_packet(self) -> bytes:
        status = super().status_packet()
        return status[:8] + status[10:]


@FAULTS.breaks(
    "dc-status-bits", "dc-status-bits-motion", "status-bits-same", "dc-status-bit-enabled"
)
class StatusBitsBigEndian(Tdc001):
    """Status messages contain the bits most significant byte first."""

    def status_packet(self) -> bytes:
        status = super().status_packet()
        return status[:10] + status[:9:-1]


@FAULTS.breaks(*ANSWERED, "unit-messages")
class PidNotAnswered(Tdc001):
    """MOT_REQ_DCPIDPARAMS is not answered."""

    def request(self, name: str, frame: bytes) -> None:
        if name != "pid":
            super().request(name, frame)


@FAULTS.breaks("never-set-or-request-to-host", *ANSWERED)
class AnswersWithASet(Tdc001):
    """MOT_REQ_GENMOVEPARAMS is answered with a SET."""

    def request(self, name: str, frame: bytes) -> None:
        if name == "general":
            self.send_packet(0x043A, self.setting_packet(name), frame[5])
        else:
            super().request(name, frame)


@FAULTS.breaks("command-without-acknowledgement", "get-answers-request")
class SetAcknowledged(Tdc001):
    """MOT_SET_VELPARAMS is answered with a GET."""

    def set(self, name: str, frame: bytes) -> None:
        super().set(name, frame)
        if name == "velocity":
            self.request(name, frame)


@FAULTS.breaks("command-without-acknowledgement")
class IdentifyAnswered(Tdc001):
    """MOD_IDENTIFY is answered with an HW_GET_INFO."""

    def identify(self, frame: bytes) -> None:
        self.request_info(frame)


@FAULTS.breaks(*ANSWERED)
class AnswersTwice(Tdc001):
    """MOT_REQ_POSCOUNTER is answered twice."""

    def request_position(self, frame: bytes) -> None:
        super().request_position(frame)
        super().request_position(frame)


@FAULTS.breaks(*ANSWERED)
class AnswersLate(Tdc001):
    """MOT_REQ_LIMSWITCHPARAMS is answered after five seconds."""

    later = math.inf

    def request(self, name: str, frame: bytes) -> None:
        if name == "limits":
            self.later = self.now + 5
        else:
            super().request(name, frame)

    def due(self) -> float:
        return min(self.later, super().due())

    def catch_up(self) -> None:
        if self.later <= self.clock():
            self.later = math.inf
            self.send_packet(0x0425, self.setting_packet("limits"))
        super().catch_up()


KEEP_ALIVE = ("keep-alive-fifty", "keep-alive-counts-status")


@FAULTS.breaks(*KEEP_ALIVE)
class SilentAfterTen(Tdc001):
    """The controller sends only ten status messages without a keep-alive."""

    def send_status(self, id: int, packet: bytes, dest: int = HOST) -> None:
        if self.since_alive < 10:
            super().send_status(id, packet, dest)


@FAULTS.breaks(*KEEP_ALIVE, "keep-alive-once-a-second", "updates-until-stop")
class KeepAliveIgnored(Tdc001):
    """A keep-alive does not reset the count of status messages."""

    def server_alive(self, frame: bytes) -> None:
        pass


@FAULTS.breaks(*KEEP_ALIVE)
class NeverSilent(Tdc001):
    """The controller needs no keep-alive."""

    KEEP_ALIVE = False


@FAULTS.breaks("keep-alive-no-response", "command-without-acknowledgement")
class KeepAliveAnswered(Tdc001):
    """A keep-alive is answered with a status message."""

    def server_alive(self, frame: bytes) -> None:
        super().server_alive(frame)
        self.request_status(frame)


@FAULTS.breaks("request-answered")
class StuckAfterAnUnknownMessage(Tdc001):
    """After a message with an unknown id, the controller answers nothing for 30 s."""

    stuck = -math.inf

    def receive(self, frame: bytes) -> None:
        id = int.from_bytes(frame[:2], "little")
        if not any(id == known for known, _ in self.commands):
            self.stuck = self.now + 30
        if self.now > self.stuck:
            super().receive(frame)


@FAULTS.breaks("get-answers-request")
class UnknownMessageReturned(Tdc001):
    """A message with an unknown id is answered with itself.

    It is not an error message, and later requests are answered. The controller sends what nothing requested.
    """

    def receive(self, frame: bytes) -> None:
        id = int.from_bytes(frame[:2], "little")
        if frame[4] & 0x7F == UNIT and not any(id == known for known, _ in self.commands):
            self.leaving += frame
        super().receive(frame)


@FAULTS.breaks(
    "data-follows-flag",
    "length-in-header",
    "data-flag",
    "data-length-bytes",
)
class UnknownPacketNotSkipped(Tdc001):
    """The packet of an unknown message is read as the next header."""

    def frame_size(self, data: bytearray) -> int:
        id = int.from_bytes(data[:2], "little")
        known = any(id == each for each, _ in self.commands)
        return super().frame_size(data) if known else 6


@FAULTS.breaks("request-answered")
class OneMessageAtATime(Tdc001):
    """Of several messages that arrive together, only the first is carried out."""

    def write(self, data: bytes) -> None:
        self.arriving.clear()
        size = self.frame_size(bytearray(data))
        super().write(data[:size])


@FAULTS.breaks("generic-unit-address", "slot-addressed-by-destination", "address-values")
class AnswersForOthers(Tdc001):
    """Messages to any other address are carried out and answered."""

    def receive(self, frame: bytes) -> None:
        super().receive(frame[:4] + bytes((frame[4] & 0x80 | UNIT,)) + frame[5:])


@FAULTS.breaks("home-completed", "header-only-meaning", "format-sizes")
class HomedWithAPacket(Tdc001):
    """MOVE_HOMED has a status packet."""

    def send_end(self, id: int, packet: bytes = b"") -> None:
        super().send_end(id, packet or self.status_packet())


@FAULTS.breaks("move-completed-status", "format-sizes")
class CompletedWithoutStatus(Tdc001):
    """MOVE_COMPLETED is only a header."""

    def report_completed(self) -> None:
        self.send_end(0x0464)


@FAULTS.breaks("move-no-response")
class MoveAcknowledged(Tdc001):
    """A relative move is answered at once with a status message."""

    def move_relative(self, distance: int) -> None:
        self.send_status(self.STATUS, self.status_packet())
        super().move_relative(distance)


@FAULTS.breaks("no-error-in-normal-operation")
class ErrorAfterEveryMove(Tdc001):
    """HW_RESPONSE follows every move."""

    def report_completed(self) -> None:
        super().report_completed()
        self.send_header(0x0080)


@FAULTS.breaks("unused-parameters-zero")
class ParameterNotZero(Tdc001):
    """The unused parameter of MOVE_HOMED has a value."""

    def send_header(self, id: int, param1: int = 0, param2: int = 0, dest: int = HOST) -> None:
        super().send_header(id, param1, 0x55 if id == 0x0444 else param2, dest)


@FAULTS.breaks(*ANSWERED, "data-length-bytes", "length-in-header", "data-follows-flag")
class EveryFortiethReplyTruncated(Tdc001):
    """Every fortieth reply with data lacks its last three bytes."""

    sent = 0

    def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
        super().send_packet(id, packet, dest)
        self.sent += 1
        if self.sent % 40 == 0:
            del self.leaving[-3:]
