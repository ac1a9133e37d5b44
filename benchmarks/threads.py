"""Eight threads share a session, with ten thousand calls each. Every reply must reach its own request.

There are four requests, which differ in message and address; two threads send each of them. The other end
answers with increasing numbers, and shuffles the replies from different addresses. A reply is right if it has
the class, the channel and the address of the request, if its number is higher than any number known before
the call, and if no other thread received it.

    python benchmarks/threads.py
    python benchmarks/threads.py --calls 300
"""

from __future__ import annotations

import argparse
import sys
import threading
import time
from dataclasses import dataclass

from peer import peer

from stagewire.links import open_link
from stagewire.protocols import FramedMessage
from stagewire.sessions import FramedSession
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m

CALLS = 10_000
EACH = 2
PATIENCE = 10.0


@dataclass(frozen=True)
class Question:
    """A request and its address."""

    request: FramedMessage
    reply: type[FramedMessage]
    dest: int


QUESTIONS = (
    Question(m.MotReqPosCounter(chan_ident=1), m.MotGetPosCounter, 0x21),
    Question(m.MotReqEncCounter(chan_ident=1), m.MotGetEncCounter, 0x21),
    Question(m.MotReqPosCounter(chan_ident=1), m.MotGetPosCounter, 0x22),
    Question(m.MotReqPosCounter(chan_ident=2), m.MotGetPosCounter, 0x22),
)


class Asker(threading.Thread):
    """One of the threads."""

    known = 0  # the highest number that any thread knows

    def __init__(self, session: FramedSession, question: Question, calls: int) -> None:
        super().__init__()
        self.session = session
        self.question = question
        self.calls = calls
        self.numbers: list[int] = []
        self.wrong: list[str] = []

    def run(self) -> None:
        """Send the request again and again."""
        try:
            for _ in range(self.calls):
                self.ask()
        except Exception as error:
            self.wrong.append(repr(error))

    def ask(self) -> None:
        """Send the request once, and check the reply."""
        asked = self.question
        before = Asker.known
        frame = self.session.ask(asked.request, (asked.reply,), asked.dest, PATIENCE)
        channel, number = frame.message.values().values()
        right = (
            type(frame.message) is asked.reply
            and channel == asked.request.values()["chan_ident"]
            and frame.source == asked.dest
            and number > before
        )
        if not right:
            self.wrong.append(f"{asked} answered by {frame}, known before: {before}")
        self.numbers.append(number)
        Asker.known = max(Asker.known, number)


def main(calls: int) -> bool:
    """Send all requests; return whether every reply was right."""
    kept = True
    for background in (True, False):
        with (
            peer("shuffle") as other,
            FramedSession(PROTOCOL, open_link(other.url), background=background) as session,
        ):
            Asker.known = 0
            askers = [Asker(session, question, calls) for question in QUESTIONS * EACH]
            start = time.perf_counter()
            for asker in askers:
                asker.start()
            for asker in askers:
                asker.join()
            seconds = time.perf_counter() - start
        wrong = [each for asker in askers for each in asker.wrong]
        numbers = [number for asker in askers for number in asker.numbers]
        twice = len(numbers) - len(set(numbers))
        missing = calls * len(askers) - len(numbers)
        print(
            f"{len(askers)} threads x {calls:,} calls {'with' if background else 'without'} a reader thread: "
            f"{len(wrong)} mispaired, {twice} taken twice, {missing} missing; "
            f"{len(numbers) / seconds:,.0f} calls a second",
            flush=True,
        )
        for each in wrong[:5]:
            print(f"  {each}")
        kept &= not (wrong or twice or missing)
    return kept


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--calls", type=int, default=CALLS)
    sys.exit(0 if main(parser.parse_args().calls) else 1)
