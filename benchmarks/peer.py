"""The controller side of the benchmarks, in a separate process: just enough to reply to requests.

    with peer("answer") as other:
        session = FramedSession(PROTOCOL, open_link(other.url))

After a connection has ended, ``other.said()`` returns what the peer recorded about it.
"""

from __future__ import annotations

import json
import random
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from stagewire.protocols import FramedMessage
from stagewire_apt import messages as m

HEADER = 6
DEVICE, HOST = 0x50, 0x01
BIND = "127.0.0.1"

REQUEST = m.MotReqVelParams(chan_ident=1)
REPLY = m.MotGetVelParams(chan_ident=1, min_velocity=0, acceleration=4506, max_velocity=767367)
STOP = m.MotMoveStop(chan_ident=1, stop_mode=2)
UPDATES_A_SECOND = 10_000
UPDATES_AT_ONCE = 20


def answer(connection: socket.socket) -> None:
    """Answer each header with the same frame, immediately."""
    reply = REPLY.pack(dest=HOST, source=DEVICE)
    while data := connection.recv(4096):
        connection.sendall(reply * (len(data) // HEADER))


def ignore(connection: socket.socket) -> None:
    """Read everything and answer nothing."""
    while connection.recv(4096):
        pass


def flood(connection: socket.socket) -> None:
    """Send ten thousand updates a second and answer no request. Record and answer each stop."""
    update = m.MotGetDcStatusUpdate(chan_ident=1, position=0, velocity=0, status_bits=0)
    burst = update.pack(dest=HOST, source=DEVICE) * UPDATES_AT_ONCE
    stop = STOP.pack(dest=DEVICE, source=HOST)
    stopped = m.MotMoveStoppedHeader(chan_ident=1).pack(dest=HOST, source=DEVICE)
    over = threading.Event()
    sent = 0

    def say() -> None:
        nonlocal sent
        due = time.monotonic()
        while not over.is_set():
            try:
                connection.sendall(burst)
            except OSError:
                return
            sent += UPDATES_AT_ONCE
            due += UPDATES_AT_ONCE / UPDATES_A_SECOND
            time.sleep(max(0.0, due - time.monotonic()))

    began = time.monotonic()
    speaking = threading.Thread(target=say)
    speaking.start()
    came: list[float] = []
    with suppress(ConnectionError):  # the host may close with unread data
        while data := connection.recv(65536):
            for _ in range(data.count(stop)):
                came.append(time.monotonic())
                connection.sendall(stopped)
    over.set()
    speaking.join()
    print(json.dumps({"stops": came, "rate": sent / (time.monotonic() - began)}), flush=True)


def shuffle(connection: socket.socket) -> None:
    """Answer with increasing numbers, in order for each address and shuffled between addresses."""
    chance = random.Random(1)
    number = 0
    rest = b""
    while data := connection.recv(4096):
        rest += data
        asked: dict[int, list[bytes]] = {}
        for at in range(0, len(rest) - HEADER + 1, HEADER):
            asked.setdefault(rest[at + 4], []).append(rest[at : at + HEADER])
        rest = rest[len(rest) - len(rest) % HEADER :]
        while asked:
            dest = chance.choice(list(asked))
            header = asked[dest].pop(0)
            if not asked[dest]:
                del asked[dest]
            number += 1
            reply = COUNTERS[int.from_bytes(header[:2], "little")]
            connection.sendall(reply(header[2], number).pack(dest=HOST, source=dest))


COUNTERS: dict[int, Callable[[int, int], FramedMessage]] = {
    m.MotReqPosCounter.layout.id: m.MotGetPosCounter,
    m.MotReqEncCounter.layout.id: m.MotGetEncCounter,
}
"""The requests with a channel whose reply has a channel and a number, and these replies."""

PEERS: dict[str, Callable[[socket.socket], None]] = {
    "answer": answer,
    "ignore": ignore,
    "flood": flood,
    "shuffle": shuffle,
}


@dataclass
class Peer:
    """A running peer: its port, and what it recorded about a closed connection."""

    port: int
    process: subprocess.Popen[str]

    @property
    def url(self) -> str:
        """The URL of the peer."""
        return f"socket://{BIND}:{self.port}"

    def said(self) -> Any:
        """Return what the peer recorded about the connection that has just ended."""
        assert self.process.stdout is not None
        return json.loads(self.process.stdout.readline())


@contextmanager
def peer(kind: str) -> Iterator[Peer]:
    """Run a peer until the end of the block."""
    process = subprocess.Popen(
        [sys.executable, __file__, kind], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        yield Peer(int(process.stdout.readline()), process)
    finally:
        process.stdin.close()
        process.wait(30)
        process.stdout.close()


def serve(kind: str) -> None:
    """Accept connections, several at a time, until standard input ends."""
    with socket.create_server((BIND, 0)) as server:
        print(server.getsockname()[1], flush=True)

        def accept() -> None:
            while True:
                connection, _ = server.accept()
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                threading.Thread(target=attend, args=(connection,), daemon=True).start()

        def attend(connection: socket.socket) -> None:
            with connection, suppress(ConnectionError):  # the host may already be gone
                PEERS[kind](connection)

        threading.Thread(target=accept, daemon=True).start()
        sys.stdin.read()


if __name__ == "__main__":
    serve(sys.argv[1])
