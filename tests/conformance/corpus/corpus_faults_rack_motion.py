"""Faults of motion in the rack of the corpus: its bays are confused, or both have the same fault."""

from __future__ import annotations

import struct

from corpus_faults import Faults
from corpus_motor import HOME, MOVE
from corpus_rack import Card, Rack

FAULTS = Faults()
APART = ("slot-addressed-by-destination",)
HOMING, MOVING, JOGGING, RUNNING, STOPPING = 0x0443, 0x0453, 0x046A, 0x0457, 0x0465
ENABLING, COUNTING, SUSPENDING = 0x0210, 0x0410, 0x046B
COMPLETED = 0x0464


class Shares(Rack):
    """The base of racks in which both bays carry out some messages.

    :cvar SHARED: the ids of the messages.
    """

    SHARED: tuple[int, ...] = ()

    def cards_for(self, frame: bytes) -> list[Card]:
        cards = super().cards_for(frame)
        return self.cards if cards and self.is_shared(frame) else cards

    def is_shared(self, frame: bytes) -> bool:
        return int.from_bytes(frame[:2], "little") in self.SHARED


@FAULTS.moves(*APART)
class StopStopsBothBays(Shares):
    """MOVE_STOP to one bay stops both, and both report it."""

    SHARED = (STOPPING,)


@FAULTS.moves(*APART)
class StopHaltsBothBays(Rack):
    """MOVE_STOP to one bay also stops the other, which does not report it."""

    class CARD(Card):
        def move_stop(self, mode: int) -> None:
            super().move_stop(mode)
            for card in self.others:
                card.catch_up()
                card.halt()


@FAULTS.moves("stop-any-move", "stop-completed", *APART)
class StopReachesTheFirstBay(Rack):
    """MOVE_STOP always stops the first bay."""

    def cards_for(self, frame: bytes) -> list[Card]:
        cards = super().cards_for(frame)
        return self.cards[:1] if cards and frame[:2] == b"\x65\x04" else cards


@FAULTS.moves(*APART)
class DisablesBothBays(Shares):
    """Disabling one bay disables the other."""

    def is_shared(self, frame: bytes) -> bool:
        return frame[:2] == b"\x10\x02" and frame[3] == 2


@FAULTS.moves(*APART)
class EnableStateShared(Shares):
    """MOD_SET_CHANENABLESTATE sets both bays."""

    SHARED = (ENABLING,)


@FAULTS.moves(*APART)
class DisablingHaltsBothBays(Rack):
    """Disabling one bay stops the other, which stays enabled."""

    class CARD(Card):
        def set_enable_state(self, frame: bytes) -> None:
            super().set_enable_state(frame)
            for card in self.others if frame[3] == 2 else ():
                card.catch_up()
                card.halt()


@FAULTS.moves("velocity-parameters", *APART)
class AccelerationOfTheLastBay(Rack):
    """Both bays keep their own accelerations, but use that of the second bay."""

    class CARD(Card):
        def velocity_parameters(self) -> tuple[float, float]:
            acceleration, _ = Card.velocity_parameters(self.rack.cards[-1])
            return acceleration, super().velocity_parameters()[1]


@FAULTS.moves("velocity-parameters", *APART)
class AccelerationOfTheFirstBay(Rack):
    """Both bays keep their own accelerations, but use that of the first bay."""

    class CARD(Card):
        def velocity_parameters(self) -> tuple[float, float]:
            acceleration, _ = Card.velocity_parameters(self.rack.cards[0])
            return acceleration, super().velocity_parameters()[1]


@FAULTS.moves("velocity-parameters", *APART)
class AccelerationOfBothBays(Rack):
    """MOT_SET_VELPARAMS to one bay sets the acceleration of both."""

    class CARD(Card):
        def set(self, name: str, frame: bytes) -> None:
            super().set(name, frame)
            if name == "velocity":
                for card in self.others:
                    card.axis.kept[name] = (0, self.kept(name)[1], card.kept(name)[2])


@FAULTS.moves("velocity-parameters", *APART)
class SpeedOfTheFirstBay(Rack):
    """Both bays keep their own maximum velocities, but use that of the first bay."""

    class CARD(Card):
        def velocity_parameters(self) -> tuple[float, float]:
            _, speed = Card.velocity_parameters(self.rack.cards[0])
            return super().velocity_parameters()[0], speed


@FAULTS.moves("velocity-parameters", *APART)
class SpeedOfTheLastCommand(Rack):
    """Both bays keep their own velocity parameters, but use those that were set last in either bay."""

    last: tuple[int, ...] = ()

    class CARD(Card):
        def set(self, name: str, frame: bytes) -> None:
            super().set(name, frame)
            if name == "velocity":
                self.rack.last = self.kept(name)

        def velocity_parameters(self) -> tuple[float, float]:
            _, acceleration, speed = self.rack.last or self.kept("velocity")
            return acceleration, speed


@FAULTS.moves("jog-parameters", *APART)
class JogSpeedOfTheFirstBay(Rack):
    """Both bays keep their own jog parameters, but use the velocity of the first bay."""

    class CARD(Card):
        def jog_parameters(self) -> tuple[int, float, float, float]:
            mode, step, acceleration, _ = super().jog_parameters()
            return mode, step, acceleration, Card.jog_parameters(self.rack.cards[0])[3]


@FAULTS.moves("slot-source")
class EndsFromTheOtherBay(Rack):
    """MOVE_COMPLETED of each bay comes from the address of the other one."""

    class CARD(Card):
        def send_end(self, id: int, packet: bytes = b"") -> None:
            mine = self.address
            self.address = self.others[0].address if id == COMPLETED else mine
            super().send_end(id, packet)
            self.address = mine


@FAULTS.moves("slot-source")
class EndsFromTheFirstBay(Rack):
    """All messages that report the end of a motion come from the address of the first bay."""

    class CARD(Card):
        def send_end(self, id: int, packet: bytes = b"") -> None:
            mine, self.address = self.address, self.rack.cards[0].address
            super().send_end(id, packet)
            self.address = mine


@FAULTS.moves("slot-source")
class StopsFromTheOtherBay(Rack):
    """MOVE_STOPPED of each bay comes from the address of the other one."""

    class CARD(Card):
        def report_stopped(self) -> None:
            mine, self.address = self.address, self.others[0].address
            super().report_stopped()
            self.address = mine


@FAULTS.moves("slot-source")
class EndsFromTheMotherboard(Rack):
    """All messages that report the end of a motion come from the address of the motherboard."""

    class CARD(Card):
        def send_end(self, id: int, packet: bytes = b"") -> None:
            mine, self.address = self.address, self.rack.address
            super().send_end(id, packet)
            self.address = mine


@FAULTS.moves("slot-source", "move-completed", "absolute-move-completed", *APART)
class BothBaysCompleted(Rack):
    """When a move of one bay ends, both bays report it."""

    class CARD(Card):
        def report_completed(self) -> None:
            super().report_completed()
            for card in self.others:
                Card.report_completed(card)


@FAULTS.moves(
    "position-counter-set", "status-position", "stop-any-move", "position-counter-absolute"
)
class CounterJumpsAtAStop(Rack):
    """When a stopped motor has come to rest, its position counter jumps by 500."""

    class CARD(Card):
        def report_stopped(self) -> None:
            super().report_stopped()
            self.axis.zero -= 500


@FAULTS.moves("status-position", "stop-any-move", "position-counter-absolute")
class CounterJumpsWhenStopped(Rack):
    """A stop adds 500 to the position counter, before MOVE_STOPPED."""

    class CARD(Card):
        def report_stopped(self) -> None:
            self.axis.zero -= 500
            super().report_stopped()


@FAULTS.moves("status-updates-position", "updates-content")
class UpdatesOnePeriodOld(Rack):
    """Each status update has the content of the moment of the one before."""

    class CARD(Card):
        before = b""

        def start_updates(self, frame: bytes) -> None:
            super().start_updates(frame)
            self.before = self.status_packet()

        def send_update(self) -> None:
            self.send_status(self.STATUS, self.before)
            self.before = self.status_packet()


@FAULTS.moves("soft-limit-modes", "limit-switch-parameters")
class SoftLimitsIgnored(Rack):
    """Moves pass the software limits."""

    class CARD(Card):
        def span(self) -> tuple[float, float]:
            return 0.0, self.SPAN


@FAULTS.moves("velocity-parameters", "get-answers-request")
class SetsIgnoredInMotion(Rack):
    """A SET that arrives during a motion is ignored."""

    class CARD(Card):
        def set(self, name: str, frame: bytes) -> None:
            if not self.axis.motion:
                super().set(name, frame)


@FAULTS.moves("position-counter-set", "status-position", "position-counter-absolute")
class SecondBayCountsTwice(Rack):
    """The positions of the second bay are twice as high."""

    class CARD(Card):
        def position(self) -> int:
            return super().position() * (1 + self.bay)


@FAULTS.moves(*APART)
class HomesBothBays(Shares):
    """MOVE_HOME homes both bays."""

    SHARED = (HOMING,)


@FAULTS.moves(*APART)
class MovesBothBays(Shares):
    """MOVE_ABSOLUTE moves both bays."""

    SHARED = (MOVING,)


@FAULTS.moves(*APART)
class JogsBothBays(Shares):
    """MOVE_JOG moves both bays."""

    SHARED = (JOGGING,)


@FAULTS.moves(*APART)
class RunsBothBays(Shares):
    """MOVE_VELOCITY moves both bays."""

    SHARED = (RUNNING,)


@FAULTS.moves(*APART)
class CountsBothBays(Shares):
    """SET_POSCOUNTER sets the counters of both bays."""

    SHARED = (COUNTING,)


@FAULTS.moves(*APART)
class SuspendsBothBays(Shares):
    """SUSPEND_ENDOFMOVEMSGS to one bay suspends the messages of both."""

    SHARED = (SUSPENDING,)


@FAULTS.moves("status-position", *APART)
class StatusOfTheFirstBay(Rack):
    """Status messages of the second bay contain the position and the bits of the first."""

    class CARD(Card):
        def status_packet(self) -> bytes:
            first = self.rack.cards[0]
            first.now = self.now
            return Card.status_packet(first)


@FAULTS.moves("absolute-move", "absolute-move-long", *APART)
class TargetOfTheFirstBay(Rack):
    """An absolute move of the second bay goes to the last target of the first bay."""

    class CARD(Card):
        target = 0

        def move_absolute(self, position: int) -> None:
            self.target = position
            super().move_absolute(self.rack.cards[0].target or position)


@FAULTS.moves(*APART)
class OneBayAtATime(Rack):
    """A move of one bay ends a motion of the other."""

    class CARD(Card):
        def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
            for card in self.others if motion == MOVE else ():
                card.catch_up()
                if card.axis.motion and card.axis.motion != HOME:
                    card.halt()
            super().move_to(target, motion, acceleration, speed)


@FAULTS.moves("status-bits-same", "status-bits-alone")
class BitsOfTheFirstBay(Rack):
    """GET_STATUSBITS of the second bay contains the bits of the first."""

    class CARD(Card):
        def request_status_bits(self, frame: bytes) -> None:
            first = self.rack.cards[0]
            first.now = self.now
            self.send_packet(0x042A, struct.pack("<HI", 1, first.status_bits()), frame[5])


@FAULTS.moves("status-updates-position", "updates-content")
class UpdatesLagInMotion(Rack):
    """During a motion, each status update has the position of the moment of the one before."""

    class CARD(Card):
        before = 0.0

        def start_updates(self, frame: bytes) -> None:
            super().start_updates(frame)
            self.before = self.now

        def send_update(self) -> None:
            now, self.now = self.now, self.before
            place = self.position()
            self.now = self.before = now
            status = self.status_packet()
            if self.axis.motion:
                status = status[:2] + struct.pack("<i", place) + status[6:]
            self.send_status(self.STATUS, status)
