"""Faults of bytes and settings in the stepper controller of the corpus."""

from __future__ import annotations

import struct

from corpus_apt import HOST
from corpus_faults import Faults
from corpus_stepper import Stepper

FAULTS = Faults()
ANSWERED = ("request-answered", "get-answers-request")


@FAULTS.breaks("format-sizes", "data-length-bytes", "limit-switch-parameters")
class LimitParametersShort(Stepper):
    """MOT_GET_LIMSWITCHPARAMS lacks the mode of the software limits."""

    def setting_packet(self, name: str) -> bytes:
        packet = super().setting_packet(name)
        return packet[:-2] if name == "limits" else packet


@FAULTS.breaks("status-answer", *ANSWERED)
class StatusOfADcServo(Stepper):
    """Status requests are answered with the message of DC servo controllers."""

    STATUS = 0x0491


@FAULTS.breaks("status-position", "little-endian", "least-significant-first")
class StatusBigEndian(Stepper):
    """Status messages contain the position most significant byte first."""

    def status_packet(self) -> bytes:
        status = super().status_packet()
        return status[:2] + status[5:1:-1] + status[6:]


@FAULTS.breaks("status-position", "encoder-count-encoded-only")
class StatusFieldsSwapped(Stepper):
    """Status messages swap the position and the encoder count."""

    def status_packet(self) -> bytes:
        status = super().status_packet()
        return status[:2] + status[6:10] + status[2:6] + status[10:]


@FAULTS.breaks("move-completed-status", "move-stopped-status", "format-sizes", "data-length-bytes")
class EndWithTwelveBytes(Stepper):
    """The packets of MOVE_COMPLETED and MOVE_STOPPED have twelve bytes."""

    def send_end(self, id: int, packet: bytes = b"") -> None:
        super().send_end(id, packet[:12])


@FAULTS.breaks("home-completed", "channel-idents", "motor-single-channel")
class HomedOnChannelZero(Stepper):
    """MOVE_HOMED names channel 0."""

    def send_header(self, id: int, param1: int = 0, param2: int = 0, dest: int = HOST) -> None:
        super().send_header(id, 0 if id == 0x0444 else param1, param2, dest)


@FAULTS.breaks("channel-idents", "motor-single-channel", "single-channel-chan1")
class VelocityOfChannelTwo(Stepper):
    """MOT_GET_VELPARAMS names channel 2."""

    def setting_packet(self, name: str) -> bytes:
        packet = super().setting_packet(name)
        return b"\x02" + packet[1:] if name == "velocity" else packet


@FAULTS.breaks("absolute-parameter-alone")
class AbsolutePositionOfSixteenBits(Stepper):
    """MOT_SET_MOVEABSPARAMS keeps the low 16 bits only."""

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        return (values[0] & 0xFFFF,) if name == "absolute" else super().accepted(name, values)


@FAULTS.breaks("eeprom-save", "eeprom-message-id", "command-without-acknowledgement")
class SavingRestoresTheFactory(Stepper):
    """MOT_SET_EEPROMPARAMS restores the default parameters."""

    def receive(self, frame: bytes) -> None:
        super().receive(frame)
        if frame[:2] == b"\xb9\x04" and len(frame) == 10:
            id = int.from_bytes(frame[8:10], "little")
            for name, setting in self.SETTINGS.items():
                if setting.id == id:
                    self.axis.kept[name] = tuple(value + 1 for value in setting.values)


@FAULTS.breaks("command-without-acknowledgement", "eeprom-save", "eeprom-message-id")
class SavingAnswered(Stepper):
    """MOT_SET_EEPROMPARAMS is answered with itself."""

    def receive(self, frame: bytes) -> None:
        super().receive(frame)
        if frame[:2] == b"\xb9\x04":
            self.send_packet(0x04B9, frame[6:], frame[5])


@FAULTS.breaks("encoder-counter-signed", "encoder-counter-set")
class EncoderOfThreeBytes(Stepper):
    """SET_ENCCOUNTER ignores the most significant byte."""

    def set_encoder(self, frame: bytes) -> None:
        super().set_encoder(frame[:11] + bytes(1))


@FAULTS.breaks(*ANSWERED, "velocity-parameters")
class AnswersOneBehind(Stepper):
    """MOT_GET_VELPARAMS contains the values before the last change."""

    old: tuple[int, ...] | None = None

    def set(self, name: str, frame: bytes) -> None:
        before = self.kept(name)
        super().set(name, frame)
        if name == "velocity":
            self.old = before

    def setting_packet(self, name: str) -> bytes:
        if name == "velocity" and self.old is not None:
            new, self.axis.kept[name], self.old = self.kept(name), self.old, None
            packet = super().setting_packet(name)
            self.axis.kept[name] = new
            return packet
        return super().setting_packet(name)


@FAULTS.breaks(
    "data-length-bytes",
    "header-only-meaning",
    "length-in-header",
    "request-answered",
    "get-answers-request",
)
class ZeroBeforeEveryReply(Stepper):
    """A byte of zero precedes each MOT_GET_STATUSBITS.

    It is also a byte after the previous message, which the length in its header does not count.
    """

    def request_status_bits(self, frame: bytes) -> None:
        self.leaving += b"\0"
        super().request_status_bits(frame)


@FAULTS.breaks("info-serial-number", "serial-number-eight-digits", "serial-number-prefix")
class SerialNumberShort(Stepper):
    """The serial number has only six digits."""

    SERIAL = 801234


@FAULTS.breaks("serial-number-prefix", "info-model")
class SerialNumberOfAnotherProduct(Stepper):
    """The serial number begins with the digits of a TDC001."""

    SERIAL = 83801234


@FAULTS.breaks("get-messages-to-host", "reply-addresses-swapped")
class UpdatesToTheMotherboard(Stepper):
    """Status updates are addressed to 0x11."""

    def send_update(self) -> None:
        self.send_status(self.STATUS, self.status_packet(), 0x11)


@FAULTS.breaks("updates-until-stop", "status-updates-periodic", "keep-alive-usb-only")
class KeepAliveOnRs232(Stepper):
    """Over RS-232, status messages end after 50 without a keep-alive."""

    KEEP_ALIVE = True


@FAULTS.breaks("status-updates-every-100-ms", "status-updates-periodic")
class UpdatesTwiceAsOften(Stepper):
    """Status updates are sent twenty times a second."""

    def start_updates(self, frame: bytes) -> None:
        self.updates_every = 0.05
        super().start_updates(frame)


@FAULTS.breaks("status-updates-periodic", "status-updates-every-100-ms")
class UpdatesIrregular(Stepper):
    """Every fifth status update is missing."""

    count = 0

    def send_update(self) -> None:
        self.count += 1
        if self.count % 5:
            super().send_update()


@FAULTS.breaks("status-bits-same", "status-bits-alone")
class StatusBitsOfEightBits(Stepper):
    """GET_STATUSBITS contains only the low eight bits."""

    def request_status_bits(self, frame: bytes) -> None:
        self.send_packet(0x042A, struct.pack("<HI", 1, self.status_bits() & 0xFF), frame[5])


@FAULTS.breaks(*ANSWERED, "little-endian")
class ReplyOfAnotherMessage(Stepper):
    """MOT_REQ_MOVEABSPARAMS is answered with MOT_GET_MOVERELPARAMS."""

    def request(self, name: str, frame: bytes) -> None:
        super().request("relative" if name == "absolute" else name, frame)
