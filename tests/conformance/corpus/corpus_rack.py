"""Firmware of a BSC102, a rack of two stepper controllers, written from Issue 3 of the APT document alone.

A motherboard at 0x11 and a card in each bay, at 0x21 and 0x22, share a line (pages 9 and 10). A card behaves
like a BSC101. Its methods are small, so that a fault is a subclass of the rack or of its cards
(``corpus_faults_rack*.py``).
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from corpus_apt import AptUnit
from corpus_stepper import Stepper

MOTHERBOARD, FIRST_BAY = 0x11, 0x21
OCCUPIED, EMPTY = 1, 2
MOTHERBOARD_TYPE, CARD_TYPE = 45, 21


class Card(Stepper):
    """The controller in a bay.

    :param clock: returns the time in seconds.
    :param rack: the rack.
    :param bay: its number, from 0.
    """

    SERIAL, MODEL, HARDWARE = 70801235, b"BSC102", CARD_TYPE

    def __init__(self, clock: Callable[[], float], rack: Rack, bay: int) -> None:
        super().__init__(clock)
        self.rack = rack
        self.bay = bay
        self.address = FIRST_BAY + bay

    @property
    def others(self) -> list[Card]:
        """The cards in the other bays."""
        return [card for card in self.rack.cards if card is not self]


class Rack(AptUnit):
    """The rack.

    :param clock: returns the time in seconds.
    """

    BAYS = 2
    CARD = Card
    address = MOTHERBOARD

    def __init__(self, clock: Callable[[], float]) -> None:
        super().__init__(clock)
        self.cards: list[Card] = []
        self.cards += [self.CARD(clock, self, bay) for bay in range(self.BAYS)]
        self.outputs = 0
        self.commands = {
            (0x0005, 0): self.request_info,
            (0x0060, 0): self.request_bay_used,
            (0x0226, 0): self.request_inputs,
            (0x0228, 0): self.set_outputs,
            (0x0229, 0): self.request_outputs,
        }

    # Time and bytes

    def due(self) -> float:
        """Return when something happens next; infinite if nothing does."""
        return min(card.due() for card in self.cards)

    def catch_up(self) -> None:
        """Do everything that is due, and take over what the cards have sent."""
        self.now = self.clock()
        for card in self.cards:
            self.leaving += self.sent_by(card, card.read())

    def sent_by(self, card: Card, data: bytes) -> bytes:
        """Return what goes to the host of the bytes that a card has sent."""
        return data

    def receive(self, frame: bytes) -> None:
        """Pass a message on to the card that it is for, or carry it out."""
        for card in self.cards_for(frame):
            card.catch_up()
            card.receive(frame[:4] + bytes((frame[4] & 0x80 | card.address,)) + frame[5:])
        super().receive(frame)
        self.catch_up()

    def cards_for(self, frame: bytes) -> list[Card]:
        """Return the cards that carry out a message: the one with its destination."""
        return [card for card in self.cards if card.address == frame[4] & 0x7F]

    # The motherboard

    def names_channel(self, id: int) -> bool:
        return False

    def request_info(self, frame: bytes) -> None:
        packet = struct.pack(
            "<I8sH4s64sH", 70801234, b"BSC102", MOTHERBOARD_TYPE, bytes((1, 0, 4, 0)), b"Rack", 0
        )  # fmt: skip
        self.send_packet(0x0006, packet.ljust(84, b"\0"), frame[5])

    def request_bay_used(self, frame: bytes) -> None:
        """Report whether a bay is occupied; bays are counted from 0, as in the example on page 23."""
        bay = frame[2]
        if bay < 10:
            self.send_header(0x0061, bay, OCCUPIED if bay < self.BAYS else EMPTY, frame[5])

    def request_inputs(self, frame: bytes) -> None:
        self.send_packet(0x0227, struct.pack("<I", 0), frame[5])

    def set_outputs(self, frame: bytes) -> None:
        if frame[2] < 16:
            self.outputs = frame[2]

    def request_outputs(self, frame: bytes) -> None:
        self.send_header(0x0230, self.outputs, 0, frame[5])
