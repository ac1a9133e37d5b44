"""Faults of bytes and settings in the rack of the corpus."""

from __future__ import annotations

import struct

from corpus_apt import HOST
from corpus_faults import Faults
from corpus_rack import MOTHERBOARD_TYPE, Card, Rack

FAULTS = Faults()
APART = ("slot-addressed-by-destination",)
SOURCE = ("slot-source",)


@FAULTS.breaks(*SOURCE)
class RepliesFromTheMotherboard(Rack):
    """Everything that a bay sends has the address of the motherboard as its source."""

    class CARD(Card):
        def send_header(self, id: int, param1: int = 0, param2: int = 0, dest: int = HOST) -> None:
            super().send_header(id, param1, param2, dest)
            self.leaving[-1] = self.rack.address

        def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
            super().send_packet(id, packet, dest)
            self.leaving[-len(packet) - 1] = self.rack.address


@FAULTS.breaks(*SOURCE)
class RepliesFromTheFirstBay(Rack):
    """Everything that a bay sends has the address of the first bay as its source."""

    class CARD(Card):
        def send_header(self, id: int, param1: int = 0, param2: int = 0, dest: int = HOST) -> None:
            super().send_header(id, param1, param2, dest)
            self.leaving[-1] = self.rack.cards[0].address

        def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
            super().send_packet(id, packet, dest)
            self.leaving[-len(packet) - 1] = self.rack.cards[0].address


@FAULTS.breaks(*SOURCE)
class SettingsFromTheMotherboard(Rack):
    """Replies with a data packet come from the motherboard, except status messages."""

    class CARD(Card):
        def request(self, name: str, frame: bytes) -> None:
            mine, self.address = self.address, self.rack.address
            super().request(name, frame)
            self.address = mine


@FAULTS.breaks(*SOURCE)
class UpdatesFromTheMotherboard(Rack):
    """Status updates come from the address of the motherboard."""

    class CARD(Card):
        def send_update(self) -> None:
            mine, self.address = self.address, self.rack.address
            super().send_update()
            self.address = mine


@FAULTS.breaks(*SOURCE)
class SecondBayWithoutASource(Rack):
    """The second bay sends everything with the source 0."""

    class CARD(Card):
        def send_header(self, id: int, param1: int = 0, param2: int = 0, dest: int = HOST) -> None:
            super().send_header(id, param1, param2, dest)
            self.leaving[-1] *= not self.bay

        def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
            super().send_packet(id, packet, dest)
            self.leaving[-len(packet) - 1] *= not self.bay


@FAULTS.breaks("reply-addresses-swapped", *SOURCE)
class AddressesNotSwapped(Rack):
    """Replies of the bays have the addresses of the request."""

    class CARD(Card):
        def send_header(self, id: int, param1: int = 0, param2: int = 0, dest: int = HOST) -> None:
            super().send_header(id, param1, param2, dest)
            self.leaving[-2:] = bytes((self.address, HOST))

        def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
            super().send_packet(id, packet, dest)
            at = len(self.leaving) - len(packet)
            self.leaving[at - 2 : at] = bytes((self.address | 0x80, HOST))


@FAULTS.breaks("data-flag", "data-flag-checked-first", "destination-with-flag")
class EndsOfTheSecondBayWithoutTheFlag(Rack):
    """The end messages of the second bay have a data packet, but not the flag 0x80."""

    class CARD(Card):
        def send_end(self, id: int, packet: bytes = b"") -> None:
            at = len(self.leaving) + 4
            super().send_end(id, packet)
            if self.bay and len(self.leaving) > at:
                self.leaving[at] &= 0x7F


@FAULTS.breaks("move-completed-status", "move-stopped-status")
class EndsOfTheSecondBayWithoutData(Rack):
    """The end messages of the second bay are only headers."""

    class CARD(Card):
        def send_end(self, id: int, packet: bytes = b"") -> None:
            super().send_end(id, b"" if self.bay else packet)


@FAULTS.breaks("move-completed-status", "data-length-bytes", "format-sizes", "header-only-meaning")
class EndsOfTheSecondBayAreShort(Rack):
    """The end messages of the second bay have a packet of 6 bytes: channel and position."""

    class CARD(Card):
        def send_end(self, id: int, packet: bytes = b"") -> None:
            super().send_end(id, packet[:6] if self.bay else packet)


@FAULTS.breaks("bays-are-single-channel", "single-channel-chan1", "motor-single-channel")
class ChannelIsTheBay(Rack):
    """The second bay reports its settings for channel 2."""

    class CARD(Card):
        def setting_packet(self, name: str) -> bytes:
            return bytes((1 + self.bay,)) + super().setting_packet(name)[1:]


@FAULTS.breaks("status-always-chan1", "bays-are-single-channel")
class StatusOfChannelTwo(Rack):
    """Status messages of the second bay are for channel 2."""

    class CARD(Card):
        def status_packet(self) -> bytes:
            return bytes((1 + self.bay,)) + super().status_packet()[1:]


@FAULTS.breaks(
    "bays-are-single-channel", "motor-single-channel", "channel-idents", "move-completed-status"
)
class EndsOfChannelTwo(Rack):
    """End messages of the second bay are for channel 2."""

    class CARD(Card):
        def send_end(self, id: int, packet: bytes = b"") -> None:
            super().send_end(id, bytes((1 + self.bay,)) + packet[1:] if packet else packet)


@FAULTS.breaks("address-values", *APART)
class EmptyBayAnswers(Rack):
    """The third bay, which is empty, is answered by the second."""

    def cards_for(self, frame: bytes) -> list[Card]:
        return self.cards[1:] if frame[4] & 0x7F == 0x23 else super().cards_for(frame)


@FAULTS.breaks("bay-states")
class AllBaysOccupied(Rack):
    """The motherboard reports every bay as occupied."""

    def request_bay_used(self, frame: bytes) -> None:
        self.send_header(0x0061, frame[2], 1, frame[5])


@FAULTS.breaks("bay-used", "request-answered")
class BaysNotReported(Rack):
    """The motherboard does not answer RACK_REQ_BAYUSED."""

    def request_bay_used(self, frame: bytes) -> None:
        pass


@FAULTS.breaks("info-type")
class CardsAreMotherboards(Rack):
    """A card reports the hardware type of a motherboard."""

    class CARD(Card):
        HARDWARE = MOTHERBOARD_TYPE


@FAULTS.breaks("velocity-parameters", *APART)
class VelocityOfTheFirstBay(Rack):
    """MOT_GET_VELPARAMS of the second bay contains the values of the first."""

    class CARD(Card):
        def setting_packet(self, name: str) -> bytes:
            return Card.setting_packet(self.rack.cards[0] if name == "velocity" else self, name)


@FAULTS.breaks("position-counter-absolute", "position-counter-set", *APART)
class CounterOfTheFirstBay(Rack):
    """GET_POSCOUNTER of the second bay contains the position of the first."""

    class CARD(Card):
        def request_position(self, frame: bytes) -> None:
            first = self.rack.cards[0]
            first.now = self.now
            self.send_packet(0x0412, struct.pack("<Hi", 1, first.position()), frame[5])


@FAULTS.breaks("channel-enable", *APART)
class EnableStateOfTheFirstBay(Rack):
    """MOD_GET_CHANENABLESTATE of the second bay contains the state of the first."""

    class CARD(Card):
        def request_enable_state(self, frame: bytes) -> None:
            enabled = self.rack.cards[0].axis.enabled
            self.send_header(0x0212, 1, 1 if enabled else 2, frame[5])


@FAULTS.breaks("updates-start", "status-updates-periodic", *APART)
class UpdatesFromTheFirstBayOnly(Rack):
    """The second bay sends no status updates."""

    class CARD(Card):
        def start_updates(self, frame: bytes) -> None:
            if not self.bay:
                super().start_updates(frame)


@FAULTS.breaks(*APART)
class UpdatesStartedInBothBays(Rack):
    """HW_START_UPDATEMSGS starts the updates of both bays."""

    class CARD(Card):
        def start_updates(self, frame: bytes) -> None:
            for card in self.rack.cards:
                card.now = self.now
                Card.start_updates(card, frame)


@FAULTS.breaks(*APART)
class UpdatesStoppedInBothBays(Rack):
    """HW_STOP_UPDATEMSGS stops the updates of both bays."""

    class CARD(Card):
        def stop_updates(self, frame: bytes) -> None:
            for card in self.rack.cards:
                Card.stop_updates(card, frame)


@FAULTS.breaks(*APART)
class TwoAnswers(Rack):
    """A request for settings is answered by both bays."""

    class CARD(Card):
        def request(self, name: str, frame: bytes) -> None:
            super().request(name, frame)
            for card in self.others:
                Card.request(card, name, frame)


@FAULTS.breaks("jog-parameters", *APART)
class JogParametersOfBothBays(Rack):
    """MOT_SET_JOGPARAMS to one bay sets both."""

    class CARD(Card):
        def set(self, name: str, frame: bytes) -> None:
            for card in self.rack.cards if name == "jog" else [self]:
                Card.set(card, name, frame)
