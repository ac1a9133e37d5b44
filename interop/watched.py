"""A served virtual controller, and what a client asked of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from stagewire.framing import End, Received
from stagewire_apt import PROTOCOL
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.serving.server import ServedController


class Watched:
    """A served controller whose requests are counted.

    :param served: the controller.
    """

    def __init__(self, served: ServedController) -> None:
        self._served = served
        self.url = served.url
        """Its URL for pyserial: ``socket://127.0.0.1:40123`` or the path of a pseudo-terminal."""
        self.asked: Counter[str] = Counter()
        """The messages of the client by name, or by id if the registry does not have them."""
        self.refused: list[str] = []
        """Why messages were refused: a sentence for each."""
        served.call(self._watch)

    @property
    def position(self) -> str:
        """The position of the first channel as its live table shows it, such as ``1.5000 mm``."""
        return self._served.call(lambda: self._served.instrument.rows()[-1].position)

    def _watch(self) -> None:
        instrument = self._served.instrument
        framer = PROTOCOL.framer(End.DEVICE)
        receive = instrument.receive

        def count_and_receive(data: bytes) -> None:
            for event in framer.feed(data):
                if isinstance(event, Received):
                    self.asked[event.frame.message.layout.message] += 1
                else:
                    self.asked[event.raw[:2][::-1].hex()] += 1
            receive(data)

        instrument.receive = count_and_receive
        instrument.on_refusal = self.refused.append


@contextmanager
def on_tcp(controller: VirtualController) -> Iterator[Watched]:
    """Serve a controller by TCP on this machine, until the block ends."""
    with controller, controller.tcp() as served:
        yield Watched(served)


@contextmanager
def on_pty(controller: VirtualController) -> Iterator[Watched]:
    """Serve a controller on a pseudo-terminal, until the block ends."""
    with controller, controller.pty() as served:
        yield Watched(served)
