"""Faults of settings, counters and the enable state in the TDC001 of the corpus."""

from __future__ import annotations

import struct

from corpus_faults import Faults
from corpus_tdc001 import Tdc001

FAULTS = Faults()


@FAULTS.breaks(
    "little-endian", "least-significant-first", "position-counter-signed", "position-counter-set"
)
class CounterBigEndian(Tdc001):
    """MOT_GET_POSCOUNTER contains the position most significant byte first."""

    def request_position(self, frame: bytes) -> None:
        self.send_packet(0x0412, b"\1\0" + struct.pack(">i", self.position()), frame[5])


@FAULTS.breaks("position-counter-signed", "position-counter-set")
class CounterNeverNegative(Tdc001):
    """MOT_GET_POSCOUNTER reports 0 for negative positions."""

    def request_position(self, frame: bytes) -> None:
        self.send_packet(0x0412, struct.pack("<Hi", 1, max(0, self.position())), frame[5])


@FAULTS.breaks("position-counter-set", "position-counter-signed")
class CounterNotSet(Tdc001):
    """SET_POSCOUNTER has no effect."""

    def set_position(self, frame: bytes) -> None:
        pass


@FAULTS.breaks("position-counter-set", "position-counter-signed")
class CounterOfSixteenBits(Tdc001):
    """SET_POSCOUNTER uses the low 16 bits only."""

    def set_position(self, frame: bytes) -> None:
        super().set_position(frame[:10] + bytes(2))


@FAULTS.breaks("encoder-counter-set", "encoder-counter-signed")
class EncoderNotSet(Tdc001):
    """SET_ENCCOUNTER sets the position counter instead."""

    def set_encoder(self, frame: bytes) -> None:
        self.set_position(frame)


@FAULTS.breaks("enable-state-read-back", "channel-enable", "enable-states")
class EnableStateInverted(Tdc001):
    """GET_CHANENABLESTATE reports the opposite state."""

    def request_enable_state(self, frame: bytes) -> None:
        self.send_header(0x0212, 1, 2 if self.axis.enabled else 1, frame[5])


@FAULTS.breaks("enable-states", "enable-state-read-back", "channel-enable")
class EnableStateZero(Tdc001):
    """GET_CHANENABLESTATE reports 0 for a disabled channel."""

    def request_enable_state(self, frame: bytes) -> None:
        self.send_header(0x0212, 1, 1 if self.axis.enabled else 0, frame[5])


@FAULTS.breaks("channel-enable", "enable-state-read-back")
class NeverDisabled(Tdc001):
    """SET_CHANENABLESTATE cannot disable the channel."""

    def set_enable_state(self, frame: bytes) -> None:
        self.axis.enabled = True


@FAULTS.breaks("dc-status-bit-enabled")
class EnabledBitStays(Tdc001):
    """The status reports a disabled channel as enabled."""

    def status_bits(self) -> int:
        return super().status_bits() | 0x80000000


@FAULTS.breaks("absolute-parameter-alone", "relative-parameter-alone")
class RelativeChangesAbsolute(Tdc001):
    """MOT_SET_MOVERELPARAMS also changes the absolute position."""

    def set(self, name: str, frame: bytes) -> None:
        super().set(name, frame)
        if name == "relative":
            self.axis.kept["absolute"] = self.kept("relative")


@FAULTS.breaks("velocity-parameters", "jog-parameters")
class JogChangesVelocity(Tdc001):
    """MOT_SET_JOGPARAMS also changes the velocity parameters."""

    def set(self, name: str, frame: bytes) -> None:
        super().set(name, frame)
        if name == "jog":
            self.axis.kept["velocity"] = (0, *self.kept("jog")[3:5])


@FAULTS.breaks("minimum-velocity-zero")
class MinimumVelocity(Tdc001):
    """The velocity parameters have a minimum velocity."""

    def setting_packet(self, name: str) -> bytes:
        packet = super().setting_packet(name)
        return packet[:2] + b"\x64" + packet[3:] if name == "velocity" else packet


@FAULTS.breaks("jog-minimum-velocity-zero")
class JogMinimumVelocity(Tdc001):
    """The jog parameters have a minimum velocity."""

    def setting_packet(self, name: str) -> bytes:
        packet = super().setting_packet(name)
        return packet[:8] + b"\x64" + packet[9:] if name == "jog" else packet


@FAULTS.breaks("jog-mode-values", "jog-parameters")
class JogModeFromZero(Tdc001):
    """The jog parameters report the modes as 0 and 1."""

    def setting_packet(self, name: str) -> bytes:
        packet = super().setting_packet(name)
        return packet[:2] + bytes((packet[2] - 1,)) + packet[3:] if name == "jog" else packet


@FAULTS.breaks("backlash-parameters")
class BacklashNeverNegative(Tdc001):
    """The backlash distance loses its sign."""

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        return (abs(values[0]),) if name == "general" else super().accepted(name, values)


@FAULTS.breaks("velocity-parameters")
class VelocityOfSixteenBits(Tdc001):
    """The maximum velocity is kept in 16 bits."""

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        kept = super().accepted(name, values)
        return (*kept[:2], kept[2] & 0xFFFF or 1) if kept and name == "velocity" else kept


@FAULTS.breaks("velocity-parameters")
class VelocityFieldsSwapped(Tdc001):
    """MOT_SET_VELPARAMS stores the acceleration as the velocity, and vice versa."""

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        kept = super().accepted(name, values)
        return (0, kept[2], kept[1]) if kept and name == "velocity" else kept


@FAULTS.breaks("led-modes", "led-mode-lights")
class LedModesAllOrNothing(Tdc001):
    """The LED modes can only be set together."""

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        return (11 if values[0] else 0,) if name == "led" else super().accepted(name, values)


@FAULTS.breaks("pot-parameters", "pot-deflection-range")
class PotVelocitiesOfTwelveBits(Tdc001):
    """The velocities of the potentiometer are kept in 12 bits."""

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        if name != "pot":
            return super().accepted(name, values)
        return tuple(v if at % 2 == 0 else v & 0xFFF for at, v in enumerate(values))


@FAULTS.breaks("button-positions")
class ButtonPositionsSwapped(Tdc001):
    """MOT_SET_BUTTONPARAMS swaps the two positions."""

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        if name == "buttons":
            values = (values[0], values[2], values[1], *values[3:])
        return super().accepted(name, values)


@FAULTS.breaks("limit-switch-parameters", "limit-switch-values", "soft-limit-modes")
class SoftLimitNotKept(Tdc001):
    """MOT_SET_LIMSWITCHPARAMS keeps the old software limits."""

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        if name == "limits":
            values = (*values[:2], *self.kept("limits")[2:4], values[4])
        return super().accepted(name, values)


@FAULTS.breaks("dc-pid-parameters", "dc-pid-filter-bits")
class PidDifferentialNotKept(Tdc001):
    """MOT_SET_DCPIDPARAMS does not change the differential gain."""

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        if name == "pid":
            values = (*values[:2], self.kept("pid")[2], *values[3:])
        return super().accepted(name, values)


@FAULTS.breaks("home-parameters")
class HomeVelocityNotKept(Tdc001):
    """MOT_SET_HOMEPARAMS does not change the homing velocity."""

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        if name == "home":
            values = (*values[:2], self.kept("home")[2], values[3])
        return super().accepted(name, values)
